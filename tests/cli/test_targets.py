"""What is read is never written over."""

from __future__ import annotations

import hashlib
import os
import warnings
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

from hydrodamp.cli.output import warned, warnings_as_notes
from hydrodamp.cli.targets import record
from hydrodamp.errors import GapWarning

Call = Callable[..., Result]


@pytest.mark.parametrize("out", ["a.csv", "planar.yaml", "map.yaml", "mine.yaml", "sub/../a.csv"])
@pytest.mark.parametrize("log", ["a.csv", "--train a.csv"])
def test_identify_keeps_its_inputs(folder: Path, call: Call, log: str, out: str) -> None:
    (folder / "sub").mkdir()
    (folder / "map.yaml").write_text("{time: time, velocity: {u: u}}", "utf-8")
    (folder / "mine.yaml").write_text("{name: mine, terms: {X: u}}", "utf-8")
    before = (folder / out).read_bytes()
    done = call(
        f"identify {log} --vehicle planar.yaml --model mine.yaml --mapping map.yaml --out {out}"
    )
    assert done.exit_code == 2
    assert f"error: `--out {out}` is one of the inputs" in done.stderr
    assert (folder / out).read_bytes() == before


def test_a_link_to_an_input_is_the_input(folder: Path, call: Call) -> None:
    os.link(folder / "a.csv", folder / "other.csv")
    done = call("identify a.csv --vehicle planar.yaml --model linear --out other.csv")
    assert done.exit_code == 2
    assert "one of the inputs" in done.stderr


def test_simulate_keeps_its_inputs(folder: Path, call: Call) -> None:
    call("identify a.csv --vehicle planar.yaml --model linear --method ls --out d.json")
    for out in ("a.csv", "planar.yaml", "d.json"):
        before = (folder / out).read_bytes()
        done = call(f"simulate a.csv --vehicle planar.yaml --damping d.json --out {out}")
        assert done.exit_code == 2
        assert "one of the inputs" in done.stderr
        assert (folder / out).read_bytes() == before


@pytest.mark.parametrize("out", ["a.csv", "b.csv", "planar.yaml", "mine.yaml"])
def test_compare_keeps_its_inputs(folder: Path, call: Call, out: str) -> None:
    (folder / "mine.yaml").write_text("{name: mine, terms: {X: u}}", "utf-8")
    line = "compare --train a.csv --test b.csv --vehicle planar.yaml --models linear,mine.yaml"
    done = call(f"{line} --out {out}")
    assert done.exit_code == 2
    assert "one of the inputs" in done.stderr


def test_compare_keeps_an_input_in_its_folder(folder: Path, call: Call) -> None:
    (folder / "out").mkdir()
    (folder / "a.csv").rename(folder / "out" / "table.csv")
    line = "compare out/table.csv --train 0:20 --test 20:40 --vehicle planar.yaml --models linear"
    done = call(f"{line} --methods ls --out out")
    assert done.exit_code == 2
    assert "would replace the input out/table.csv" in done.stderr
    (folder / "out" / "fits").mkdir()
    (folder / "out" / "table.csv").rename(folder / "out" / "fits" / "b.json")
    fit = line.replace("table.csv", "fits/b.json")
    assert "would replace" in call(f"{fit} --methods ls --out out").stderr
    (folder / "out" / "fits" / "b.json").rename(folder / "out" / "a.csv")
    assert call(f"{line.replace('table', 'a')} --methods ls --out out").exit_code == 0


def test_a_file_where_a_folder_is_asked_for(folder: Path, call: Call) -> None:
    (folder / "afile").write_text("", "utf-8")
    done = call(
        "compare a.csv --train 0:20 --test 20:40 --vehicle planar.yaml --models linear --out afile"
    )
    assert done.exit_code == 2
    assert "`--out afile` is a file: name a folder" in done.stderr


def test_a_run_says_what_it_read_and_was_warned_of(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["x", "compare", "a b.csv"])
    (tmp_path / "a b.csv").write_bytes(b"1")
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "c\nd.csv").write_bytes(b"2")
    with warnings_as_notes():
        for _ in range(2):
            warnings.warn("split at a gap", GapWarning, stacklevel=1)
        words = record(("a b.csv", None, "vt690", "runs", "a b.csv"))
    assert words["command"] == "hydrodamp compare 'a b.csv'"
    assert words["warnings"] == "split at a gap"
    one, two = (hashlib.sha256(each).hexdigest() for each in (b"1", b"2"))
    assert words["files"].splitlines() == [
        f"{one}  a b.csv",
        f"{two}  runs/c\N{REPLACEMENT CHARACTER}d.csv",
    ]
    assert words["versions"].startswith("Python 3")
    assert warned() == ()
    assert "warnings" not in record(())
