"""The recommended method: which windows it takes, and what a hard log makes of it."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification import recommended as module
from hydrodamp.identification.gauss_newton import make_objective
from hydrodamp.identification.recommended import _certain, _pieces


@pytest.fixture(scope="module")
def campaign():
    return hd.reenact(seed=1, duration=40.0)


def problem_of(campaign, key="fossen"):
    return hd.prepare(campaign.vehicle, campaign.train, hd.catalog[key])


@pytest.mark.parametrize(("worse", "words"), [(1.0, "no search did better"), (-1.0, "were 2 s")])
def test_a_start_that_does_better_on_the_other_half_is_what_is_returned(
    campaign, monkeypatch, worse, words
):
    monkeypatch.setattr(module, "_halves", lambda *_: (np.full(4, worse), np.zeros(12)))
    fit = hd.Recommended().identify(problem_of(campaign), hd.catalog["fossen"])
    assert words in fit.remarks[0]
    assert fit.method == "recommended"
    assert fit.uncertainty is not None


def test_a_start_that_is_better_by_chance_alone_is_not_certain():
    assert not _certain(np.array([0.0, 1.0]))
    assert _certain(np.array([4.0, 5.0]))


@pytest.mark.parametrize("duration", [12.0, 40.0])
def test_each_half_has_every_second_piece_of_every_segment(campaign, duration):
    problem = hd.prepare(
        campaign.vehicle, campaign.train.between(0.0, duration), hd.catalog["fossen"]
    )
    pieces = _pieces(problem)
    assert pieces[0, 0] == 0
    assert pieces[-1, 1] == problem.n_samples
    np.testing.assert_array_equal(pieces[1:, 0], pieces[:-1, 1])
    assert not len(pieces) % 2
    half = make_objective(problem, hd.catalog["fossen"]).part(pieces[::2]).problem
    np.testing.assert_array_equal(
        half.inputs.velocity[: half.segments[0, 1]], problem.inputs.velocity[: pieces[0, 1]]
    )
    assert half.n_samples == np.diff(pieces[::2], axis=1).sum()


def test_a_little_more_data_moves_the_replay_a_little(campaign):
    """Nine tenths of every run and all of it: the two replays are nearer than either to the log."""
    model = hd.catalog["prestero"].with_terms({"K": "up"}, key="true-terms")
    ends = campaign.train.time[campaign.train.bounds[:, 0]]
    shorter = hd.concatenate([campaign.train.between(one, one + 36.0) for one in ends.tolist()])
    fits = [
        hd.identify(model, campaign.vehicle, log, hd.Recommended())
        for log in (campaign.train, shorter)
    ]
    one, other = (hd.simulate(campaign.vehicle, fit.damping, campaign.test) for fit in fits)
    apart = np.sqrt(np.mean((one.velocity - other.velocity) ** 2, axis=0))
    left = np.sqrt(np.mean((one.velocity - campaign.test.velocity) ** 2, axis=0))
    assert np.all(apart < left)


@pytest.mark.parametrize("fault", ["short", "still", "dead axis", "stuck actuator"])
def test_a_poor_log_is_a_status_not_an_exception(campaign, fault):
    log = campaign.train.between(0.0, 20.0)
    if fault == "still":
        log = replace(log, velocity=np.zeros_like(log.velocity))
    if fault == "dead axis":
        log = replace(log, velocity=log.velocity * [1, 1, 0, 1, 1, 1])
    if fault == "stuck actuator":
        kept = np.array([name != "rudder" for name in log.command_names])
        log = replace(log, commands=log.commands * kept)
    model = hd.catalog["gertler-hagen"]
    fit = hd.identify(model, campaign.vehicle, log, hd.Recommended())
    assert np.all(np.isfinite(fit.damping.coefficients))
    assert fit.status in (hd.Status.OK, hd.Status.STOPPED, hd.Status.RANK_DEFICIENT)
