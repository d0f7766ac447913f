"""The study of the methods runs, and its tables say what became of each."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest

STUDY = Path(__file__).parents[2] / "studies" / "estimators.py"


@pytest.fixture(scope="module")
def study():
    spec = importlib.util.spec_from_file_location("estimators_study", STUDY)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def test_one_short_campaign_gives_a_cell_for_every_model_and_method(study):
    cells = study.on_campaign("sname", 0, 20.0, ["ls", "weak"])
    assert len(cells) == 16
    assert {cell.method for cell in cells} == {"ls", "weak"}
    text = study.markdown(cells)
    assert text.count("\n| ") == 3
    assert "of 8" in text


def test_more_divergences_than_errors_are_a_dash(study):
    cells = [
        study.Cell("sname", seed, "linear", "ls", rms, 1.0, "ok")
        for seed, rms in enumerate((0.5, None, None))
    ]
    assert "| ls | - | 2 of 3 | 1.00 |" in study.markdown(cells)
