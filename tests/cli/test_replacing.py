"""Results in the way of new ones, and new ones that find no room."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import Result

from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.data.canonical import write_log
from hydrodamp.data.log import Log
from hydrodamp.errors import FileError
from hydrodamp.report import files
from hydrodamp.report.files import read_comparison

Call = Callable[..., Result]
LINE = "compare a.csv --vehicle planar.yaml --train 0:20 --models linear --methods ls --out out"


def test_results_of_another_run_are_named_before_they_go(folder: Path, call: Call) -> None:
    first = call(f"{LINE} --test 20:40")
    assert first.exit_code == 0, first.output
    assert "another run" not in first.stderr
    again = call(f"{LINE} --test 20:40")
    assert "another run" not in again.stderr
    other = call(f"{LINE} --test 30:40")
    assert "out holds a comparison of another run (1 rows); it is replaced" in " ".join(
        other.stderr.split()
    )


def test_a_damping_file_that_was_there_is_said_to_be_replaced(folder: Path, call: Call) -> None:
    line = "identify a.csv --vehicle planar.yaml --model linear --method ls --json --out d.json"
    assert "in place of" not in call(line).stderr
    assert "written to d.json, in place of an earlier one" in call(line).stderr


def test_rows_are_not_lost_with_their_folder(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = files.write_comparison

    def full(comparison: object, out: str, *waiting: object) -> None:
        if out == "out":
            raise FileError("out: cannot be written: No space left on device.")
        write(comparison, out, *waiting)  # type: ignore[arg-type]

    monkeypatch.setattr(files, "write_comparison", full)
    done = call(f"{LINE} --test 20:40")
    assert done.exit_code == 2
    assert "No space left on device" in done.stderr
    found = re.search(r"What was finished is in (\S+);", " ".join(done.stderr.split()))
    assert found is not None
    assert [row.model for row in read_comparison(found[1]).rows] == ["linear"]


def test_a_rate_in_the_wrong_unit_is_told_before_it_is_fitted(folder: Path, call: Call) -> None:
    time = np.arange(0.0, 60.0, 0.1)
    heading = np.sin(time / 2)
    rate = 0.5 * np.cos(time / 2)
    euler = np.column_stack((0.0 * time, 0.0 * time, heading))
    log = Log.from_arrays(
        time,
        {"u": 1.0 + 0.1 * np.sin(time), "v": 0.1 * np.cos(time), "r": np.radians(rate)},
        attitude=quaternion_from_euler(euler),
        commands={"ahead": np.sin(time), "turn": np.cos(time)},
    )
    write_log(log, folder / "turns.csv")
    done = call("identify turns.csv --vehicle planar.yaml --model linear --method ls --json")
    told = " ".join(done.stderr.split())
    assert "warning: turns.csv: suspicion: `r` is rad/s taken for deg/s" in told
