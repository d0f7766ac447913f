"""Output error: the same least squares by SciPy, with finite differences through our replay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from interleaving import interleaved
from scipy.optimize import least_squares

import hydrodamp as hd
from hydrodamp.data.measurement import Measurement
from hydrodamp.identification.continuation import initial_candidates, make_objective
from hydrodamp.identification.gauss_newton import Iterate, minimise

pytestmark = pytest.mark.usefixtures("one_core")


@pytest.mark.parametrize(("key", "target"), [("fossen", None), ("gertler-hagen", 10.0)])
def test_against_scipy(benchmark, ledger, key, target):
    """Four runs of 60 s in windows of 8 s, from the weak form, at least as near in the end.

    Finite differences replay once a coefficient: few coefficients leave little to gain.
    """
    campaign, model = hd.reenact(seed=0, duration=60.0), hd.catalog[key]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    objective = make_objective(problem, model)
    # SciPy does not estimate initial states, so they are fixed here, too.
    windows = replace(objective.windows(8.0), initial_state_std=np.full(6, 1e-9))
    first = initial_candidates(objective, model)[-1]
    start = objective.add_length(Iterate(first, (), prior_strength=1e-4), windows)
    residual_std = objective.residual_std(first, windows)

    def residuals(coefficients: np.ndarray) -> np.ndarray:
        ((*_, values),) = windows.outputs.residuals(windows, coefficients)
        return (values / residual_std).ravel()

    def ours() -> np.ndarray:
        return minimise(objective, start, tolerance=1e-2).coefficients

    def scipy() -> np.ndarray:
        return least_squares(residuals, first, x_scale=objective.scale, ftol=1e-2, max_nfev=12).x

    fast, slow = interleaved(benchmark, ours, scipy, rounds=2, other_rounds=1)

    scipy_cost, cost = (
        np.log(objective.residual_std(solve(), windows)).mean() for solve in (scipy, ours)
    )
    assert cost < scipy_cost + 0.01
    ledger.faster(
        f"output error, {key}: least_squares with finite differences", fast, slow, target=target
    )


def test_sensors_against_velocities(benchmark, ledger):
    """`oe` on five sensors at their own times, with p q r, against `oe` on all velocities."""
    campaign, model = hd.reenact(seed=0), hd.catalog["linear"]
    log = campaign.train
    position = Measurement("usbl", "position", *_every(log, 10, np.zeros((log.n, 3))))
    speed = Measurement("dvl", "velocity", *_every(log, 5, log.velocity[:, :3]))
    force = Measurement("imu", "specific_force", *_every(log, 1, np.tile([0, 0, -9.8], (log.n, 1))))
    rates = Measurement("gyro", "rates", *_every(log, 1, log.velocity[:, 3:]))
    bottom = Measurement("bottom", "ground_velocity", *_every(log, 2, log.velocity[:, :3]))
    sensors = (position, speed, force, rates, bottom)
    bare = replace(log, velocity_names=("p", "q", "r"), measurements=sensors)
    problems = [hd.prepare(campaign.vehicle, each, model) for each in (bare, log)]
    sensed, measured = (
        lambda problem=problem: hd.OutputError().identify(problem, model) for problem in problems
    )
    fast, slow = interleaved(benchmark, measured, sensed, rounds=2, other_rounds=1)
    ledger.faster(
        "output error, linear: five sensors instead of velocities", fast, slow, target=None
    )


def _every(log: hd.Log, step: int, series: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return time, values, components, noise and segment of every so many samples."""
    return log.time[::step], series[::step], (), np.full(3, 0.05), log.segment_numbers[::step]
