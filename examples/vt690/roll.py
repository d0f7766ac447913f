"""The field log as prepared: cleaned, with roll from the mixing of the fins, without the current.

The autopilot of the 690 mixes the demanded elevator and rudder by the roll angle phi:

    elevator = cos(phi) d_e - sin(phi) d_r,    rudder = sin(phi) d_e - cos(phi) d_r.    (1)

Roll is the angle of least |fins - mixing(phi) demand|² over half a second. The signs were found by
regression on the field log of July 2022, where equation 1 holds in all samples.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

import hydrodamp as hd
from hydrodamp.conditioning.current import subtract_current
from hydrodamp.data.attitude import euler_from_quaternion, quaternion_from_euler

HERE = Path(__file__).parent
WINDOW = 0.5
"""Seconds over which the roll is constant."""

MAX_ROLL = np.radians(60.0)
"""Larger rolls do not occur under way."""

MAX_ERROR, ROUNDING = 0.02, 2e-4
"""Where equation 1 does not hold, a fin is at its stop: error relative to the demand, and [rad]."""

MIN_SENSITIVITY = 5e-3
"""Radians of fin per radian of roll; less does not determine the roll."""

N_STEPS = 4
"""Steps of Newton's method."""


def read_field_log(folder: Path) -> hd.Log:
    """Return the log of a folder of .dat files, prepared."""
    log = roll_from_mixing(hd.read_log(folder, HERE / "mapping.yaml"))
    return subtract_current(hd.rates_from_attitude(log))


def roll_from_mixing(log: hd.Log) -> hd.Log:
    """Return a log whose roll is that of the mixing, interpolated where it is not determined."""
    demand, fins = (
        np.column_stack([log.command(name) for name in names])
        for names in (("elevator_loop", "rudder_loop"), ("elevator", "rudder"))
    )
    sums = products(demand, fins)
    angle = least_angle(sums)
    residual = np.sqrt(np.maximum(distance(sums, angle)[0] + np.sum(fins**2, axis=1), 0.0))
    holds = residual <= MAX_ERROR * np.linalg.norm(demand, axis=1) + ROUNDING
    holds &= distance(sums, angle)[2] > MIN_SENSITIVITY**2
    sums[~holds] = 0.0
    euler = euler_from_quaternion(log.attitude)
    for start, stop in log.bounds.tolist():
        time = log.time[start:stop]
        total = windowed_sum(time, sums[start:stop])
        angle = least_angle(total)
        known = distance(total, angle)[2] > MIN_SENSITIVITY**2
        euler[start:stop, 0] = np.interp(time, time[known], np.unwrap(angle[known]))
    note = f"derived: roll from the mixing of the fins; interpolated in {(~holds).sum()} samples"
    return replace(log, attitude=quaternion_from_euler(euler)).with_notes(note)


def products(demand: np.ndarray, fins: np.ndarray) -> np.ndarray:
    """Return the inner products of the squared residual of equation 1, shape (n, 5)."""
    along, across = demand * (1.0, -1.0), demand[:, ::-1] * (-1.0, 1.0)
    pairs = (fins, along), (fins, across), (along, along), (along, across), (across, across)
    return np.column_stack([np.sum(a * b, axis=1) for a, b in pairs])


def distance(sums: np.ndarray, roll: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the squared residual less |fins|², and half its first and second derivative."""
    c, s = np.cos(roll), np.sin(roll)
    along, across, first, both, second = sums.T
    size = c * c * first + 2.0 * c * s * both + s * s * second
    slope = c * s * (second - first) + (c * c - s * s) * both + s * along - c * across
    bend = (c * c - s * s) * (second - first) - 4.0 * c * s * both + c * along + s * across
    return size - 2.0 * (c * along + s * across), slope, bend


def least_angle(sums: np.ndarray) -> np.ndarray:
    """Return the angle of least residual, from the best of 25."""
    starts = np.linspace(-MAX_ROLL, MAX_ROLL, 25)
    sizes = [distance(sums, np.full(len(sums), start))[0] for start in starts]
    roll = starts[np.argmin(sizes, axis=0)]
    for _ in range(N_STEPS):
        _, slope, bend = distance(sums, roll)
        roll -= np.clip(np.divide(slope, bend, out=np.zeros_like(roll), where=bend > 0), -0.2, 0.2)
    return np.clip(roll, -MAX_ROLL, MAX_ROLL)


def windowed_sum(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Sum values over the window around each sample."""
    first, last = (np.searchsorted(time, time + sign * (WINDOW / 2 + 1e-9)) for sign in (-1, 1))
    total = np.concatenate((np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)))
    return total[last] - total[first]
