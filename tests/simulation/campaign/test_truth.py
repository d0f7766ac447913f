"""What the water does, strips included: published numbers, dissipation, symmetry."""

import numpy as np
import pytest

from hydrodamp.simulation.campaign.conditions import (
    HULL_LENGTH,
    Strips,
    crossflow_truth,
    fin_position,
    sname_truth,
    true_damping,
)
from hydrodamp.vehicle.file import fleet


def hull_wrench(truth, velocity):
    """What the water does to the hull, fins and propeller apart."""
    wrench = truth.damping.wrench(velocity)
    return wrench if truth.strips is None else wrench + truth.strips.wrench(velocity)


def test_port_and_starboard_alike(truth, velocities):
    """Reversing v, p and r reverses Y, K and N and leaves X, Z and M."""
    mirror = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    wrench, mirrored = hull_wrench(truth, velocities), hull_wrench(truth, velocities * mirror)
    np.testing.assert_allclose(mirrored, wrench * mirror, atol=1e-12)


def test_fins_meet_the_drift_as_published():
    """rudder - 0.178 atan2(-v, u); the elevator by turning 90 degrees about x."""
    truth = crossflow_truth(true_damping(), TAIL)
    velocity = np.array([[2.0, 0.2, -0.1, 0.0, 0.0, 0.0]])
    angles = truth.effective_fins(velocity, np.array([[0.1, -0.05]]))[0]
    expected = [0.1 - 0.178 * np.arctan2(-0.2, 2.0), -0.05 - 0.178 * np.arctan2(0.1, 2.0)]
    np.testing.assert_allclose(angles, expected)
    published, fins = sname_truth(true_damping()), np.ones((1, 2))
    assert published.effective_fins(velocity, fins) is fins
    assert published.fin_lag == 0.0


TAIL = fin_position(fleet["vt690"])

SIDE, DOWN = (171.825, -34.1192), (72.497, -3.68259)
"""Drag and its first moment: -Y_v|v|, -N_v|v| and -Z_w|w|, M_w|w| of the published set."""


@pytest.fixture
def strips():
    """The strips of the crossflow truth."""
    return Strips.calibrated((SIDE[0], DOWN[0]), (SIDE[1], DOWN[1]), TAIL)


def test_pure_drift_gives_the_published_coefficients(strips):
    """At r = q = 0: Y_v|v| -171.825, N_v|v| 34.1192, Z_w|w| -72.497, M_w|w| -3.68259."""
    drift = np.zeros((2, 6))
    drift[0, 1], drift[1, 2] = 0.3, -0.2
    side, down = strips.wrench(drift)
    np.testing.assert_allclose(side, 0.09 * np.array([0, -171.825, 0, 0, 0, 34.1192]))
    np.testing.assert_allclose(down, -0.04 * np.array([0, 0, -72.497, 0, -3.68259, 0]), atol=1e-12)


def test_turning_in_place_agrees_with_the_integral(strips):
    """N_r|r| = -c L^4/32 - c_f |x_f|^3 for a uniform hull and fins at x_f."""
    fins = SIDE[1] / TAIL
    hull = (SIDE[0] - fins) / HULL_LENGTH
    exact = -hull * HULL_LENGTH**4 / 32 - fins * abs(TAIL) ** 3
    turning = np.zeros((1, 6))
    turning[0, 5] = 1.0
    assert strips.wrench(turning)[0, 5] == pytest.approx(exact, rel=2e-3)
