"""Ctrl-C and --resume: finished fits are kept, and only the rest is done again."""

import json
import os
import pty
import re
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import typer

import hydrodamp as hd
from hydrodamp.cli import report
from hydrodamp.cli.output import handle_errors
from hydrodamp.identification.adaptive import AdaptiveIdentifier
from hydrodamp.results import MANIFEST
from hydrodamp.validation import compare as validation
from table_rows import rows

from .conftest import interrupted_at, motion, read_until

SOURCE = Path(hd.__file__).resolve().parents[1]
LINE = (
    "compare ab.csv --vehicle planar.yaml --train one --test two --methods ls,ai "
    "--models linear,coe,prestero,fossen --out out"
)


FITS = AdaptiveIdentifier, "identify"
REPLAYS = validation, "replay"
DRAWING = report, "draw_diagnostics"


def interrupt(patch, place, at):
    """Interrupt the n-th call of a function at its place, an object and a name."""
    patch.setattr(*place, interrupted_at(at, getattr(*place)))


def document(folder="out"):
    return json.loads((Path(folder) / "comparison.json").read_text("utf-8"))


pytestmark = pytest.mark.usefixtures("undrawn")


@pytest.fixture
def whole(folder, call):
    """What comes out when nothing interrupts."""
    call(LINE.replace("--out out", "--out whole"))
    return document("whole")


@pytest.mark.slow
@pytest.mark.parametrize(("place", "at"), [(FITS, 1), (FITS, 3), (REPLAYS, 6)])
def test_a_resumed_run_ends_where_an_uninterrupted_one_does(
    place, at, whole, folder, call, monkeypatch
):
    with monkeypatch.context() as patch:
        interrupt(patch, place, at)
        broken = call(LINE, 130)
    kept = len(list((folder / "out" / "fits").iterdir()))
    assert kept >= 4  # all of ls at least
    if (folder / "out" / "comparison.json").exists():
        rows = document()["rows"]
        assert rows == [row for row in whole["rows"] if row in rows]
        assert document()["provenance"]["unfinished"] == f"{len(rows)} of 8 rows: interrupted"
        assert "Incomplete comparison" in (folder / "out" / "table.md").read_text("utf-8")
    assert re.search(r"interrupted: \d of 8 rows. In out/fits finished fits are", broken.stderr)

    call(f"{LINE} --resume")
    again = document()
    assert again["rows"] == whole["rows"]
    assert again["provenance"]["resumed"] == f"{kept} of 8 fits from an earlier run"
    assert "unfinished" not in again["provenance"]
    for name in ("table.md", "table.csv"):
        assert (folder / "out" / name).read_bytes() == (folder / "whole" / name).read_bytes()
    out, fits = (
        {path.name: path.read_bytes() for path in (folder / name / "fits").iterdir()}
        for name in ("out", "whole")
    )
    assert out == fits


@pytest.mark.slow
@rows(("before", "after", "kept"))
def test_fits_of_the_same_data_model_and_method_alone_are_taken(before, after, kept, whole, call):
    line = LINE.replace("--out out", "--out whole").replace(before, after)
    there = {path: path.read_bytes() for path in Path("whole/fits").iterdir()}
    assert "`--force`" in call(f"{line} --resume", 2).stderr
    told = call(f"{line} --resume --force").stderr
    assert document("whole")["provenance"]["resumed"].startswith(f"{kept} of ")
    assert "which will be replaced when this run is complete; finished fits are reused." in told
    assert {path: path.read_bytes() for path in there} == there


def test_resume_needs_a_folder(folder, call):
    for line in (LINE.replace("--out out", ""), "demo"):
        done = call(f"{line} --resume", 2)
        assert "`--out DIR`" in done.stderr


@pytest.mark.slow
def test_without_a_folder_finished_rows_are_shown(folder, call, monkeypatch):
    interrupt(monkeypatch, FITS, 1)
    shown = call(LINE.replace("--out out", ""), 130)
    assert "Incomplete comparison" in shown.stdout
    assert "linear by ls has the least error" in shown.stdout
    assert "With `--out DIR` finished fits are kept" in shown.stderr


