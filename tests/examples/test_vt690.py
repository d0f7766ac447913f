"""The example of the 690 on its field log, where it is at hand."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import hydrodamp as hd

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "vt690"
INDEPENDENT = (79, 54, 71, 83)
"""An independent fit of dr/dt = a U r + b U^2 rudder + c on four held-out turns [%]."""


@pytest.fixture(scope="module")
def data(measured_logs) -> Path:
    """The folder with the topics."""
    return measured_logs("vt690_field")


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(EXAMPLE / "compare.py"), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_models_take_the_fins_as_unknown() -> None:
    models = {model.key: model for model in hd.read_models(EXAMPLE / "models.yaml")}
    assert list(models) == ["yaw", "steering", "whole"]
    assert models["steering"].commands == ("rudder", "speed")
    assert models["whole"].commands == ("elevator", "rudder")


def test_a_folder_without_the_log_is_named(tmp_path: Path) -> None:
    ended = run(str(tmp_path))
    assert ended.returncode == 2
    assert str(tmp_path) in ended.stderr
    assert "ECE-MDE/AUV-Fault-Detection" in ended.stderr
    assert "Traceback" not in ended.stderr


def test_held_out_turns_from_the_raw_topics(data: Path, tmp_path: Path) -> None:
    ended = run(str(data), "--methods", "oe", "--out", str(tmp_path / "out"))
    assert ended.returncode == 0, ended.stderr
    assert re.search(r"Identification: turns (\d+ to \d+ s(, )?){3}\n", ended.stdout)
    assert re.search(r"Held out: turns (\d+ to \d+ s(, )?){4}\n", ended.stdout)
    found = re.search(r"^steering +oe +(\d+) +(\d+) +(\d+) +(\d+)$", ended.stdout, re.MULTILINE)
    assert found is not None
    for ours, theirs in zip(map(int, found.groups()), INDEPENDENT, strict=True):
        assert ours >= theirs
    graded = dict(re.findall(r"^([XYZKMN]) +(?:yes|no) +(\d+) +", ended.stdout, re.MULTILINE))
    assert [graded[axis] for axis in "YZM"] == ["0", "0", "0"]
    assert all(int(graded[axis]) > 0 for axis in "KN")
    assert hd.read_damping(tmp_path / "out" / "steering.yaml").model.key == "steering"
    assert (tmp_path / "out" / "log.csv").stat().st_size > 0
