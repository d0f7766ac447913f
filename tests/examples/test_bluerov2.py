"""The BlueROV2 example on its measured runs, where they are at hand."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

import hydrodamp as hd

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = ROOT / "examples" / "bluerov2"
DECOUPLED = {"u": 74.0, "v": 70.0, "w": 66.0, "p": -1.0, "q": -190.0, "r": -8.0}
"""What a decoupled fit per axis reaches, open loop on the same two runs [%]."""


@pytest.fixture(scope="module")
def data(measured_logs) -> Path:
    """The folder with the runs."""
    return measured_logs("bluerov2_kth")


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(EXAMPLE / "compare.py"), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_vehicle_and_models_can_be_read() -> None:
    vehicle = hd.read_vehicle(EXAMPLE / "vehicle.yaml")
    models = hd.read_models(EXAMPLE / "models.yaml")
    assert vehicle.actuators == ()
    assert [model.key for model in models] == [f"{key}+ch" for key in hd.PAPER_MODELS] + ["tank"]


def test_every_model_of_the_paper_is_extended_alike() -> None:
    models = hd.read_models(EXAMPLE / "models.yaml")
    for key, model in zip(hd.PAPER_MODELS, models, strict=False):
        own = hd.find_model(key)
        for had, has in zip(own.terms, model.terms, strict=True):
            assert set(had) <= set(has)
        assert set(model.commands) == {
            *("ch_forward", "ch_lateral", "ch_heave"),
            *("ch_roll", "ch_pitch", "ch_yaw"),
        }


def test_a_folder_without_the_runs_is_named(tmp_path: Path) -> None:
    ended = run(str(tmp_path))
    assert ended.returncode == 2
    assert "run_11_40_38.csv" in ended.stderr
    assert "saabmarineMEX_learning" in ended.stderr
    assert "Traceback" not in ended.stderr


def test_the_command_beats_the_decoupled_fit(data: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    ended = run(str(data), "--out", str(out))
    assert ended.returncode == 0, ended.stderr
    assert "saabmarineMEX_learning, commit dda3f3d" in ended.stdout
    rows = json.loads((out / "comparison.json").read_text(encoding="utf-8"))["rows"]
    assert len(rows) == 9 * 5
    fit = next(
        row["fit_by_axis"] for row in rows if (row["model"], row["method"]) == ("tank", "ls")
    )
    assert [name for name in DECOUPLED if fit[name] <= DECOUPLED[name]] == []
    assert min(fit["p"], fit["q"], fit["r"]) > 45.0
