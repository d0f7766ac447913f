"""Slopes over chosen windows: exact on parabolas, and a budget that adds up."""

from __future__ import annotations

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError

LINEAR = hd.catalog["linear"]


def problem_of(vehicle, time, velocity):
    log = hd.Log.from_arrays(
        time, velocity, wrench=np.zeros((len(time), 6)), attitude=np.zeros((len(time), 3))
    )
    return hd.prepare(vehicle, log, LINEAR)


def swaying(noise, seed=0, n=4000, step=0.1):
    """Sines of unit size and their slopes; white noise on the velocities."""
    time = step * np.arange(n)
    rates = np.linspace(0.8, 2.0, 6)
    rng = np.random.default_rng(seed)
    velocity = np.sin(np.outer(time, rates)) + noise * rng.normal(size=(n, 6))
    return time, velocity, rates * np.cos(np.outer(time, rates))


def test_parabolas_are_exact_on_an_irregular_clock(vehicle):
    time = np.cumsum(np.random.default_rng(3).uniform(0.05, 0.15, 300))
    velocity = np.outer((time / 20) ** 2, np.ones(6))
    found = hd.ChosenSlopes().acceleration(problem_of(vehicle, time, velocity))
    np.testing.assert_allclose(found, np.outer(time / 200, np.ones(6)), atol=1e-9)


def test_more_noise_takes_longer_windows(vehicle):
    quiet, loud = (
        hd.ChosenSlopes().chosen(problem_of(vehicle, *swaying(noise)[:2])) for noise in (0.001, 0.3)
    )
    assert all(one <= two for one, two in zip(quiet, loud, strict=True))
    assert max(quiet) < max(loud)


def test_the_budget_is_what_the_error_comes_to(vehicle):
    """Mean square error against the known slope: noise and bias squared, within a fifth."""
    time, velocity, slope = swaying(0.05)
    problem = problem_of(vehicle, time, velocity)
    error = hd.ChosenSlopes().acceleration(problem)[20:-20] - slope[20:-20]
    for axis, one in enumerate(hd.ChosenSlopes().budget(problem)):
        assert one.bias is not None
        told = np.hypot(one.noise, one.bias)
        assert told == pytest.approx(np.sqrt(np.mean(error[:, axis] ** 2)), rel=0.2)


def test_the_shortest_window_knows_no_bias(vehicle):
    time, velocity, _ = swaying(0.0, n=400)
    budget = hd.ChosenSlopes(windows=(5,)).budget(problem_of(vehicle, time, velocity))
    assert {one.bias for one in budget} == {None}
    assert "bias unknown" in str(budget[0])


def test_the_fit_tells_the_budget():
    campaign = hd.reenact(duration=30.0)
    fit = hd.identify(LINEAR, campaign.vehicle, campaign.train, hd.find_method("ls-cv"))
    assert fit.method == "ls-cv"
    assert any("noise" in said and "bias" in said for said in fit.remarks)


@pytest.mark.parametrize("windows", [(), (4,), (7, 5), (3, 5)])
def test_windows_that_make_no_choice_are_refused(windows):
    with pytest.raises(MethodError, match="odd, rising"):
        hd.ChosenSlopes(windows=windows)
