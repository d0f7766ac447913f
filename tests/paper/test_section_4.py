"""Section IV: the adaptive identifier, equations 15 and 16; 21 and 23 are kept in ``kernels``."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import hydrodamp as hd
from hydrodamp.kernels.core import coriolis

A, GAMMA = 20.0, 20.0  # section V-B: "Adaption gains are alpha = 20 and gamma = 20"
RATES = np.array([0.3, 0.5, 0.7, 0.9, 1.1, 1.3])
SIZES = np.array([0.3, 0.2, 0.2, 0.3, 0.2, 0.2])


def motion(time):
    """A smooth velocity (n, 6) that the identifier is shown."""
    return SIZES * np.sin(np.outer(time, RATES)) + np.array([1.5, 0, 0, 0, 0, 0])


def wrench(time):
    """A smooth wrench (n, 6) of the actuators."""
    return 5.0 * np.cos(np.outer(time, RATES[::-1]))


def by_ode(vehicle, duration):
    """Equations 15 and 16 as printed, with M d(nu-hat)/dt on the left, by DOP853."""
    mass = vehicle.mass_matrix

    def rates(time, state):
        nu, estimate, k_hat = motion(np.array([time])), state[:6], state[6:].reshape(6, 6)
        error = estimate - nu[0]
        known = coriolis(mass, nu)[0] + vehicle.restoring_wrench(np.array([[0, 0, 1.0]]))[0]
        force = known + wrench(np.array([time]))[0] + k_hat @ nu[0] - A * error  # equation 15
        turning = -GAMMA * np.outer(error, nu[0])  # equation 16
        return np.concatenate([np.linalg.solve(mass, force), turning.ravel()])

    start = np.concatenate([motion(np.array([0.0]))[0], -np.eye(6).ravel()])
    end = solve_ivp(rates, (0, duration), start, method="DOP853", rtol=1e-10, atol=1e-12)
    return end.y[6:, -1].reshape(6, 6)


def by_identifier(vehicle, duration, steps):
    time = np.linspace(0, duration, steps + 1)
    log = hd.Log.from_arrays(
        time, motion(time), attitude=np.zeros((steps + 1, 3)), wrench=wrench(time)
    )
    return hd.identify(
        hd.catalog["linear"], vehicle, log, hd.AdaptiveIdentifier(a=A, gamma=GAMMA)
    ).damping.matrix


def test_it_follows_equations_15_and_16_to_second_order(vehicle):
    """Halving the step quarters the distance to the continuous law."""
    exact = by_ode(vehicle, 4.0)
    coarse = np.abs(by_identifier(vehicle, 4.0, 400) - exact).max()
    fine = np.abs(by_identifier(vehicle, 4.0, 800) - exact).max()
    assert fine < 5e-3
    assert coarse / fine == pytest.approx(4.0, rel=0.1)
