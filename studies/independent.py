"""Equation error and output error of a tanker with NumPy and SciPy alone: nothing of hydrodamp.

    python studies/independent.py LOG.csv > RESULT.json

With M = [[m + A_X, 0, 0], [0, m + A_Y, m x_G], [0, m x_G, I_z + m x_G² + A_N]], p = M ν and
ν = (u, v, r), the motion is M ν' + (-p_v r, p_u r, u p_v - v p_u) = Σ terms. Equation error: least
squares of each axis with central differences of ν. Output error: Runge-Kutta runs with held
inputs from free initial states, residuals over their standard deviations until these settle.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

MASS, X_G, I_Z = 3272.0, 0.2436, 9909.0
ADDED = 245.2, 2485.9, 6008.5
M = np.diag([MASS + ADDED[0], MASS + ADDED[1], I_Z + MASS * X_G**2 + ADDED[2]])
M[1, 2] = M[2, 1] = MASS * X_G
INVERSE = np.linalg.inv(M)
SURGE = ["u^2", "v^2", "r^2", "vr", "thrust", "u^2*rudder^2"]
SWAY = ["uv", "ur", "v|v|", "r|r|", "v|r|", "r|v|", "u^2*rudder", "u^2"]
LABELS = [
    f"{axis}_{term}"
    for axis, terms in zip("XYN", (SURGE, SWAY, SWAY), strict=True)
    for term in terms
]
N_ROUNDS = 4

Array = npt.NDArray[np.float64]
Run = tuple[Array, Array, Array]
"""Times (n,), velocities (n, 3) and inputs (n, 2)."""


def terms(
    u: Array, v: Array, r: Array, thrust: Array, rudder: Array
) -> tuple[list[Array], list[Array]]:
    """Return the columns of surge, and those of sway and yaw."""
    surge = [u * u, v * v, r * r, v * r, thrust, (u * rudder) ** 2]
    absolute = abs(v), abs(r)
    lift = [u * v, u * r, v * absolute[0], r * absolute[1], v * absolute[1], r * absolute[0]]
    return surge, [*lift, u * u * rudder, u * u]


def moving_frame(u: Array, v: Array, r: Array) -> tuple[Array, Array, Array]:
    """Return the force of the moving frame on the left side."""
    surge, sway = M[0, 0] * u, M[1, 1] * v + M[1, 2] * r
    return -sway * r, surge * r, u * sway - v * surge


def equation_error(runs: Sequence[Run]) -> tuple[Array, Array]:
    """Return coefficients and standard errors of least squares."""
    designs: list[list[Array]] = [[], [], []]
    targets: list[list[Array]] = [[], [], []]
    for time, motion, inputs in runs:
        rate = np.gradient(motion, time, axis=0)
        force = rate @ M.T + np.column_stack(moving_frame(*motion.T))
        surge, sway = (np.column_stack(each) for each in terms(*motion.T, *inputs.T))
        for axis, design in enumerate((surge, sway, sway)):
            designs[axis].append(design[1:-1])
            targets[axis].append(force[1:-1, axis])
    values, errors = [], []
    for design, target in zip(map(np.vstack, designs), map(np.concatenate, targets), strict=True):
        found = np.linalg.lstsq(design, target, rcond=None)[0]
        variance = np.sum((target - design @ found) ** 2) / (len(target) - len(found))
        values.append(found)
        errors.append(np.sqrt(variance * np.diag(np.linalg.inv(design.T @ design))))
    return np.concatenate(values), np.concatenate(errors)


def simulate(coefficients: Array, initial: Array, runs: Sequence[Run]) -> Array:
    """Return the velocities (samples, 3, n) of n sets of coefficients (22, n), run after run."""
    surge_k, sway_k, yaw_k = np.split(coefficients, [len(SURGE), len(SURGE) + len(SWAY)])
    state = initial.reshape(len(runs), 3, -1).transpose(1, 0, 2)
    n_steps = max(len(time) for time, _, _ in runs)
    steps, held = np.ones((n_steps, len(runs), 1)), np.zeros((n_steps, 2, len(runs), 1))
    for index, (time, _, inputs) in enumerate(runs):
        steps[: len(time) - 1, index, 0] = np.diff(time)
        held[: len(time), :, index, 0] = inputs

    def rate(state: Array, inputs: Array) -> Array:
        surge, sway = terms(*state, *inputs)
        totals = [
            sum(k * x for k, x in zip(row, columns, strict=True))
            for row, columns in ((surge_k, surge), (sway_k, sway), (yaw_k, sway))
        ]
        force = np.array(totals) - np.array(moving_frame(*state))
        return np.tensordot(INVERSE, force, 1)

    states = []
    for step, now in zip(steps, held, strict=True):
        states.append(state)
        first = rate(state, now)
        second = rate(state + 0.5 * step * first, now)
        third = rate(state + 0.5 * step * second, now)
        last = rate(state + step * third, now)
        state = state + step / 6.0 * (first + 2.0 * second + 2.0 * third + last)
    whole = np.array(states)
    return np.concatenate([whole[: len(each[0]), :, k] for k, each in enumerate(runs)])


def output_error(runs: Sequence[Run], start: Array) -> tuple[Array, Array]:
    """Return coefficients and standard errors of the least simulation error."""
    measured = np.vstack([motion for _, motion, _ in runs])
    scale = np.concatenate([np.abs(start), np.full(3 * len(runs), 0.1)])
    x = np.concatenate([start, *(motion[0] for _, motion, _ in runs)]) / scale
    std = measured.std(axis=0)

    def residuals(x: Array) -> Array:
        sets = (np.atleast_2d(x) * scale).T
        with np.errstate(all="ignore"):
            found = simulate(sets[: len(start)], sets[len(start) :], runs)
        found = np.nan_to_num(found, nan=1e3, posinf=1e3, neginf=-1e3)
        difference = (measured[:, :, None] - found) / std[None, :, None]
        return np.asarray(difference.reshape(-1, sets.shape[1]))

    def residual(x: Array) -> Array:
        return residuals(x)[:, 0]

    def jacobian(x: Array) -> Array:
        step = 1e-6
        moved = residuals(np.vstack([x + step * np.eye(len(x)), x - step * np.eye(len(x))]))
        return (moved[:, : len(x)] - moved[:, len(x) :]) / (2.0 * step)

    for _ in range(N_ROUNDS):
        result = least_squares(residual, x, jacobian, method="lm", max_nfev=30)
        x = result.x
        std = std * np.sqrt(np.mean(result.fun.reshape(-1, 3) ** 2, axis=0))
    covariance = np.linalg.inv(jacobian(x).T @ jacobian(x))
    values, errors = x * scale, np.sqrt(np.diag(covariance)) * scale
    return values[: len(start)], errors[: len(start)]


def main(path: str) -> None:
    """Print the coefficients and standard errors of a canonical log."""
    table = np.genfromtxt(path, delimiter=",", names=True, dtype=None, encoding="utf-8")
    motion = np.column_stack([table[name] for name in "uvr"])
    inputs = np.column_stack([table["thrust"], table["rudder"]])
    parts = [np.flatnonzero(table["segment"] == each) for each in np.unique(table["segment"])]
    runs = [(table["time"][part], motion[part], inputs[part]) for part in parts]
    first = equation_error(runs)
    results = {"equation error": first, "output error": output_error(runs, first[0])}
    pairs = {name: [each.tolist() for each in pair] for name, pair in results.items()}
    json.dump({"labels": LABELS, **pairs}, sys.stdout)


if __name__ == "__main__":
    main(sys.argv[1])
