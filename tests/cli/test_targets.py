"""What is read is never written over."""

import inspect
import itertools

import pytest

from hydrodamp.cli import main

COMMANDS = [main.new, *itertools.chain.from_iterable(main.COMMANDS.values())]
PARTS = "--train 0:9 --test 9:20 --vehicle planar.yaml --models linear --methods ls --out out"


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
