"""Standard errors of output error: the delete-one-block jackknife plus the prior."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.gauss_newton import (
    best_initial_iterate,
    continue_over_lengths,
    initial_candidates,
    make_objective,
)
from hydrodamp.identification.output_error import build_fit, jackknife_uncertainty


@pytest.fixture(scope="module")
def campaign():
    return hd.reenact(seed=3, duration=30.0)


def test_without_a_prior_it_is_the_delete_one_block_jackknife(campaign):
    """R. G. Miller (1974), doi:10.1093/biomet/61.1.1, section 4, of the linearised problem."""
    model = hd.catalog["fossen"]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    objective = make_objective(problem, model)
    windows = objective.windows(4.0)
    candidates = initial_candidates(objective, model)[:1]
    iterate = best_initial_iterate(objective, candidates, 4.0)
    (linearisation,), iterate = iterate.linearisations, replace(iterate, prior_strength=0.0)
    residual_std = linearisation.residual_std
    normals = windows.block_normal_matrices(iterate.coefficients, residual_std, 32)
    total = normals.sum(axis=0)
    remaining = [total - normal for normal in normals]
    estimates = [np.linalg.solve(normal[:-1, :-1], normal[:-1, -1]) for normal in remaining]
    deviations, n = np.array(estimates) - np.mean(estimates, axis=0), len(estimates)
    result = jackknife_uncertainty(objective, iterate)
    assert result is not None
    assert result.degrees_of_freedom == result.n_blocks - 1 == n - 1
    np.testing.assert_allclose(
        result.covariance, (n - 1) / n * deviations.T @ deviations, rtol=1e-6
    )


def test_a_coefficient_without_information_has_the_prior_standard_deviation(campaign):
    """The rudder gain in a log whose rudder rests."""
    model = hd.catalog["fossen"].with_terms({"N": "u|u|*rudder"})
    moving = np.array([name != "rudder" for name in campaign.train.command_names])
    log = replace(campaign.train, commands=campaign.train.commands * moving)
    problem = hd.prepare(campaign.vehicle, log, model)
    objective = make_objective(problem, model)
    iterate = best_initial_iterate(objective, [np.zeros(13)], 4.0)
    iterate = replace(iterate, prior_strength=0.1, prior_variance=4.0)
    result = jackknife_uncertainty(objective, iterate)
    assert result is not None
    assert result.standard_errors[-1] == pytest.approx(2.0 * objective.scale[-1])
    assert result.noise_only.standard_errors[-1] == pytest.approx(0.0, abs=1e-12)


def test_too_few_windows_have_no_jackknife(campaign):
    model = hd.catalog["fossen"]
    problem = hd.prepare(campaign.vehicle, campaign.train.between(0.0, 5.0), model)
    objective = make_objective(problem, model)
    iterate = best_initial_iterate(objective, [np.zeros(12)], 4.0)
    assert jackknife_uncertainty(objective, iterate) is None


def test_intervals_allow_for_the_shift_from_the_start_and_between_halves(campaign):
    """Each variance is at least the square of the shift from the weak-form estimate."""
    model = hd.catalog["linear"]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    objective = make_objective(problem, model)
    start = best_initial_iterate(objective, initial_candidates(objective, model), 2.0)
    end = continue_over_lengths(objective, start, (2.0, 4.0))
    shift = np.abs(end.coefficients - start.coefficients)
    fit = build_fit(objective, model, hd.OutputError(), start, end)
    assert fit.uncertainty is not None
    assert np.all(fit.uncertainty.standard_errors >= shift * (1.0 - 1e-9))
    jackknife = jackknife_uncertainty(objective, end)
    assert jackknife is not None
    difference = 3.0 * jackknife.noise_only.standard_errors
    wider = build_fit(objective, model, hd.OutputError(), end, end, difference).uncertainty
    assert wider is not None
    np.testing.assert_allclose(wider.standard_errors, 3.0 * jackknife.standard_errors)
