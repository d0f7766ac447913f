"""The study of coverage: a very small one, and its averages on draws with known answers."""

import importlib
import json
from pathlib import Path

import numpy as np
import pytest

import hydrodamp as hd

STUDIES = Path(__file__).parents[2] / "studies"


@pytest.fixture(name="tables")
def tables_fixture(monkeypatch):
    """The averages and tables."""
    monkeypatch.syspath_prepend(STUDIES)
    return importlib.import_module("coverage_tables")


@pytest.fixture(name="study")
def study_fixture(tables):
    """The script under a name of its own: ``coverage`` is a tool of the tests."""
    assert tables
    spec = importlib.util.spec_from_file_location("study_of_coverage", STUDIES / "coverage.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(importlib.sys.modules, spec.name, module)
        spec.loader.exec_module(module)
    return module


def test_one_command_writes_both_files(study, tmp_path, capsys):
    """Three short draws, one model: a line an axis, and every coefficient in the JSON."""
    study.main(tmp_path, draws=3, duration=40.0, methods="ls", models="prestero", workers=1)
    found = json.loads((tmp_path / "coverage.json").read_text(encoding="utf-8"))
    assert found["draws"] == 3
    assert [one["label"] for one in found["coefficients"]] == list(hd.find_model("prestero").labels)
    assert {row["axis"] for row in found["coverage"]} <= set("XYZKMN")
    written = (tmp_path / "coverage.md").read_text(encoding="utf-8")
    assert written.count("| ls | prestero |") == len(found["coverage"]) > 0
    assert "Bias against the target" in capsys.readouterr().out


def drawn(tables, shift, scale=1.0):
    """4000 draws of fits of Prestero's terms with normal errors, some of them biased."""
    n, labels = 4000, hd.find_model("prestero").labels
    rng = np.random.default_rng(95)
    target = np.full((n, len(labels)), -10.0)
    estimate = target + shift + rng.standard_normal(target.shape)
    half = 1.959964 * scale
    return tables.Draws(
        estimate=estimate,
        target=target,
        low=estimate - half,
        high=estimate + half,
        error=np.full_like(target, scale),
        determined=np.tile([label.startswith("Y") for label in labels], (n, 1)),
    )


@pytest.mark.parametrize(
    ("shift", "scale", "coverage", "centred"),
    [(0.0, 1.0, 0.95, 0.95), (0.0, 0.5, 0.6730, 0.6730), (1.959964, 1.0, 0.5, 0.95)],
)
def test_averages_are_those_of_the_normal_law(tables, shift, scale, coverage, centred):
    """2 Phi(1.96) - 1, 2 Phi(0.98) - 1, and a half where the bias is the half-width."""
    draws = drawn(tables, shift, scale)
    found = tables.summary({("some", "prestero"): draws})
    (row,) = found["coverage"]
    assert (row["axis"], row["counted"], row["of"]) == ("Y", 6, 6)
    assert row["coverage"] == pytest.approx(coverage, abs=4 * row["monte_carlo_error"])
    assert row["centred_coverage"] == pytest.approx(centred, abs=0.01)
    assert row["error_ratio"] == pytest.approx(scale, rel=0.02)
    (bias,) = found["bias"]
    assert bias["spreads"] == pytest.approx(shift, abs=0.05)
    assert bias["percent"] == pytest.approx(10.0 * shift, abs=0.5)
