"""Section IV of the paper: the adaptive identifier, equations 15, 16, 21 and 23."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import hydrodamp as hd
from hydrodamp.kernels import coriolis

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


def lyapunov(mass, error, distance):
    """Equation 21: V = 1/2 Dv' M Dv + 1/(2 gamma) tr(DK DK')."""
    return error @ mass @ error / 2 + np.trace(distance @ distance.T) / (2 * GAMMA)


@pytest.mark.parametrize("step", [0.01, 0.1, 1.0, 10.0])
def test_v_never_grows_where_the_data_satisfy_the_plant(step, vehicle):
    """Equation 23, in discrete time and at any step: V falls by h a |d|^2, d mid-step."""
    mass, truth = vehicle.mass_matrix, -np.diag([20.0, 60, 60, 2, 30, 30])
    time = np.arange(60) * step
    nu = motion(time)
    still = coriolis(mass, nu) + vehicle.restoring_wrench(np.tile([0, 0, 1.0], (60, 1)))
    rest = still + nu @ truth.T
    # The wrench that makes the mean of both ends accelerate the vehicle as recorded.
    needed = np.diff(nu, axis=0) @ mass / step - (rest[1:] + rest[:-1]) / 2
    force = np.zeros((60, 6))
    for k in range(59):
        force[k + 1] = 2 * needed[k] - force[k]
    log = hd.Log.from_arrays(
        time, nu, attitude=np.zeros((60, 3)), wrench=force, segment=["one"] * 60
    )
    model = hd.catalog["linear"]
    problem = hd.prepare(vehicle, log, model)
    history = hd.AdaptiveIdentifier(a=A, gamma=GAMMA).history(problem, model)
    errors = np.vstack([np.zeros(6), history.velocity_error])
    tables = [-np.eye(6), *history.coefficients.reshape(-1, 6, 6)]
    values = [lyapunov(mass, e, K - truth) for e, K in zip(errors, tables, strict=True)]
    middle = (errors[1:] + errors[:-1]) / 2
    fall = -step * A * np.sum(middle**2, axis=1)
    np.testing.assert_allclose(np.diff(values), fall, atol=1e-9 * values[0])
    assert values[-1] < values[0]
