"""The study of coverage: rows with known answers, and one draw."""

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import consistency
import coverage_tables as tables
import hydrodamp as hd
from hydrodamp.identification.adequacy import Form
from hydrodamp.simulation.campaign.conditions import Conditions
from tables import finish_jobs

STUDIES = Path(__file__).parents[2] / "studies"


@pytest.fixture(name="study")
def study_fixture(monkeypatch):
    """The script under a name of its own: ``coverage`` is a tool of the tests."""
    spec = importlib.util.spec_from_file_location("study_of_coverage", STUDIES / "coverage.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, module)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("half", "spread", "covered", "near"),
    [(1.959964, 1.0, 0.95, 0.9876), (0.979982, 1.0, 0.6730, 0.9876), (3.919928, 2.0, 0.95, 0.7887)],
)
def test_shares_are_those_of_the_normal_law(half, spread, covered, near):
    """2 Phi(1.96) - 1, 2 Phi(0.98) - 1; a quarter of 10 is 2.5 or 1.25 standard deviations."""
    miss = spread * np.random.default_rng(95).standard_normal(4000)
    rows = [
        tables.Row("log", "white", str(k), "model", ["X_u"], [each - 10.0], [spread], [half], ["a"])
        for k, each in enumerate(miss)
    ]
    rows.append(tables.Row("log", "white", tables.TRUE, "model", ["X_u"], [-10.0]))
    outcomes = list(tables.compare_with_targets(rows))
    assert {each.case for each in outcomes} == {("log", "model", "white", "truth")}
    assert np.mean([each.is_covered for each in outcomes]) == pytest.approx(covered, abs=0.02)
    assert np.mean([each.is_near for each in outcomes]) == pytest.approx(near, abs=0.02)
    value, error = tables.share(outcomes, [each.is_covered for each in outcomes]).split(" ± ")
    assert float(value) == pytest.approx(100.0 * covered, abs=4.0 * float(error))


def test_halves_are_compared_where_both_have_the_grade():
    labels, grades = ["X_u", "Y_v", "N_r"], ["determined", "weak", "determined"]
    numbers = [1, 2, 3], [0.3] * 3, [0] * 3
    first = tables.Row("log", tables.MEASURED, "0", "m", labels, *numbers, grades)
    other = first._replace(draw="1", estimate=[1.8, 2, 5], grades=["determined"] * 3)
    whole = first._replace(draw=tables.WHOLE)
    outcomes = list(tables.compare_with_targets([whole, first, other]))
    assert [(each.label, each.is_covered) for each in outcomes] == [("X_u", True), ("N_r", False)]
    assert "| log | `m` | 2 | 0 | 1 | 0 |" in tables.grades_table([whole, first, other])


def test_errors_and_widths_are_ratios_to_the_bound():
    bound, draws = [[4.0, 1.0], [1.0, 9.0]], np.random.default_rng(96)
    misses = 1.5 * draws.multivariate_normal([0.0, 0.0], bound, 4000)
    rows = [
        tables.Row("ROV", "push 1", str(k), "m", ["N_r", "N_v"], miss, [2.4, 3.6], bound=bound)
        for k, miss in enumerate(misses.tolist())
    ]
    rows.append(tables.Row("ROV", "push 1", tables.TRUE, "m", ["N_r", "N_v"], [0.0, 0.0]))
    cells = tables.bound_table(rows).splitlines()[-1].split(" | ")
    assert cells[:4] == ["| ROV", "push 1", "4000", "1.20"]
    assert float(cells[4]) == pytest.approx(1.5, rel=0.03)


def test_coverage_is_counted_by_axis():
    case = "ROV", "m", "push 1", "truth"
    outcomes = [
        tables.Outcome(case, "0", label, "minor", covered, True)
        for label, covered in (("N_r", True), ("N_v", False), ("X_u", True))
    ]
    assert "| ROV | push 1 | minor | 100 (1) |  |  |  |  | 50 (2) |" in tables.axes_table(outcomes)


def test_without_pushes_the_bound_is_that_of_whitened_replays():
    conditions, truth = consistency.CONDITIONS["coloured"], consistency.true_coefficients()
    silent = hd.reenact(duration=15.0, conditions=Conditions(scale=0.0))
    log = replace(silent.exact_train, acceleration=None)
    problem = hd.prepare(silent.vehicle, log, [consistency.MODEL])
    found = consistency.bound_covariance(problem, consistency.MODEL, truth, conditions)
    errors = consistency.velocity_errors(conditions)
    known = np.linalg.inv(consistency.fisher_information(problem, truth, *errors))
    np.testing.assert_allclose(np.diag(found), np.diag(known), rtol=0.05)


def test_finished_jobs_are_not_run_again(tmp_path):
    path, jobs = tmp_path / "rows.jsonl", {"first": lambda: [(1, 2)]}
    assert finish_jobs(path, jobs, lambda *row: row) == [(1, 2)]
    jobs |= {"first": lambda: [(0, 0)], "second": lambda: [(3, 4), (5, 6)]}
    assert finish_jobs(path, jobs, lambda *row: row) == [(1, 2), (3, 4), (5, 6)]
    assert len(path.read_text().splitlines()) == 2


def test_a_draw_of_the_rov_has_a_grade_and_a_target_for_every_coefficient(study):
    truth, found = study.simulate_rov("white", range(1))
    assert truth.labels == found.labels == list(study.ROV(0, 1.0).true().model.labels)
    outcomes = list(tables.compare_with_targets([truth, found]))
    assert [each.grade for each in outcomes] == found.grades
    assert np.mean([each.is_covered for each in outcomes]) > 0.8
    summary = tables.summarise([truth, found])
    assert "| ROV | `fossen+channels` | white | truth | determined |" in summary


@pytest.mark.slow
def test_a_strength_of_noise_that_vanished_at_a_biased_estimate_grows_again(study):
    # the first estimate of the noise leaves none to the sensor of q
    logs = study.ROV(study.FIRST_SEED + 1, study.DURATION, study.TETHERED["push 1"])()
    fit = hd.identify(logs.true.model, logs.vehicle, logs.train, hd.Recommended())
    assert fit.adequacy.form is Form.ADEQUATE
    errors = fit.damping.coefficients - logs.true.coefficients
    assert np.sqrt(np.mean((errors / fit.uncertainty.standard_errors) ** 2)) < 1.5
