"""The motion: equilibria, energy, and the steady turns of the Bulletin."""

import numpy as np
import pytest

from hydrodamp.simulation.campaign.conditions import sname_truth, true_damping
from hydrodamp.simulation.campaign.reenact import Motion
from hydrodamp.simulation.closed_loop import down_direction, pose_rates
from hydrodamp.vehicle.file import fleet

VEHICLE = fleet["vt690"]


def states(n, surge=0.0):
    """States of n vehicles on a level course at one speed."""
    level = np.zeros((n, 14))
    level[:, 0] = surge
    return level


def motion_of(truth, rpm):
    """Vehicles with the propeller speeds given."""
    return Motion(VEHICLE, truth, np.array(rpm))


def test_straight_ahead_the_speed_is_a_thousandth_of_the_rpm(truth):
    """Published u_c = 0.001 rpm is the equilibrium of thrust and drag."""
    motion = motion_of(truth, [1800.0, 2600.0])
    np.testing.assert_allclose(motion.steady_surge, [1.8, 2.6])
    sailing = states(2)
    sailing[:, 0] = motion.steady_surge
    np.testing.assert_allclose(motion.acceleration(sailing), 0.0, atol=1e-12)


@pytest.mark.slow
def test_energy_only_falls_without_propeller(truth):
    """Kinetic plus potential energy of a vehicle coasting with roll and rates."""
    motion = motion_of(truth, [0.0])
    state = states(1, 2.0)
    state[0, [1, 3, 5, 6]] = 0.1, 0.3, 0.1, 0.2
    energies = []
    for _ in range(100):
        nu = state[0, :6]
        righting = -VEHICLE.restoring_matrix[3, 1] * down_direction(state[:, 6:9])[0, 2]
        energies.append(0.5 * nu @ VEHICLE.mass_matrix @ nu - righting)
        state = motion.advance(state, np.zeros((1, 2)), 0.1)
    assert np.all(np.diff(energies) < 0.0)


@pytest.mark.slow
def test_steady_turns_of_the_bulletin():
    """SNAME T&R Bulletin 1-45, tables 8.1-8.2, six degrees of freedom, 2.06 m/s.

    Rudder 10, 15, 20 degrees: radius 5.43, 3.96, 3.16 lengths of 2.194 m, drift
    3.98, 5.11, 6.05 degrees. An independent planar solver of the same set loses
    5.92, 10.43, 15.17 % of its surge speed (vehicles-and-methods, section 1).
    """
    commands = np.zeros((3, 2))
    commands[:, 0] = np.radians([10.0, 15.0, 20.0])
    motion = motion_of(sname_truth(true_damping()), [2060.0] * 3)
    state = motion.advance(motion.receive(states(3, 2.06), commands), commands, 40.0)
    u, v, r = state[:, 0], state[:, 1], state[:, 5]
    radius = np.hypot(u, v) / np.abs(r) / 2.194
    np.testing.assert_allclose(radius, [5.43, 3.96, 3.16], rtol=0.06)
    np.testing.assert_allclose(np.degrees(np.arctan2(v, u)), [3.98, 5.11, 6.05], atol=0.05)
    np.testing.assert_allclose(100.0 * (1.0 - u / 2.06), [5.92, 10.43, 15.17], atol=0.03)


def test_fins_lag_as_stated(truth):
    """First order towards the command, or at once."""
    motion = motion_of(truth, [2000.0])
    commands = np.array([[0.2, -0.1]])
    state = motion.receive(states(1, 2.0), commands)
    after = motion.advance(state, commands, 0.1)[:, 12:]
    share = 1.0 - np.exp(-0.1 / truth.fin_lag) if truth.fin_lag else 1.0
    np.testing.assert_allclose(after, share * commands, rtol=1e-3)


def test_the_down_vector_turns_against_the_body():
    """By differences: d(R^T e3)/dt = R^T e3 x omega, also beyond a pitch of 90 deg."""
    rng = np.random.default_rng(6)
    euler, velocity = rng.uniform(-1.0, 1.0, (50, 3)), rng.normal(size=(50, 6))
    euler[25:, 1] += 2.5
    turning, h = pose_rates(velocity, euler)[:, :3], 1e-6
    difference = down_direction(euler + h * turning) - down_direction(euler - h * turning)
    expected = np.cross(down_direction(euler), velocity[:, 3:])
    np.testing.assert_allclose(difference / (2 * h), expected, atol=1e-7)


def test_the_depth_rate_is_the_velocity_along_the_down_vector():
    rng = np.random.default_rng(7)
    euler, velocity = rng.uniform(-1.0, 1.0, (50, 3)), rng.normal(size=(50, 6))
    rates = pose_rates(velocity, euler)
    expected = np.sum(down_direction(euler) * velocity[:, :3], axis=1)
    np.testing.assert_allclose(rates[:, 5], expected, atol=1e-14)
    speeds = np.linalg.norm(velocity[:, :3], axis=1)
    np.testing.assert_allclose(np.linalg.norm(rates[:, 3:], axis=1), speeds)
