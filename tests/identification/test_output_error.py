"""Output error: exact on noise-free data, better than least squares on noise, convergence."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.identification import continuation as module
from hydrodamp.identification.continuation import (
    admissible_lengths,
    best_initial_iterate,
    continue_over_lengths,
    initial_candidates,
    make_objective,
)
from hydrodamp.identification.gauss_newton import FINAL_TOLERANCE, minimise
from hydrodamp.simulation.campaign.conditions import true_damping

FINISHED = (hd.Status.OK, hd.Status.STOPPED)


TRUE_TERMS = hd.catalog["prestero"].with_terms({"K": "up"}, key="true-terms")


def relative_error(campaign, damping):
    """RMS error of the replay of the exact runs, in units of each sensor's noise."""
    exact = campaign.exact_test
    error = hd.simulate(campaign.vehicle, damping, exact).velocity - exact.velocity
    return np.sqrt(np.mean((error / ([0.0133] * 3 + [8.7e-4] * 3)) ** 2))


def test_the_truth_replays_its_exact_log(campaign):
    """To a thousandth of the noise: between samples gravity follows a cubic, not a line."""
    assert relative_error(campaign, true_damping()) < 1e-3


@pytest.mark.slow
def test_true_coefficients_are_recovered_from_noise_free_data(campaign):
    log = replace(campaign.exact_train, acceleration=None)
    fit = hd.identify(TRUE_TERMS, campaign.vehicle, log, hd.OutputError())
    assert fit.status in FINISHED
    assert relative_error(campaign, fit.damping) < 0.1
    for label in ("X_u|u|", "Y_uv", "Z_uw", "M_uq", "N_ur"):
        assert fit.damping[label] == pytest.approx(true_damping()[label], rel=0.02)


@pytest.mark.slow
def test_other_models_of_the_problem_do_not_change_the_estimate(campaign):
    model = hd.catalog["linear"]
    fits = [
        hd.OutputError((2.0,)).identify(hd.prepare(campaign.vehicle, campaign.train, models), model)
        for models in ([model], [hd.catalog["coe"], model, hd.catalog["fossen"]])
    ]
    np.testing.assert_array_equal(*(fit.damping.coefficients for fit in fits))


@pytest.mark.slow
def test_output_error_is_less_sensitive_to_noise_than_least_squares(campaign):
    fits = [
        hd.identify(TRUE_TERMS, campaign.vehicle, campaign.train, method)
        for method in (hd.LeastSquares(), hd.OutputError())
    ]
    least_squares_error, output_error = (relative_error(campaign, fit.damping) for fit in fits)
    assert output_error < 0.3 * least_squares_error


def test_initial_states_are_estimated_within_their_prior(campaign):
    problem = hd.prepare(campaign.vehicle, campaign.exact_train, TRUE_TERMS)
    windows = make_objective(problem, TRUE_TERMS).windows(1.0)
    true = np.array([true_damping()[label] for label in TRUE_TERMS.labels])
    offset = np.random.default_rng(3).normal(scale=1e-3, size=windows.initial_states.shape)
    states = problem.inputs.velocity[windows.bounds[:, 0]] + offset
    windows = replace(windows, initial_states=states)
    mean_square = np.mean(next(windows.outputs.residuals(windows, true)).residuals ** 2, axis=0)
    (_, wide, correction), (_, narrow, _) = (
        replace(windows, initial_state_std=np.full(6, std)).linearise(true, np.full(6, 1e-4))
        for std in (0.01, 1e-9)
    )
    assert np.all(wide < 0.05 * mean_square)
    np.testing.assert_allclose(narrow, mean_square, rtol=1e-6)
    total = correction * 6 * len(windows.samples)
    assert total * 0.01**2 == pytest.approx(np.sum(offset**2), rel=0.05)


def test_windows_too_sensitive_to_their_initial_state_have_no_weight():
    """A vehicle at rest stays at rest, but any initial velocity grows without bound."""
    model, time = hd.catalog["fossen"], np.arange(0.0, 20.0, 0.1)
    level = np.tile([1.0, 0.0, 0.0, 0.0], (200, 1))
    still = hd.Log(time, np.zeros((200, 6)), attitude=level, wrench=np.zeros((200, 6)))
    vehicle = hd.Vehicle("block", np.diag([10.0] * 6), weight=100.0, buoyancy=100.0)
    windows = make_objective(hd.prepare(vehicle, still, model), model).windows(16.0)
    unstable = np.zeros(12)
    unstable[model.index("X_u")] = 1e5
    assert not windows.linearise(unstable, np.ones(6))[0].any()


