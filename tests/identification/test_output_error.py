"""Output error: right on exact data, better than its start on noisy data, honest at the end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.search import Place, _chosen, climb, searching
from hydrodamp.identification.shooting import Guess, Shooting, cut, runaways
from hydrodamp.simulation.campaign.truth import true_damping

SETTLED = (hd.Status.OK, hd.Status.STOPPED)


@pytest.fixture(scope="module")
def campaign():
    return hd.reenact(seed=3, duration=40.0)


TRUE_TERMS = hd.catalog["prestero"].with_terms({"K": "up"}, key="true-terms")


def wrong(campaign, damping):
    """RMS error of the replay of the exact runs, in units of each sensor's noise."""
    exact = campaign.exact_test
    error = hd.simulate(campaign.vehicle, damping, exact).velocity - exact.velocity
    return np.sqrt(np.mean((error / ([0.0133] * 3 + [8.7e-4] * 3)) ** 2))


def test_the_truth_comes_back_from_exact_runs(campaign):
    log = replace(campaign.exact_train, acceleration=None)
    fit = hd.identify(TRUE_TERMS, campaign.vehicle, log, hd.OutputError())
    assert fit.status in SETTLED
    assert wrong(campaign, fit.damping) < 0.1
    for label in ("X_u|u|", "Y_uv", "Z_uw", "M_uq", "N_ur"):
        assert fit.damping[label] == pytest.approx(true_damping()[label], rel=0.02)


def test_noise_moves_it_less_than_least_squares(campaign):
    fits = [
        hd.identify(TRUE_TERMS, campaign.vehicle, campaign.train, method)
        for method in (hd.LeastSquares(), hd.OutputError())
    ]
    by_least_squares, by_output_error = (wrong(campaign, fit.damping) for fit in fits)
    assert by_output_error < 0.3 * by_least_squares


def test_the_linearised_problem_is_that_of_the_cost(campaign):
    """A full Gauss-Newton step near the optimum lowers the cost by what it promises."""
    problem = hd.prepare(campaign.vehicle, campaign.exact_train, TRUE_TERMS)
    shooting = Shooting(
        problem, problem.columns.entries(TRUE_TERMS), cut(problem, 5.0), np.full(6, 0.01)
    )
    true = np.array([true_damping()[label] for label in TRUE_TERMS.labels])
    at, spread = Guess(1.01 * true, shooting.measured_starts()), np.full(6, 0.02)
    around = shooting.linearised(at, spread)
    assert around is not None
    assert around.cost == pytest.approx(shooting.cost(at, spread), rel=1e-12)
    slopes, rest = around.triangle[:, :-1], around.triangle[:, -1]
    for change in (np.zeros(len(true)), -0.005 * true, -0.01 * true):
        starts = at.starts + around.starts_moved(change)
        moved = shooting.cost(Guess(at.coefficients + change, starts), spread)
        promised = np.sum((rest - slopes @ change) ** 2)
        assert around.cost - moved == pytest.approx(around.cost - promised, rel=1e-2)


