"""Standard errors of output error: the delete-one-block jackknife plus the prior."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.continuation import (
    best_initial_iterate,
    continue_over_lengths,
    initial_candidates,
    make_objective,
)
from hydrodamp.identification.held_out_replay import (
    LEVEL,
    PieceNormals,
    jackknife_uncertainty,
    split_pieces,
)
from hydrodamp.identification.shooting_fit import build_fit


@pytest.mark.slow
def test_replicates_are_gauss_newton_steps_without_one_piece(campaign):
    """Delete-one-block jackknife, R. G. Miller (1974), doi:10.1093/biomet/61.1.1, section 4."""
    model = hd.catalog["fossen"]
    objective = make_objective(hd.prepare(campaign.vehicle, campaign.train, model), model)
    iterate = best_initial_iterate(objective, initial_candidates(objective, model)[:1], 2.0)
    iterate = replace(iterate, prior_strength=0.0, penalty_weight=0.0)
    pieces, x = split_pieces(objective.problem), iterate.coefficients
    residual_std = iterate.linearisations[0].residual_std

    def step(kept):
        normal = objective.restrict(kept).windows(2.0).linearise(x, residual_std)[0]
        return np.linalg.solve(normal[:-1, :-1], normal[:-1, -1])

    expected = [x + step(np.delete(pieces, b, axis=0)) - step(pieces) for b in range(len(pieces))]
    replicates = PieceNormals.of(objective, iterate, pieces).replicates
    np.testing.assert_allclose(replicates, expected, rtol=1e-6)
    result = jackknife_uncertainty(objective, iterate, replicates)
    assert result is not None
    assert result.degrees_of_freedom == result.n_blocks - 1 == len(pieces) - 1
    deviations, n = replicates - np.mean(replicates, axis=0), len(pieces)
    expected = (n - 1) / n * deviations.T @ deviations
    np.testing.assert_allclose(result.covariance, expected, rtol=1e-6)


def test_a_coefficient_without_information_has_the_prior_standard_deviation(campaign):
    """The rudder gain in a log whose rudder rests."""
    model = hd.catalog["fossen"].with_terms({"N": "u|u|*rudder"})
    moving = np.array([name != "rudder" for name in campaign.train.command_names])
    log = replace(campaign.train, commands=campaign.train.commands * moving)
    objective = make_objective(hd.prepare(campaign.vehicle, log, model), model)
    iterate = best_initial_iterate(objective, [np.zeros(13)], 4.0)
    iterate = replace(iterate, prior_strength=0.1, prior_variance=4.0)
    replicates = PieceNormals.of(objective, iterate).replicates
    result = jackknife_uncertainty(objective, iterate, replicates)
    assert result is not None
    assert result.standard_errors[-1] == pytest.approx(2.0 * objective.scale[-1])
    assert result.noise_only.standard_errors[-1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("method", [hd.OutputError(), hd.Recommended()])
def test_too_few_samples_have_no_jackknife(campaign, method):
    log = campaign.train.between(0.0, 3.0)
    assert hd.identify(hd.catalog["fossen"], campaign.vehicle, log, method).uncertainty is None


@pytest.mark.slow
def test_intervals_allow_for_the_shift_from_the_start_and_between_halves(campaign):
    """Each variance is at least the square of the shift from the weak-form estimate."""
    model = hd.catalog["linear"]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    objective = make_objective(problem, model)
    start = best_initial_iterate(objective, initial_candidates(objective, model), 2.0)
    end = continue_over_lengths(objective, start, (2.0, 4.0))
    shift = np.abs(end.coefficients - start.coefficients)
    normals = PieceNormals.of(objective, end)
    fit = build_fit(normals, model, hd.OutputError(), start.coefficients)
    assert fit.uncertainty is not None
    assert np.all(fit.uncertainty.standard_errors >= shift * (1.0 - 1e-9))
    square = normals.held_out_errors * np.var(problem.inputs.velocity, axis=0)
    of_sensors = np.array(list(normals.form_errors(np.sqrt(square.min(axis=0))).values()))
    of_form = np.array(list(fit.form_errors.values()))
    # a filter that takes all for noise of the sensors does not hide the error of the form
    bounded = np.array(list(normals.form_errors(np.sqrt(square.max(axis=0))).values()))
    np.testing.assert_allclose(bounded, of_sensors)
    assert np.all(of_sensors[:, 0] > 0.0)
    longest = max(np.ptp(problem.inputs.time[a:b]) for a, b in normals.parts)
    assert np.all((of_form[:, 1] > 0.0) & (of_form[:, 1] <= longest))
    # a replay has an error of the share of its parts, and more where it grows longer
    quantile = np.quantile(square, LEVEL, axis=0)
    assert np.all(of_form[:, 0] ** 2 >= quantile * (1.0 - 1e-9))
    assert np.all(of_form[:, 0] ** 2 <= quantile * np.e * (1.0 + 1e-9))
    jackknife = jackknife_uncertainty(objective, end, normals.replicates)
    assert jackknife is not None
    square = normals.half_difference**2 / np.diag(jackknife.noise_only.covariance)
    axes = objective.entries[1]
    ratio = np.array([np.sqrt(max(square[axes == axis].mean(), 1.0)) for axis in axes])
    wider = build_fit(normals, model, hd.OutputError(), end.coefficients).uncertainty
    assert wider is not None
    np.testing.assert_allclose(wider.standard_errors, ratio * jackknife.standard_errors)