def test_diverged_windows_have_no_weight(campaign):
    model = hd.catalog["fossen"]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    windows = make_objective(problem, model).windows(np.inf)
    unstable = np.zeros(12)
    unstable[model.index("X_u")] = 60.0  # a negative drag
    assert np.isfinite(next(windows.outputs.residuals(windows, unstable)).residuals).all()
    assert not windows.block_normal_matrices(unstable, np.ones(6), np.arange(4)).any()


def test_lengths_beyond_every_segment_become_infinite(campaign):
    problem = hd.prepare(campaign.vehicle, campaign.train, hd.catalog["fossen"])
    assert admissible_lengths(problem, (2.0, 39.0)) == [2.0, 39.0]
    assert admissible_lengths(problem, (2.0, 50.0, 60.0)) == [2.0, np.inf]


def test_windows_without_samples_are_skipped(campaign):
    """A dropout of 0.9 s does not end a segment, and is longer than a window of 0.4 s."""
    model, log = hd.catalog["fossen"], campaign.train.between(0.0, 40.0)
    problem = hd.prepare(campaign.vehicle, log, model)
    samples = np.flatnonzero((log.elapsed < 5.02) | (log.elapsed > 5.95))
    segments = np.array([[0, len(samples)]])
    problem = replace(problem, inputs=problem.inputs.select(samples), segments=segments)
    fit = hd.OutputError(windows=(0.4,)).identify(problem, model)
    assert fit.status in FINISHED


@pytest.fixture(scope="module")
def initial(campaign):
    model = hd.catalog["fossen"]
    objective = make_objective(hd.prepare(campaign.vehicle, campaign.train, model), model)
    start = best_initial_iterate(objective, initial_candidates(objective, model), 2.0)
    return objective, start


def test_a_fit_that_stopped_names_the_axes_that_have_not_converged(campaign):
    log, method = campaign.train.between(0.0, 20.0), hd.OutputError((2.0,), max_iterations=1)
    stopped = hd.identify(hd.catalog["fossen"], campaign.vehicle, log, method)
    assert stopped.status is hd.Status.STOPPED
    assert stopped.unconverged
    assert set(stopped.unconverged) <= set(campaign.vehicle.axes)
    words = f"has not converged on {' '.join(stopped.unconverged)}: "
    assert any(words in remark for remark in stopped.remarks)
    with pytest.raises(MethodError, match="max_iterations"):
        hd.OutputError(max_iterations=0)


def test_heavily_damped_steps_do_not_count_as_convergence(initial):
    objective, start = initial
    assert not minimise(objective, replace(start, damping=1e9), FINAL_TOLERANCE).converged
    assert minimise(objective, start, FINAL_TOLERANCE).converged


def test_damping_of_a_failed_stage_is_reset(initial, monkeypatch):
    dampings = []

    def fail(_, iterate, *__):
        dampings.append(iterate.damping)
        return replace(iterate, damping=1e9)

    monkeypatch.setattr(module, "minimise", fail)
    continue_over_lengths(*initial, (2.0, 4.0))
    assert dampings[1] <= 1.0


def test_three_degrees_of_freedom_and_a_gain(exact_log):
    vehicle = replace(hd.fleet["vt690"], actuators=(), axes=("X", "Y", "N"))
    model = hd.catalog["fossen"].restricted_to(vehicle.axes)
    truth = hd.Damping(model, [-10.0, -3.0, -60.0, -150.0, -50.0, -40.0])
    log = exact_log(truth, n=600)
    planar = replace(log, velocity=log.velocity * vehicle.free, acceleration=None)
    simulated = replace(planar, velocity=hd.simulate(vehicle, truth, planar).velocity)
    fit = hd.identify(model, vehicle, simulated, hd.OutputError(windows=(5.0, np.inf)))
    np.testing.assert_allclose(fit.damping.coefficients, truth.coefficients, rtol=0.05)
