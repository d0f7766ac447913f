"""Equation 1 of the current as rows of least squares: the way through the water, then c."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.data.attitude import euler_from_quaternion, rotation
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError

#: What the drift of a current is counted over [s].
TEN_MINUTES = 600.0

_UNDER_WAY = 0.5  # of the median surge
_LIKELY = 1.0  # m/s, a priori standard deviation of the current
_SLOWEST = 1e-4  # m/s; no Doppler log is better
_SIDESLIP = 0.03  # of the median surge, a priori standard deviation of the steady drift
_LONGEST = 40000  # samples; more are thinned out
_LEAST = 10  # samples
_MOST_KNOTS = 1000


@dataclass(frozen=True, eq=False)
class Design:
    """Surge, then sway of all samples, as a matrix times what is unknown."""

    matrix: sparse.csr_array
    n_way: int
    sideslip: int


def under_way(log: Log) -> IntArray:
    """Return the samples at which the vehicle makes way."""
    usual = float(np.median(log.velocity[:, 0]))
    rows = np.flatnonzero(log.velocity[:, 0] > _UNDER_WAY * usual)
    if usual < _SLOWEST or len(rows) < _LEAST:
        fault = f"the vehicle is not under way: its median surge is {usual:.3g} m/s"
        raise LogError(fault, source=log.source)
    return rows[:: -(-len(rows) // _LONGEST)]


def placed_knots(log: Log, spacing: float) -> FloatArray:
    """Return the times between which the current is linear."""
    if not np.isfinite(spacing):
        return np.zeros(1)
    count = max(1, round(log.elapsed[-1] / spacing))
    place = log.elapsed * (count / log.elapsed[-1])
    near = np.union1d(np.floor(place), np.minimum(np.ceil(place), count))
    if len(near) > _MOST_KNOTS:
        fault = (
            f"a `spacing` of {spacing:g} s makes {len(near)} knots; at most {_MOST_KNOTS} will do"
        )
        raise LogError(fault, source=log.source)
    return np.asarray(near * (log.elapsed[-1] / count))


def way_and_current(
    log: Log, rows: IntArray, knots: FloatArray, commands: Sequence[str] | None
) -> Design:
    """Return the matrix of equation 1."""
    surge, drift = _way(log, rows, commands)
    way = sparse.csr_array(sparse.block_diag([surge, drift]))
    matrix = sparse.csr_array(sparse.hstack([way, _seen(log, rows, knots)]))
    return Design(matrix, way.shape[1], surge.shape[1])


def turned(attitude: FloatArray) -> float:
    """Return how far headings differ."""
    yaw = euler_from_quaternion(attitude)[:, 2]
    return float(1.0 - np.abs(np.exp(1j * yaw).mean()))


def beforehand(design: Design, knots: FloatArray, surge: float, drift: float) -> FloatArray:
    """Return what is known before the log is read, as information."""
    k = len(knots)
    information = np.zeros((design.n_way + 2 * k,) * 2)
    information[: design.n_way, : design.n_way] = np.eye(design.n_way) / surge**2
    information[design.sideslip, design.sideslip] = (_SIDESLIP * surge) ** -2
    walk = np.zeros((k, k))
    walk[0, 0] = _LIKELY**-2
    if k > 1:
        step = np.diff(np.eye(k), axis=0)
        walk += step.T @ (step / (drift**2 * np.diff(knots) / TEN_MINUTES)[:, np.newaxis])
    for first in (design.n_way, design.n_way + k):
        information[first : first + k, first : first + k] = walk
    return information


def _way(log: Log, rows: IntArray, commands: Sequence[str] | None) -> tuple[FloatArray, FloatArray]:
    """Return what surge and drift through the water may depend on, as columns."""
    names = log.command_names if commands is None else commands
    surge, drift = [np.ones(len(rows))], [np.ones(len(rows))]
    for values in (log.command(name)[rows] for name in names):
        if np.ptp(values) > 0:
            scaled = (values - values.mean()) / values.std()
            surge += [scaled, scaled**2]
            drift += [scaled]
    turning = log.velocity[rows, 5]
    if turning.any():
        scaled = turning / np.abs(turning).max()
        surge.append(scaled**2)
        drift.append(scaled)
    return np.column_stack(surge), np.column_stack(drift)


def _seen(log: Log, rows: IntArray, knots: FloatArray) -> sparse.sparray:
    """Return the current of each knot as surge and sway see it."""
    assert log.attitude is not None
    world = rotation(log.attitude[rows])  # world = R body
    share = _hats(log.elapsed[rows], knots)
    blocks = [
        [share * world[:, towards, axis][:, np.newaxis] for towards in (0, 1)] for axis in (0, 1)
    ]
    return sparse.block_array(blocks, format="csr")


def _hats(time: FloatArray, knots: FloatArray) -> sparse.csr_array:
    """Return the weights of linear interpolation, one row a time."""
    n, k = len(time), len(knots)
    if k == 1:
        return sparse.csr_array(np.ones((n, 1)))
    left = np.clip(np.searchsorted(knots, time, side="right") - 1, 0, k - 2)
    right = (time - knots[left]) / (knots[left + 1] - knots[left])
    index = np.arange(n)
    return sparse.csr_array(
        (
            np.concatenate((1 - right, right)),
            (np.concatenate((index, index)), np.concatenate((left, left + 1))),
        ),
        shape=(n, k),
    )