@pytest.mark.parametrize("alike", [1, 8])
def test_errors_count_as_often_as_they_are_independent(campaign, alike):
    """Held over k samples, white errors have a correlation time of k steps.

    It is summed over lags of up to five times itself, so that its relative variance is
    2 (2 * 5 k + 1) / n for each velocity (Sokal 1997, equation 3.19).
    """
    model = hd.catalog["fossen"]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    search = searching(problem, model)
    rng = np.random.default_rng(2)
    errors = np.repeat(rng.normal(size=(problem.n_samples // alike + 1, 6)), alike, axis=0)
    errors = 10.0 * errors[: problem.n_samples]
    counted = np.exp(np.mean(np.log(search.spread(errors) ** 2 / np.mean(errors**2, axis=0))))
    scatter = np.sqrt(2.0 * (10.0 * alike + 1.0) / problem.n_samples / 6.0)
    assert counted == pytest.approx(alike, rel=3.0 * scatter)


def test_intervals_make_room_for_what_short_windows_say(campaign):
    """Their half-width is at least the distance between the shortest windows and the end."""
    model = hd.catalog["fossen"]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    start = hd.WeakForm().identify(problem, model)
    climbed = climb(problem, model, [np.array(start.damping.coefficients)], (5.0, np.inf), 12)
    fit = hd.OutputError(start=hd.WeakForm(), windows=(5.0, np.inf)).identify(problem, model)
    assert climbed.short is not None
    assert fit.uncertainty is not None
    apart = np.abs(climbed.coefficients - climbed.short)
    assert np.all(fit.uncertainty.standard_errors >= apart * (1.0 - 1e-12))
    assert "shortest windows" in str(fit.uncertainty)


def test_where_every_place_runs_away_the_one_that_lasts_longest_is_given(campaign):
    """Fossen's model with thrust for drag: the more of it, the sooner the speed runs away."""
    model = hd.catalog["fossen"]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    whole = searching(problem, model).shooting(np.inf)
    pushed = [np.zeros(12) for _ in range(3)]
    for coefficients, push in zip(pushed, (60.0, 15.0, 30.0), strict=True):
        coefficients[model.index("X_u")] = push
    places = [Place(coefficients, np.ones(6)) for coefficients in pushed]
    chosen, why = _chosen(whole, places, places[0])
    assert chosen is places[1]
    assert "runs away" in why


def test_windows_cover_every_sample_and_cross_no_join(campaign):
    problem = hd.prepare(campaign.vehicle, campaign.train, hd.catalog["fossen"])
    windows = cut(problem, 7.0)
    assert windows[0, 0] == 0
    assert windows[-1, 1] == problem.n_samples
    assert np.array_equal(windows[1:, 0], windows[:-1, 1])
    assert set(problem.segments[:, 0]) <= set(windows[:, 0])
    assert np.array_equal(cut(problem, np.inf), problem.segments)


def test_an_unstable_model_is_seen_to_run_away(campaign):
    problem = hd.prepare(campaign.vehicle, campaign.train, TRUE_TERMS)
    true = hd.Damping.from_dict(TRUE_TERMS, true_damping().as_dict())
    assert runaways(problem, problem.matrix(true)) == 0
    unstable = hd.Damping.from_dict(TRUE_TERMS, true.as_dict() | {"N_ur": 60.0, "N_r|r|": 0.0})
    assert runaways(problem, problem.matrix(unstable)) > 0


def test_three_degrees_of_freedom_and_a_gain(exact_log):
    vehicle = replace(hd.fleet["vt690"], actuators=(), axes=("X", "Y", "N"))
    model = hd.catalog["fossen"].restricted_to(vehicle.axes)
    truth = hd.Damping(model, [-10.0, -3.0, -60.0, -150.0, -50.0, -40.0])
    log = exact_log(truth, n=600)
    still = replace(log, velocity=log.velocity * vehicle.free, acceleration=None)
    moving = replace(still, velocity=hd.simulate(vehicle, truth, still).velocity)
    fit = hd.identify(model, vehicle, moving, hd.OutputError(windows=(5.0, np.inf)))
    np.testing.assert_allclose(fit.damping.coefficients, truth.coefficients, rtol=0.05)


@pytest.mark.parametrize("windows", [(), (0.0,), (5.0, 5.0), (float("nan"),)])
def test_windows_that_make_no_ladder_are_refused(windows):
    with pytest.raises(hd.MethodError, match="positive and rising"):
        hd.OutputError(windows=windows)


def test_no_round_is_refused():
    with pytest.raises(hd.MethodError, match="at least 1"):
        hd.OutputError(rounds=0)


def test_a_start_without_numbers_is_no_fit(campaign):
    problem = hd.prepare(campaign.vehicle, campaign.train, hd.catalog["fossen"])
    fit = hd.LeastSquares().identify(problem, hd.catalog["fossen"])
    failed = replace(fit, status=hd.Status.FAILED)
    assert hd.OutputError().refined(problem, failed).status is hd.Status.FAILED
