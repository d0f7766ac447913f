"""The known part equals the fleet's vehicle and the project's own kernel."""

from __future__ import annotations

import numpy as np
import pytest

from hydrodamp.arrays import FloatArray
from hydrodamp.simulation.campaign.motion import Body, momentum_wrench
from hydrodamp.vehicle.fleet import fleet


def test_coriolis_is_the_momentum_law(body: Body, velocities: FloatArray) -> None:
    """The table of products is H(p) nu of equation 1 with p = M nu."""
    expected = momentum_wrench(velocities @ body.mass_matrix, velocities)
    np.testing.assert_allclose(body.coriolis_wrench(velocities), expected, atol=1e-10)


def test_coriolis_does_no_work(body: Body, velocities: FloatArray) -> None:
    """The Coriolis term is workless: nu . H(M nu) nu = 0."""
    power = np.sum(velocities * body.coriolis_wrench(velocities), axis=1)
    np.testing.assert_allclose(power, 0.0, atol=1e-10)


def test_known_wrench_is_the_fleets(body: Body, velocities: FloatArray) -> None:
    """Restoring, fins and propeller together, through two independent programs."""
    rng = np.random.default_rng(4)
    n = len(velocities)
    down = rng.normal(size=(n, 3))
    down /= np.linalg.norm(down, axis=1, keepdims=True)
    angles, rpm = rng.uniform(-0.34, 0.34, (n, 2)), rng.uniform(0.0, 2600.0, n)
    commands = {"rudder": angles[:, 0], "elevator": angles[:, 1], "rpm": rpm}
    ours = body.restoring_wrench(down) + body.fin_wrench(velocities, angles) + body.propulsion(rpm)
    expected = fleet["vt690"].known_wrench(velocities, down, commands)
    np.testing.assert_allclose(ours, expected, rtol=1e-12, atol=1e-10)


def test_fins_sit_at_the_tail(body: Body) -> None:
    """-9.1827 / 9.0728 of the published set."""
    assert body.fins_at == pytest.approx(-1.0121, abs=1e-4)
