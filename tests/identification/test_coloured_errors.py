"""Coloured sensor errors: innovations, their correlation, and the likelihood of entire segments."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

import hydrodamp as hd
from hydrodamp.identification.continuation import error_growth, make_objective
from hydrodamp.identification.gauss_newton import Iterate
from hydrodamp.identification.multiple_shooting import VelocityOutputs
from hydrodamp.identification.output_error import (
    MAX_RELATIVE_TIME,
    are_sensor_errors,
    lag_correlation,
)
from hydrodamp.simulation.campaign.conditions import true_damping

MODEL = hd.catalog["prestero"].with_terms({"K": "up"}, key="truth")
CORRELATION = np.array([0.8, 0.6, 0.7, 0.3, 0.0, 0.5])


@pytest.fixture(scope="module")
def campaign():
    return hd.reenact(seed=5, duration=40.0)


@pytest.fixture(scope="module")
def coloured(campaign):
    """A log with AR(1) errors of the standard deviations of the sensors."""
    log, exact, rng = campaign.train, campaign.exact_train, np.random.default_rng(5)
    std = np.std(log.velocity - exact.velocity, axis=0)
    innovations = rng.standard_normal(log.velocity.shape) * np.sqrt(1.0 - CORRELATION**2)
    errors = [
        lfilter([1.0], [1.0, -a], each) for a, each in zip(CORRELATION, innovations.T, strict=True)
    ]
    velocity = exact.velocity + np.transpose(errors) * std
    return hd.prepare(campaign.vehicle, replace(log, velocity=velocity), MODEL)


@pytest.fixture(scope="module")
def objective(coloured):
    return make_objective(coloured, MODEL)


@pytest.fixture(scope="module")
def truth():
    values = true_damping().as_dict()
    return np.array([values.get(label, 0.0) for label in MODEL.labels])


def test_innovations_of_an_autoregression_are_white(objective, truth, campaign):
    """e_t = r_t - a r_(t-1) of an AR(1) process is its white noise (Box and Jenkins)."""
    windows = objective.windows(np.inf)
    exact = campaign.exact_train.velocity[windows.bounds[:, 0]]
    windows = replace(windows, initial_states=exact)
    whitened = replace(windows, outputs=VelocityOutputs(correlation=tuple(CORRELATION)))
    for outputs, is_white in ((windows, False), (whitened, True)):
        (series,) = outputs.outputs.residuals(outputs, truth)
        e = series.residuals
        lag = np.sum(e[1:] * e[:-1], axis=0) / np.sum(e**2, axis=0)
        bound = 4.0 / np.sqrt(len(e))
        assert np.all(np.abs(lag) < bound) == is_white


def test_slopes_of_innovations_are_their_derivatives(objective, truth):
    windows = replace(
        objective.windows(np.inf), outputs=VelocityOutputs(correlation=tuple(CORRELATION))
    )
    outputs, std = windows.outputs, np.ones(6)
    columns = outputs.linearise(windows, truth, std).columns
    label = MODEL.index("N_r|r|")
    step = 1e-5 * abs(truth[label])
    sides = [
        outputs.averages(windows, truth + sign * step * (np.arange(len(truth)) == label), std)
        for sign in (1.0, -1.0)
    ]
    slope = -(sides[0] - sides[1]) / (2.0 * step)
    np.testing.assert_allclose(columns[:, 6 + label], slope, atol=1e-6 * np.abs(slope).max())


def test_correlation_is_that_of_the_errors(objective, truth):
    iterate = objective.add_length(Iterate(truth, ()), objective.windows(np.inf))
    np.testing.assert_allclose(lag_correlation(objective, iterate), CORRELATION, atol=0.07)


def test_errors_longer_than_a_part_of_the_motion_are_not_sensor_errors(objective):
    step = float(np.median(objective.problem.log.steps))
    limit = np.exp(-step / (MAX_RELATIVE_TIME * objective.time_scale))
    for correlation, expected in ((0.99 * limit, True), (np.sqrt(limit), False)):
        outputs = VelocityOutputs(correlation=(0.0,) * 5 + (correlation,))
        assert are_sensor_errors(replace(objective, outputs=outputs)) == expected
    assert not are_sensor_errors(objective)


@pytest.mark.slow
def test_the_likelihood_is_used_where_the_model_holds_the_truth(coloured, truth):
    """Errors fall against those of windows, and intervals at 95 % cover the truth."""
    fits = [method.identify(coloured, MODEL) for method in (hd.OutputError(), hd.Recommended())]
    assert "successive errors" in fits[1].remarks[0]
    error = np.array([fit.damping.coefficients - truth for fit in fits])
    known = fits[1].uncertainty
    assert np.mean(np.abs(error[1]) < known.critical_value() * known.standard_errors) > 0.85
    assert np.median(np.abs(error[1]) / np.abs(error[0])) < 1.0
    assert known.bias_allowance == ""


@pytest.mark.slow
def test_errors_of_a_model_without_the_terms_of_the_truth_grow(campaign):
    """Entire segments are not whitened where residuals are those of the form."""
    model = hd.catalog["fossen"]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    fit = hd.Recommended().identify(problem, model)
    assert "successive errors" not in fit.remarks[0]
    assert "weak-form" in fit.uncertainty.bias_allowance


def test_growth_compares_the_longest_with_the_shortest_windows(objective, truth):
    iterate = Iterate(truth, ())
    for length in (2.0, np.inf):
        iterate = objective.add_length(iterate, objective.windows(length))
    assert error_growth(objective, iterate) < 1.5
    wrong = truth * np.where(np.char.startswith(MODEL.labels, "N_"), 0.5, 1.0)
    assert error_growth(objective, objective.move(iterate, wrong)) > 2.5


def test_residuals_of_diverged_windows_are_not_sensor_errors(objective, truth):
    unstable = truth + 1e4 * (np.arange(len(truth)) == MODEL.index("X_u|u|"))
    iterate = objective.add_length(Iterate(unstable, ()), objective.windows(np.inf))
    assert lag_correlation(objective, iterate) == (1.0,) * 6


@pytest.mark.slow
def test_held_out_parts_are_replayed_by_the_vehicle_of_the_estimate(campaign):
    """A file with 0.6 of the added mass in yaw: the R² of the joint fit is that of its vehicle."""
    added = campaign.vehicle.added_mass * np.where(np.arange(36).reshape(6, 6) == 35, 0.6, 1.0)
    mass = campaign.vehicle.mass_matrix - campaign.vehicle.added_mass + added
    vehicle = replace(campaign.vehicle, added_mass=added, mass_matrix=mass)
    problem = hd.prepare(vehicle, campaign.train, MODEL)
    fit = hd.Recommended(estimate=("added-mass",)).identify(problem, MODEL)
    assert fit.estimates["A_N"].is_determined
    assert fit.held_out_r_squared["N"] > 0.99


def test_a_log_too_short_for_intervals_is_graded_by_the_weak_form_or_not_at_all(campaign):
    log = campaign.train.between(0.0, 2.5)
    problem = hd.prepare(campaign.vehicle, log, hd.catalog["fossen"])
    fit = hd.Recommended().identify(problem, hd.catalog["fossen"])
    assert fit.damping.covariance is None
    (graded,) = hd.grade_fits(problem, [fit])
    assert set(graded.grades.values()) <= set(hd.Grade)


def test_a_velocity_that_is_constant_is_not_predicted(campaign):
    velocity = campaign.train.velocity * (np.arange(6) != 3)
    log = replace(campaign.train, velocity=velocity, acceleration=None)
    problem = hd.prepare(campaign.vehicle, log, hd.catalog["fossen"])
    fit = hd.OutputError(windows=(2.0, 4.0)).identify(problem, hd.catalog["fossen"])
    assert fit.held_out_r_squared["K"] == 0.0
