"""Output error: right on exact data, better than its start on noisy data, honest at the end."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification import gauss_newton as module
from hydrodamp.identification.gauss_newton import (
    REST,
    admissible_lengths,
    best_initial_iterate,
    continue_over_lengths,
    initial_candidates,
    make_objective,
    minimise,
)
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


def test_other_models_that_a_problem_was_prepared_for_change_nothing(campaign):
    model = hd.catalog["linear"]
    fits = [
        hd.OutputError((2.0,)).identify(hd.prepare(campaign.vehicle, campaign.train, models), model)
        for models in ([model], [hd.catalog["coe"], model, hd.catalog["fossen"]])
    ]
    np.testing.assert_array_equal(*(fit.damping.coefficients for fit in fits))


def test_noise_moves_it_less_than_least_squares(campaign):
    fits = [
        hd.identify(TRUE_TERMS, campaign.vehicle, campaign.train, method)
        for method in (hd.LeastSquares(), hd.OutputError())
    ]
    by_least_squares, by_output_error = (wrong(campaign, fit.damping) for fit in fits)
    assert by_output_error < 0.3 * by_least_squares


def test_first_velocities_go_where_they_fit_as_far_as_they_are_in_doubt(campaign):
    problem = hd.prepare(campaign.vehicle, campaign.exact_train, TRUE_TERMS)
    windows = make_objective(problem, TRUE_TERMS).windows(1.0)
    true = np.array([true_damping()[label] for label in TRUE_TERMS.labels])
    off = np.random.default_rng(3).normal(scale=1e-3, size=windows.starts.shape)
    windows = replace(windows, starts=problem.inputs.velocity[windows.bounds[:, 0]] + off)
    spread, plain = np.full(6, 1e-4), np.mean(windows.errors(true) ** 2, axis=0)
    free = replace(windows, doubt=np.full(6, 0.01)).linear(true, spread)
    held = replace(windows, doubt=np.full(6, 1e-9)).linear(true, spread)
    assert np.all(free.square < 0.05 * plain)  # a sample's noise is left where samples are averaged
    np.testing.assert_allclose(held.square, plain, rtol=1e-6)
    total = free.moved * 6 * len(windows.samples)
    assert total * 0.01**2 == pytest.approx(np.sum(off**2), rel=0.05)


def test_first_velocities_that_run_away_tell_no_direction():
    """At rest nothing moves, but the least first velocity would grow beyond all numbers."""
    model, time = hd.catalog["fossen"], np.arange(0.0, 20.0, 0.1)
    level = np.tile([1.0, 0.0, 0.0, 0.0], (200, 1))
    still = hd.Log(time, np.zeros((200, 6)), attitude=level, wrench=np.zeros((200, 6)))
    vehicle = hd.Vehicle("block", np.diag([10.0] * 6), weight=100.0, buoyancy=100.0)
    windows = make_objective(hd.prepare(vehicle, still, model), model).windows(16.0)
    pushed = np.zeros(12)
    pushed[model.index("X_u")] = 1e5
    assert not windows.linear(pushed, np.ones(6)).normal.any()


def test_a_window_that_runs_away_tells_no_direction(campaign):
    model = hd.catalog["fossen"]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    windows = make_objective(problem, model).windows(np.inf)
    pushed = np.zeros(12)
    pushed[model.index("X_u")] = 60.0  # thrust for drag
    assert np.isfinite(windows.errors(pushed)).all()
    assert not windows.normals(pushed, np.ones(6), 2).any()


def test_lengths_beyond_every_segment_are_whole_segments(campaign):
    problem = hd.prepare(campaign.vehicle, campaign.train, hd.catalog["fossen"])
    assert admissible_lengths(problem, (2.0, 39.0)) == [2.0, 39.0]
    assert admissible_lengths(problem, (2.0, 50.0, 60.0)) == [2.0, np.inf]


def test_a_window_within_a_hole_of_the_log_is_none(campaign):
    """A hole of 0.9 s is no gap, and longer than a window of 0.4 s."""
    model, log = hd.catalog["fossen"], campaign.train.between(0.0, 40.0)
    whole = hd.prepare(campaign.vehicle, log, model)
    kept = np.flatnonzero((log.elapsed < 5.02) | (log.elapsed > 5.95))
    segments = np.array([[0, len(kept)]])
    problem = replace(whole, inputs=whole.inputs.select(kept), segments=segments)
    fit = hd.OutputError(windows=(0.4,)).identify(problem, model)
    assert fit.status in SETTLED


@pytest.fixture(scope="module")
def searched(campaign):
    model = hd.catalog["fossen"]
    search = make_objective(hd.prepare(campaign.vehicle, campaign.train, model), model)
    return search, best_initial_iterate(search, initial_candidates(search, model), 2.0)


def test_a_step_damped_to_nothing_is_no_rest(searched):
    search, start = searched
    assert not minimise(search, replace(start, damping=1e9), REST).converged
    assert minimise(search, start, REST).converged


def test_a_stage_that_got_stuck_does_not_hold_the_next(searched, monkeypatch):
    begun_with = []

    def stuck(_, place, __):
        begun_with.append(place.damping)
        return replace(place, damping=1e9)

    monkeypatch.setattr(module, "minimise", stuck)
    continue_over_lengths(*searched, (2.0, 4.0))
    assert begun_with[1] <= 1.0


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


@pytest.mark.parametrize("method", [hd.OutputError(), hd.Recommended()])
def test_a_model_without_terms_is_told(campaign, method):
    model = replace(hd.catalog["fossen"], terms=((),) * 6)
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    assert method.identify(problem, model).status is hd.Status.EMPTY
