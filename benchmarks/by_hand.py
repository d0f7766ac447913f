"""Equation 1 as one writes it in NumPy for oneself, sample by sample.

Nothing here comes from the package: it is the other side of the ratios, and a
second opinion on the results.
"""

from __future__ import annotations

import numpy as np

FIRST = np.array([0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 3, 3, 4])
SECOND = np.array([1, 2, 3, 4, 5, 3, 4, 5, 2, 3, 4, 5, 4, 5, 5])


def terms(velocity: np.ndarray, propulsion_speed: float) -> np.ndarray:
    """All 85 terms of the eight models, in the paper's order."""
    u, v, w, _, q, r = velocity
    absolute = np.abs(velocity)
    crossflow = np.hypot(v, w)
    excess = propulsion_speed / max(np.linalg.norm(velocity[:3]), 1e-6) - 1.0
    sway_first, heave_first = np.sign(v) * crossflow, np.sign(w) * crossflow
    return np.concatenate(
        [
            velocity,
            velocity**2,
            absolute,
            np.outer(velocity, absolute).ravel(),
            velocity[FIRST] * velocity[SECOND],
            [v * crossflow, w * crossflow, q * crossflow, r * crossflow],
            [abs(w) * crossflow, abs(r) * sway_first, abs(q) * heave_first],
            np.array([u * u, v * v, w * w, u * v, u * w, u * q, u * r]) * excess,
            np.array([v * crossflow, w * crossflow]) * excess,
        ]
    )


def moving_frame(mass: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """H(M nu) nu."""
    p = mass @ velocity
    force = np.cross(p[:3], velocity[3:])
    moment = np.cross(p[:3], velocity[:3]) + np.cross(p[3:], velocity[3:])
    return np.concatenate([force, moment])


def restoring(vehicle, down: np.ndarray) -> np.ndarray:
    """Weight and buoyancy along the world's downward direction in the body."""
    arm = vehicle.weight * np.array(vehicle.center_of_gravity)
    arm = arm - vehicle.buoyancy * np.array(vehicle.center_of_buoyancy)
    return np.concatenate([(vehicle.weight - vehicle.buoyancy) * down, np.cross(arm, down)])


def known(vehicle, inputs, k: int) -> np.ndarray:
    """H(M nu) nu + G + u at sample k."""
    gyroscopic = moving_frame(vehicle.mass_matrix, inputs.velocity[k])
    return gyroscopic + restoring(vehicle, inputs.down[k]) + inputs.wrench[k]


def midpoint(mass, a, gamma, table, error, h, xi, forcing, change):
    """One implicit midpoint step of equations 15 and 16; ``table`` is moved in place."""
    left = 2.0 / h * mass + np.diag(a + 0.5 * h * gamma * (xi @ xi) * np.ones(6))
    right = 2.0 / h * (mass @ error) + forcing + table @ xi - mass @ change / h
    d = np.linalg.solve(left, right)
    table -= h * gamma * np.outer(d, xi)
    return 2.0 * d - error


def identify(vehicle, inputs, a: float, gamma: float, table: np.ndarray, n: int) -> np.ndarray:
    """The adaptive identifier as on-line code has it: a step takes two samples."""
    table, error = table.copy(), np.zeros(6)
    for k in range(n - 1):
        first = terms(inputs.velocity[k], inputs.propulsion[k, 0])
        last = terms(inputs.velocity[k + 1], inputs.propulsion[k + 1, 1])
        forcing = 0.5 * (known(vehicle, inputs, k) + known(vehicle, inputs, k + 1))
        change = inputs.velocity[k + 1] - inputs.velocity[k]
        h = inputs.time[k + 1] - inputs.time[k]
        xi = 0.5 * (first + last)
        error = midpoint(vehicle.mass_matrix, a, gamma, table, error, h, xi, forcing, change)
    return table


def identify_prepared(vehicle, inputs, a, gamma, table, xi, forcing):
    """The same off-line, all that does not depend on the estimate made beforehand."""
    table, error = table.copy(), np.zeros(6)
    steps, changes = np.diff(inputs.time).tolist(), np.diff(inputs.velocity, axis=0)
    for k in range(len(xi)):
        error = midpoint(
            vehicle.mass_matrix, a, gamma, table, error, steps[k], xi[k], forcing[k], changes[k]
        )
    return table


def right_hand_side(vehicle, inputs, table: np.ndarray):
    """Return nu' = f(t, nu): wrench and attitude interpolated, the propeller held."""
    inverse, last = np.linalg.inv(vehicle.mass_matrix), len(inputs.time) - 2

    def rate(t: float, velocity: np.ndarray) -> np.ndarray:
        k = min(int(np.searchsorted(inputs.time, t, side="right")) - 1, last)
        fraction = (t - inputs.time[k]) / (inputs.time[k + 1] - inputs.time[k])
        wrench = inputs.wrench[k] + fraction * (inputs.wrench[k + 1] - inputs.wrench[k])
        down = inputs.down[k] + fraction * (inputs.down[k + 1] - inputs.down[k])
        damping = table @ terms(velocity, inputs.propulsion[k, 0])
        gyroscopic = moving_frame(vehicle.mass_matrix, velocity)
        return inverse @ (gyroscopic + restoring(vehicle, down) + damping + wrench)

    return rate
