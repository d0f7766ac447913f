"""The tanker's example on its measured zigzags, where they are at hand."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

import hydrodamp as hd

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "kvlcc2"


@pytest.fixture(scope="module")
def data(measured_logs) -> Path:
    """The folder with the runs."""
    return measured_logs("kvlcc2_hsva")


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(EXAMPLE / "compare.py"), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_vehicle_has_the_added_mass_its_comment_works_out() -> None:
    vehicle = hd.read_vehicle(EXAMPLE / "vehicle.yaml")
    assert vehicle.axes == ("X", "Y", "N")
    sway, yaw = 0.5 * 1000 * 7.0**2 * 0.455, 0.5 * 1000 * 7.0**4 * 0.455
    assert vehicle.mass_matrix[0, 0] == pytest.approx(3272 + 0.022 * sway, rel=1e-4)
    assert vehicle.mass_matrix[1, 1] == pytest.approx(3272 + 0.223 * sway, rel=1e-4)
    about_origin = 9909 + 3272 * 0.2436**2
    assert vehicle.mass_matrix[5, 5] == pytest.approx(about_origin + 0.011 * yaw, rel=1e-4)
    assert vehicle.mass_matrix[1, 5] == pytest.approx(3272 * 0.2436)


def test_every_model_of_the_paper_is_extended_alike() -> None:
    models = hd.read_models(EXAMPLE / "models.yaml")
    assert [model.key for model in models] == [*(f"{key}+rp" for key in hd.PAPER_MODELS), "tanker"]
    for key, model in zip(hd.PAPER_MODELS, models, strict=False):
        own = hd.find_model(key)
        for had, has in zip(own.terms, model.terms, strict=True):
            assert set(had) <= set(has)
    for model in models:
        assert set(model.commands) == {"thrust", "rudder"}


def test_a_folder_without_the_runs_is_named(tmp_path: Path) -> None:
    ended = run(str(tmp_path))
    assert ended.returncode == 2
    assert "HSVA_CPMC_KVLCC2_Z_05_01.dat" in ended.stderr
    assert "martinlarsalbert" in ended.stderr
    assert "Traceback" not in ended.stderr


def test_whole_zigzags_that_were_held_out(data: Path, tmp_path: Path) -> None:
    """At or above 82 % everywhere: what an independent fit of the same terms reaches, at least."""
    out = tmp_path / "out"
    methods = "weak,recommended"
    ended = run(str(data), "--models", "tanker", "--methods", methods, "--out", str(out))
    assert ended.returncode == 0, ended.stderr
    assert "Warning" not in ended.stderr
    rows = json.loads((out / "comparison.json").read_text(encoding="utf-8"))["rows"]
    fits = {row["method"]: row["fit_by_axis"] for row in rows}
    assert list(fits) == methods.split(",")
    for axis in "uvr":
        assert fits["recommended"][axis] > max(82.0, fits["weak"][axis])
