"""Rows, statuses and the best of them; where the paper's table stands beside."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.validation.compare import is_paper_campaign
from hydrodamp.validation.selection import pareto_front


@pytest.fixture
def comparison(vehicle, exact_log, true_damping):
    log = exact_log(hd.Damping(hd.catalog["linear"], (-30 * np.eye(6) + 0.1).ravel()), n=900)
    train, test = log.select("a", "b"), log.select("c")
    models = [hd.catalog[key] for key in ("linear", "fossen", "uncoupled")]
    problem = hd.prepare(vehicle, train, models)
    fits = hd.identify_all(problem, models, hd.LeastSquares())
    fits += hd.identify_all(problem, models[:1], hd.AdaptiveIdentifier())
    wild = replace(fits[1], damping=hd.Damping(models[1], np.full(12, 300.0)), method="wild")
    return hd.compare([*fits, wild], vehicle, test)


@pytest.mark.slow
def test_rows_are_in_the_order_asked_for_and_the_truth_wins(comparison):
    found = [f"{row.model} {row.method}" for row in comparison.rows]
    assert found == ["linear ls", "fossen ls", "uncoupled ls", "linear ai", "fossen wild"]
    assert comparison.models == ("linear", "fossen", "uncoupled")
    assert comparison.methods == ("ls", "ai", "wild")
    best, choice = comparison.best(), comparison.select()
    assert best is comparison.row("linear", "ls") is choice.row
    assert best.rms < 0.05
    assert choice.caveat == "Excluded: 2 replays that diverged, failed or did not converge."


@pytest.mark.slow
def test_a_diverged_replay_is_a_row_with_a_status(comparison):
    row = comparison.row("fossen", "wild")
    assert row.status is hd.Status.DIVERGED
    assert row.rms is None
    assert row.score.diverged[0][0] == "c"
    assert "diverged" in str(comparison)
    assert comparison.best() in pareto_front(comparison)
    assert row not in pareto_front(comparison)
    nothing = replace(comparison, rows=(replace(row, blocks=None),))
    with pytest.raises(MethodError, match="nothing was fitted"):
        nothing.best()
    with pytest.raises(MethodError, match="no row of model 'coe'"):
        comparison.row("coe", "ls")


def test_the_printed_table_stands_beside_a_re_enactment_only(comparison):
    assert not is_paper_campaign(comparison)
    assert is_paper_campaign(replace(comparison, provenance={"truth": "sname"}))


def test_errors_of_runs_add_up_to_that_of_all(vehicle, exact_log):
    """Equation 24 is a mean over samples."""
    truth = hd.Damping(hd.catalog["linear"], (-30 * np.eye(6)).ravel())
    log = exact_log(truth, n=900)
    weak = replace(truth, coefficients=0.9 * truth.coefficients)
    fit = hd.LeastSquares().identify(hd.prepare(vehicle, log, truth.model), truth.model)
    row = hd.compare([replace(fit, damping=weak)], vehicle, log, horizon=1e9).rows[0]
    sizes = [len(run) for run in log.segments]
    squares = [rms**2 for rms in row.score.rms_by_segment.values()]
    assert np.average(squares, weights=sizes) == pytest.approx(row.rms**2)
    assert list(row.score.rms_by_segment) == [run.name for run in log.segments]
    assert row.windows.score.fit_by_axis == row.score.fit_by_axis  # a window is a whole run


def test_one_run_that_diverges_leaves_the_errors_of_others(vehicle, exact_log, true_damping):
    truth = true_damping(hd.catalog["fossen"])
    log = exact_log(truth, n=900)
    velocity = np.where(log.time[:, None] < log.time[log.segments[1].start], 0.0, np.nan)
    lost = tuple((run.name, 0.0) for run in log.segments[1:])
    score = hd.score(hd.Trajectory(log, velocity + np.zeros(6), lost, "measured"))
    assert score.rms is None
    first, *others = score.rms_by_segment.values()
    assert first > 0.0
    assert not any(others)


def test_a_horizon_that_is_none_is_told_before_anything_is_replayed(vehicle, exact_log):
    log = exact_log(hd.Damping(hd.catalog["linear"], np.zeros(36)))
    with pytest.raises(MethodError, match="positive number of seconds"):
        hd.compare([], vehicle, log, horizon=0.0)


@pytest.mark.slow
def test_a_comparison_is_a_data_frame(comparison):
    pytest.importorskip("pandas", reason="data frames need the extra hydrodamp[pandas]")
    frame = comparison.to_dataframe()
    assert [*frame["method"]] == ["ls", "ls", "ls", "ai", "wild"]
    row, first = comparison.rows[0], frame.iloc[0]
    assert (first["model"], first["n_coefficients"], first["rank"]) == ("linear", 36, 36)
    assert (first["rms"], first["rms_u"]) == (row.rms, row.score.rms_by_axis["u"])
    assert first["n_determined"] == [*row.grades.values()].count(hd.Grade.DETERMINED)
    assert (frame.iloc[4]["status"], np.isnan(frame.iloc[4]["rms"])) == ("diverged", True)


@pytest.mark.slow
def test_notebooks_show_texts_and_tables(comparison, vehicle):
    row = comparison.rows[0]
    for value, words in (
        (row.trajectory.log, ("samples", "median step")),
        (vehicle, (vehicle.name,)),
        (row.fit.damping, ("<td>X_u</td>", "<td>N/(m/s)</td>")),
        (row.fit, ("full rank", "<td>± 95 %</td>", f"<td>{row.fit.grades['X_u'].word}</td>")),
        (comparison, ("linear", "<td>relative_error</td>", "<td>wild</td>")),
    ):
        page = value._repr_html_()
        assert all(word in page for word in words), words
    assert "<td>" not in vehicle._repr_html_()
    evil = replace(row.fit.damping, note="<script>")
    assert "<script>" not in evil._repr_html_()