@pytest.mark.slow
def test_an_interrupted_run_leaves_a_finished_comparison(whole, folder, call, monkeypatch):
    line, home = LINE.replace("--out out", "--out whole"), folder / "whole"
    before = {path: path.read_bytes() for path in home.rglob("*") if path.is_file()}
    other = line.replace("--train one", "--train two")
    del before[home / MANIFEST]
    for place, at in ((FITS, 1), (REPLAYS, 6), (DRAWING, 1)):
        with monkeypatch.context() as patch:
            interrupt(patch, place, at)
            assert "interrupted" in call(f"{other} --force", 130).stderr
        assert {path: path.read_bytes() for path in before} == before
    assert len([*(home / "fits").iterdir()]) > len(whole["rows"])
    assert "holds a finished comparison" in call(f"{line} --resume", 2).stderr  # it is finished
    call(f"{other} --resume")  # its fits are new
    assert document("whole")["provenance"]["resumed"].startswith("8 of 8 fits")


@pytest.mark.slow
def test_an_interrupted_report_loses_no_row(whole, folder, call, monkeypatch):
    interrupt(monkeypatch, DRAWING, 1)
    call(LINE, 130)
    assert document()["rows"] == whole["rows"]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="a pseudo-terminal")
def test_a_bar_shows_the_share_and_time_left_and_ctrl_c_keeps_the_rows(folder):
    vehicle, rng = hd.read_vehicle("planar.yaml"), np.random.default_rng(0)
    first, second = (motion(vehicle, k, f"run{k}", 2000) for k in (1, 2))
    noisy = replace(first, velocity=first.velocity + 0.01 * rng.standard_normal((2000, 6)))
    hd.write_log(hd.concatenate([noisy, second]), folder / "ab.csv")
    line = "compare ab.csv --vehicle planar.yaml --train run1 --test run2 --methods ls,oe --out out"
    terminal, other_end = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-m", "hydrodamp", *line.split()],
        stdout=subprocess.PIPE,
        stderr=other_end,
        env={**os.environ, "COLUMNS": "120", "TERM": "xterm", "PYTHONPATH": str(SOURCE)},
    ) as process:
        os.close(other_end)
        bar = r"by oe \(2 of 2\) \S+ +\d\d% 0:\d\d:\d\d"
        read_until(terminal, bar)
        process.send_signal(signal.SIGINT)
        said = read_until(terminal, "`--resume` continues")
        output, _ = process.communicate(timeout=60)
    os.close(terminal)
    assert process.returncode == 130
    assert "Traceback" not in said + output.decode()
    rows = hd.read_comparison(folder / "out").rows
    assert 10 <= len(rows) < 18  # nine models by two methods
    assert f"interrupted: {len(rows)} of 18 rows" in said


@pytest.mark.parametrize("module", ["typer", "hydrodamp.cli.compare"])
def test_ctrl_c_while_the_command_loads_is_status_130(module, tmp_path):
    code = f"""
import runpy, sys

class Interrupt:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            raise KeyboardInterrupt

sys.meta_path.insert(0, Interrupt())
sys.argv = ["hydrodamp", "--version"]
runpy.run_module("hydrodamp", run_name="__main__")
"""
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(SOURCE)},
        check=False,
    )
    assert done.returncode == 130
    assert done.stderr == "interrupted\n"


def test_an_import_error_that_ctrl_c_made_is_an_interrupt(capsys):
    """pybind11 turns the interrupt of a module's import into an ImportError of its own."""

    @handle_errors
    def command():
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as error:
            raise ImportError("initialization failed") from error

    with pytest.raises(typer.Exit) as ended:
        command()
    assert ended.value.exit_code == 130
    assert capsys.readouterr().err == "interrupted\n"
