"""Strips: pure drift as published, drag everywhere, mirror symmetry."""

from __future__ import annotations

import numpy as np
import pytest

from hydrodamp.arrays import FloatArray
from hydrodamp.simulation.campaign.motion import Body
from hydrodamp.simulation.campaign.truth import HULL_LENGTH, Strips

SIDE, DOWN = (171.825, -34.1192), (72.497, -3.68259)
"""Drag and its first moment: -Y_v|v|, -N_v|v| and -Z_w|w|, M_w|w| of the published set."""


@pytest.fixture
def strips(body: Body) -> Strips:
    """The strips of the crossflow truth."""
    return Strips.calibrated((SIDE[0], DOWN[0]), (SIDE[1], DOWN[1]), body.fins_at)


def test_pure_drift_gives_the_published_coefficients(strips: Strips) -> None:
    """At r = q = 0: Y_v|v| -171.825, N_v|v| 34.1192, Z_w|w| -72.497, M_w|w| -3.68259."""
    drift = np.zeros((2, 6))
    drift[0, 1], drift[1, 2] = 0.3, -0.2
    side, down = strips.wrench(drift)
    np.testing.assert_allclose(side, 0.09 * np.array([0, -171.825, 0, 0, 0, 34.1192]))
    np.testing.assert_allclose(down, -0.04 * np.array([0, 0, -72.497, 0, -3.68259, 0]), atol=1e-12)


def test_no_strip_ever_drives(strips: Strips, velocities: FloatArray) -> None:
    """The power of the drag is never positive."""
    power = np.sum(velocities * strips.wrench(velocities), axis=1)
    assert np.max(power) <= 0.0


def test_turning_in_place_agrees_with_the_integral(strips: Strips, body: Body) -> None:
    """N_r|r| = -c L^4/32 - c_f |x_f|^3 for a uniform hull and fins at x_f."""
    fins = SIDE[1] / body.fins_at
    hull = (SIDE[0] - fins) / HULL_LENGTH
    exact = -hull * HULL_LENGTH**4 / 32 - fins * abs(body.fins_at) ** 3
    turning = np.zeros((1, 6))
    turning[0, 5] = 1.0
    assert strips.wrench(turning)[0, 5] == pytest.approx(exact, rel=2e-3)


def test_port_and_starboard_alike(strips: Strips, velocities: FloatArray) -> None:
    """Reversing v and r reverses Y and N and leaves Z and M."""
    mirror = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    np.testing.assert_allclose(
        strips.wrench(velocities * mirror), strips.wrench(velocities) * mirror
    )


def test_both_planes_obey_one_law(body: Body) -> None:
    """With equal drag, turning by 90 degrees about x changes nothing."""
    alike = Strips.calibrated((100.0, 100.0), (-20.0, -20.0), body.fins_at)
    flat, upright = np.zeros((1, 6)), np.zeros((1, 6))
    flat[0, [1, 5]] = 0.3, 0.2
    upright[0, [2, 4]] = 0.3, -0.2
    (force, moment), other = alike.wrench(flat)[0, [1, 5]], alike.wrench(upright)[0, [2, 4]]
    np.testing.assert_allclose(other, [force, -moment])
