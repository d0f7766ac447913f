"""Pushes that an autopilot answers: bias of output error, and the shift that bounds it."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.continuation import fit_windows
from hydrodamp.identification.disturbances import disturbance_shifts
from hydrodamp.identification.gauss_newton import make_objective
from hydrodamp.simulation.campaign.conditions import true_damping
from hydrodamp.simulation.campaign.reenact import CampaignSetup

MODEL = hd.catalog["prestero"].with_terms({"K": "up"}, key="prestero+up")


class Pushed:
    """White sensor errors, and pushes in sway and yaw with a correlation time of 3 s."""

    def sample_sensor_errors(self, seed, n_runs, n, period):
        return hd.WHITE_NOISE.sample_sensor_errors(seed, n_runs, n, period)

    def sample_disturbances(self, seed, n_runs, n, period):
        rng, decay = np.random.default_rng([seed, 7]), np.exp(-period / 3.0)
        pushes = np.zeros((n, n_runs, 6))
        for k in range(1, n):
            step = rng.standard_normal((n_runs, 6)) * (0.0, 3.0, 0.0, 0.0, 0.0, 3.0)
            pushes[k] = decay * pushes[k - 1] + np.sqrt(1.0 - decay**2) * step
        return pushes


@pytest.fixture(scope="module")
def estimates():
    """Errors of N_uv in six campaigns, and the shifts by windows of two lengths."""
    errors, shifts, place = [], [], MODEL.labels.index("N_uv")
    truth = true_damping()["N_uv"]
    for campaign in CampaignSetup.of("sname").simulate(range(6), 40.0, Pushed()):
        problem = hd.prepare(campaign.vehicle, campaign.train, MODEL)
        objective = make_objective(problem, MODEL)
        _, result = fit_windows(objective, MODEL)
        errors.append(result.coefficients[place] - truth)
        shifts.append([each[place] for each in disturbance_shifts(objective, MODEL, result)])
    return np.array(errors), np.array(shifts).T


def test_unknown_wrenches_reduce_the_bias(estimates):
    errors, shifts = estimates
    assert np.all(errors > 0.0)  # chance of one sign in six campaigns without a bias: 1/32
    for shift in shifts:
        assert abs(np.mean(errors + shift)) < 0.7 * np.mean(errors)


def test_twice_the_larger_shift_covers_the_bias(estimates):
    errors, shifts = estimates
    assert np.mean(np.abs(errors) < 2.0 * np.max(np.abs(shifts), axis=0)) > 0.8
