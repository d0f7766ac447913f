"""What is read is never written over."""

import inspect
import itertools
import os

import pytest

from hydrodamp.cli import main

COMMANDS = [main.new, *itertools.chain.from_iterable(main.COMMANDS.values())]
ALONE = "--vehicle planar.yaml --model mine.yaml --mapping map.yaml"
PARTS = "--train 0:9 --test 9:20 --vehicle planar.yaml --models linear --methods ls --out out"
IN_THE_WAY = [
    *(
        (f"identify {log} {ALONE} --out {out}", "is one of the inputs")
        for log in ("a.csv", "--train a.csv")
        for out in ("a.csv", "planar.yaml", "map.yaml", "mine.yaml", "sub/../a.csv", "link.csv")
    ),
    *(
        (f"simulate a.csv --vehicle planar.yaml --damping d.json --out {out}", "of the inputs")
        for out in ("a.csv", "planar.yaml", "d.json")
    ),
    ("convert a.csv --out a.csv", "one of the inputs"),
    ("convert sub --out sub/c.csv", "one of the inputs"),
    *(
        (f"probe a.csv --vehicle planar.yaml --draft {out}", "one of the inputs")
        for out in ("a.csv", "planar.yaml", "link.csv")
    ),
    ("vehicle new a.csv --log a.csv", "one of the inputs"),
    ("live --vehicle planar.yaml --model linear --source a.csv --checkpoint a.csv", "the inputs"),
    (f"compare out/table.csv {PARTS}", "out/table.csv: is one of the inputs"),
    (f"compare out/fits/b.json {PARTS}", "out/fits/b.json: is one of the inputs"),
]


@pytest.mark.parametrize(("line", "said"), IN_THE_WAY)
def test_inputs_are_kept(folder, call, line, said):
    (folder / "sub").mkdir()
    (folder / "sub" / "c.csv").write_bytes((folder / "a.csv").read_bytes())
    (folder / "out" / "fits").mkdir(parents=True)
    (folder / "map.yaml").write_text("{time: time, velocity: {u: u}}", "utf-8")
    (folder / "mine.yaml").write_text("{name: mine, terms: {X: u}}", "utf-8")
    for name in ("d.json", "out/table.csv", "out/fits/b.json"):
        (folder / name).write_text("read", "utf-8")
    os.link(folder / "a.csv", folder / "link.csv")
    before = {path: path.read_bytes() for path in folder.rglob("*.*")}
    done = call(line if line.startswith("live") else f"{line} --force", 2)
    assert said in done.stderr
    assert {path: path.read_bytes() for path in folder.rglob("*.*")} == before


@pytest.mark.parametrize("command", COMMANDS)
def test_types_tell_outputs_from_inputs(command):
    """A path is an output of the call, a text may name an input: so each command is checked."""
    parameters = inspect.signature(command, eval_str=True).parameters
    outputs = {name for name, each in parameters.items() if "Path" in str(each.annotation)}
    sizes = {name for name, each in parameters.items() if "float" in str(each.annotation)}
    names = {"out", "file", "draft", "checkpoint", "into"} - sizes  # a ship has a draft, too
    assert outputs - {"folder"} == names & {*parameters}
    assert "folder" not in outputs or command.__name__ == "report"


@pytest.mark.usefixtures("undrawn")
def test_a_folder_may_hold_its_log(folder, call):
    (folder / "out").mkdir()
    (folder / "a.csv").rename(folder / "out" / "a.csv")
    call(f"compare out/a.csv {PARTS}")
