"""Consistency of estimators whose model holds the truth."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.continuation import best_initial_iterate, make_objective, update_prior
from hydrodamp.simulation.campaign.conditions import WHITE_NOISE, true_damping
from hydrodamp.simulation.campaign.reenact import CampaignSetup

MODEL = hd.catalog["prestero"].with_terms({"K": "up"}, key="prestero+up")
TRUTH = np.array([true_damping().as_dict().get(label, 0.0) for label in MODEL.labels])


@pytest.fixture(scope="module")
def campaigns():
    return CampaignSetup.of("sname").simulate(range(1, 17), 30.0, WHITE_NOISE)


def problem_of(campaigns):
    log = hd.concatenate([campaign.train for campaign in campaigns])
    return hd.prepare(campaigns[0].vehicle, replace(log, acceleration=None), [MODEL])


def replay_error(campaign, coefficients):
    """RMS error of the replay of the exact test runs, in units of each sensor's noise."""
    exact = campaign.exact_test
    replay = hd.simulate(campaign.vehicle, hd.Damping(MODEL, coefficients), exact)
    error = replay.velocity - exact.velocity
    return float(np.sqrt(np.mean((error / ([0.0133] * 3 + [8.7e-4] * 3)) ** 2)))


@pytest.mark.slow
@pytest.mark.parametrize("method", [hd.OutputError(), hd.Recommended()])
def test_sixteen_times_the_data_quarter_the_replay_error(campaigns, method):
    """Errors fall as 1/√N; a factor of 2.5 instead of 4 leaves room for the scatter of one draw."""
    short = [method.identify(problem_of([each]), MODEL) for each in campaigns[:4]]
    errors = [replay_error(campaigns[0], fit.damping.coefficients) for fit in short]
    long = method.identify(problem_of(campaigns), MODEL)
    error = replay_error(campaigns[0], long.damping.coefficients)
    assert error < np.sqrt(np.mean(np.square(errors))) / 2.5


@pytest.mark.slow
def test_prior_and_penalty_vanish_with_the_length(campaigns):
    """Both are inverse to the number of independent residuals, which is itself estimated."""
    strengths = []
    for n in (1, 16):
        objective = make_objective(problem_of(campaigns[:n]), MODEL)
        iterate = best_initial_iterate(objective, [TRUTH], objective.time_scale)
        updated = update_prior(objective, iterate)
        strengths.append(np.array([updated.prior_strength, updated.penalty_weight]))
    assert np.all(strengths[1] < strengths[0] / 8.0)
