"""The recommended method: held-out replay, and difficult logs."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.continuation import make_objective
from hydrodamp.identification.held_out_replay import split_pieces


@pytest.fixture(scope="module")
def campaign():
    return hd.reenact(seed=1, duration=40.0)


@pytest.mark.slow
@pytest.mark.parametrize("duration", [12.0, 40.0])
def test_pieces_cover_every_segment(campaign, duration):
    model, log = hd.catalog["fossen"], campaign.train.between(0.0, duration)
    problem = hd.prepare(campaign.vehicle, log, model)
    pieces = split_pieces(problem)
    assert pieces[0, 0] == 0
    assert pieces[-1, 1] == problem.n_samples
    np.testing.assert_array_equal(pieces[1:, 0], pieces[:-1, 1])
    half = make_objective(problem, model).restrict(pieces[::2]).problem
    first, expected = half.inputs.velocity[: half.segments[0, 1]], problem.inputs.velocity
    np.testing.assert_array_equal(first, expected[: pieces[0, 1]])
    assert half.n_samples == np.diff(pieces[::2], axis=1).sum()


@pytest.mark.slow
def test_slightly_more_data_changes_the_replay_slightly(campaign):
    """Replays fitted to 90 % and 100 % of each segment differ less than either from the log."""
    model = hd.catalog["prestero"].with_terms({"K": "up"}, key="true-terms")
    starts = campaign.train.time[campaign.train.bounds[:, 0]].tolist()
    shorter = hd.concatenate([campaign.train.between(start, start + 36.0) for start in starts])
    fits = [
        hd.identify(model, campaign.vehicle, log, hd.Recommended())
        for log in (campaign.train, shorter)
    ]
    replays = [hd.simulate(campaign.vehicle, fit.damping, campaign.test).velocity for fit in fits]
    difference = np.sqrt(np.mean((replays[0] - replays[1]) ** 2, axis=0))
    error = np.sqrt(np.mean((replays[0] - campaign.test.velocity) ** 2, axis=0))
    assert np.all(difference < error)


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["short", "at rest", "dead axis", "stuck actuator"])
def test_a_poor_log_gives_a_status_not_an_exception(campaign, fault):
    log = campaign.train.between(0.0, 20.0)
    if fault == "at rest":
        log = replace(log, velocity=np.zeros_like(log.velocity))
    if fault == "dead axis":
        log = replace(log, velocity=log.velocity * [1, 1, 0, 1, 1, 1])
    if fault == "stuck actuator":
        moving = np.array([name != "rudder" for name in log.command_names])
        log = replace(log, commands=log.commands * moving)
    model = hd.catalog["gertler-hagen"]
    fit = hd.identify(model, campaign.vehicle, log, hd.Recommended())
    assert np.all(np.isfinite(fit.damping.coefficients))
    assert fit.status in (hd.Status.OK, hd.Status.STOPPED, hd.Status.RANK_DEFICIENT)
