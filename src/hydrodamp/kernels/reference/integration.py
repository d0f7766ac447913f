"""Replay: eq. 1 integrated by RK4 between samples, open loop, segment by segment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.kernels.arguments import coefficients, floats, matching, positive, spans
from hydrodamp.kernels.inputs import Inputs
from hydrodamp.kernels.plant import Plant
from hydrodamp.kernels.reference.motion import wrench_of

SLACK = 1e-6
"""How much longer than ``max_step`` a sub-step may be, relative: clocks round."""


@dataclass(frozen=True, eq=False)
class Interval:
    """The inputs between sample k and the next: interpolated or held.

    Parameters
    ----------
    inputs : Inputs
        What was recorded.
    k : int
        The sample the interval begins at.
    """

    inputs: Inputs
    k: int

    @property
    def length(self) -> float:
        """Return its duration [s]."""
        return float(self.inputs.time[self.k + 1] - self.inputs.time[self.k])

    def steps(self, max_step: float) -> int:
        """Return the number of equal sub-steps that keeps each below ``max_step``."""
        ratio = self.length / max_step * (1.0 - SLACK)
        return int(np.ceil(ratio)) if ratio > 1.0 else 1

    def wrench(self, fraction: float) -> FloatArray:
        """Return the recorded wrench, interpolated linearly [N, N m]."""
        ends = self.inputs.wrench[self.k : self.k + 2]
        blend: FloatArray = ends[0] + fraction * (ends[1] - ends[0])
        return blend

    def down(self, fraction: float) -> FloatArray:
        """Return the recorded down vector, interpolated linearly."""
        ends = self.inputs.down[self.k : self.k + 2]
        blend: FloatArray = ends[0] + fraction * (ends[1] - ends[0])
        return blend


def replay(
    plant: Plant,
    matrix: FloatArray,
    inputs: Inputs,
    segments: IntArray,
    attitude: FloatArray | None = None,
    max_step: float = 0.05,
    limit: float = 50.0,
) -> tuple[FloatArray, IntArray]:
    """Integrate eq. 1 open loop from the first sample of every segment.

    RK4 with equal sub-steps between samples. The wrench and the recorded down
    vector are interpolated linearly, channels and u_c are held.

    Parameters
    ----------
    plant : Plant
        Mass matrix, free axes, terms.
    matrix : ndarray, shape (n_terms, 6)
        Coefficients, one row a term; the transpose of the paper's K.
    inputs : Inputs
        Recorded motion (its first sample of each segment) and actuation.
    segments : ndarray of int64, shape (s, 2)
        First sample of each segment and the one after its last.
    attitude : ndarray, shape (n, 4), optional
        Recorded unit quaternions w x y z, body to world. Given: the attitude
        is integrated too, from the first sample of each segment. None: gravity
        acts along the recorded down vector.
    max_step : float, optional
        No sub-step is longer [s].
    limit : float, optional
        A segment with a velocity component beyond it, or not finite, has diverged.

    Returns
    -------
    velocity : ndarray, shape (n, 6)
        Simulated velocity; NaN from where a segment diverged on and outside
        all segments.
    diverged_at : ndarray of int64, shape (s,)
        The first bad sample of each segment, or -1.

    Raises
    ------
    ProblemError
        If shapes do not agree, or a setting is not positive.

    Examples
    --------
    >>> plant = Plant(np.eye(6), [True] * 6, [[1, 0, 0, 0]], 0)
    >>> decay = np.array([[-1.0, 0, 0, 0, 0, 0]])
    >>> rest = [np.zeros((2, width)) for width in (3, 6, 0, 2)]
    >>> inputs = Inputs([0.0, 1.0], [[1.0, 0, 0, 0, 0, 0]] * 2, *rest)
    >>> velocity, _ = replay(plant, decay, inputs, np.array([[0, 2]]))
    >>> round(float(velocity[1, 0]), 5)
    0.36788
    """
    table = coefficients(plant, matrix)
    matching(plant, inputs)
    rows = spans(segments, inputs.n)
    poses = None if attitude is None else floats(attitude, (inputs.n, 4), "attitude")
    positive(max_step, "max_step")
    positive(limit, "limit")
    velocity = np.full((inputs.n, 6), np.nan)
    diverged_at = np.full(len(rows), -1, dtype=np.int64)
    with np.errstate(all="ignore"):
        for s, (start, stop) in enumerate(rows.tolist()):
            state = initial_state(plant, inputs, poses, start)
            for k in range(start, stop):
                if k > start:
                    state = cross_interval(plant, table, Interval(inputs, k - 1), state, max_step)
                if not np.all(np.abs(state[:6]) <= limit):
                    diverged_at[s] = k
                    break
                velocity[k] = state[:6]
    return velocity, diverged_at


def initial_state(
    plant: Plant, inputs: Inputs, attitude: FloatArray | None, start: int
) -> FloatArray:
    """Return the recorded state at a segment's first sample, locked velocities zero.

    Parameters
    ----------
    plant : Plant
        Whose free axes move.
    inputs : Inputs
        Recorded velocity.
    attitude : ndarray, shape (n, 4), or None
        Recorded quaternions.
    start : int
        The sample.

    Returns
    -------
    state : ndarray, shape (6,) or (10,)
        Velocity and, where there is one, the unit quaternion.
    """
    nu = np.where(plant.free, inputs.velocity[start], 0.0)
    if attitude is None:
        return nu
    return np.concatenate([nu, attitude[start] / np.linalg.norm(attitude[start])])


def cross_interval(
    plant: Plant, matrix: FloatArray, interval: Interval, state: FloatArray, max_step: float
) -> FloatArray:
    """Integrate the state from one sample to the next.

    Parameters
    ----------
    plant : Plant
        Mass matrix, free axes, terms.
    matrix : ndarray, shape (n_terms, 6)
        Coefficients.
    interval : Interval
        The inputs between the samples.
    state : ndarray, shape (6,) or (10,)
        Velocity and quaternion at the first.
    max_step : float
        No sub-step is longer [s].

    Returns
    -------
    state : ndarray, same shape
        At the second.
    """
    n = interval.steps(max_step)
    h = interval.length / n
    inverse_mass = np.asarray(np.linalg.inv(plant.effective_mass), dtype=np.float64)

    def rate(state: FloatArray, fraction: float) -> FloatArray:
        return state_rate(plant, inverse_mass, matrix, interval, state, fraction)

    for i in range(n):
        k1 = rate(state, i / n)
        k2 = rate(state + 0.5 * h * k1, (i + 0.5) / n)
        k3 = rate(state + 0.5 * h * k2, (i + 0.5) / n)
        k4 = rate(state + h * k3, (i + 1) / n)
        state = state + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        if len(state) == 10:
            state[6:] /= np.linalg.norm(state[6:])
    return state


def state_rate(
    plant: Plant,
    inverse_mass: FloatArray,
    matrix: FloatArray,
    interval: Interval,
    state: FloatArray,
    fraction: float,
) -> FloatArray:
    """Return the derivative of velocity and quaternion at a fraction of an interval.

    Parameters
    ----------
    plant : Plant
        Mass matrix, free axes, terms.
    inverse_mass : ndarray, shape (6, 6)
        Of the effective mass.
    matrix : ndarray, shape (n_terms, 6)
        Coefficients.
    interval : Interval
        The inputs between two samples.
    state : ndarray, shape (6,) or (10,)
        Velocity and, where simulated, quaternion.
    fraction : float
        0 at the interval's first sample, 1 at its second.

    Returns
    -------
    rate : ndarray, same shape
        [m/s^2, rad/s^2, 1/s].
    """
    nu, q = state[:6], state[6:]
    down = down_of(q) if len(q) else interval.down(fraction)
    held = interval.inputs.channels[interval.k]
    speed = float(interval.inputs.propulsion[interval.k, 0])
    total = wrench_of(plant, matrix, nu, down, interval.wrench(fraction), held, speed)
    accelerated: FloatArray = inverse_mass @ total
    if not len(q):
        return accelerated
    return np.concatenate([accelerated, quaternion_rate(q, nu[3:])])


def down_of(q: FloatArray) -> FloatArray:
    """Return the world's down direction in the body frame, R(q)^T e3.

    Parameters
    ----------
    q : ndarray, shape (4,)
        Quaternion w x y z, body to world.

    Returns
    -------
    down : ndarray, shape (3,)
        A unit vector where q has unit length.

    Examples
    --------
    >>> down_of(np.array([1.0, 0.0, 0.0, 0.0]))
    array([0., 0., 1.])
    """
    w, x, y, z = q
    return np.array([2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z])


def quaternion_rate(q: FloatArray, omega: FloatArray) -> FloatArray:
    """Return dq/dt = 1/2 q x (0, omega).

    Parameters
    ----------
    q : ndarray, shape (4,)
        Quaternion w x y z, body to world.
    omega : ndarray, shape (3,)
        p q r [rad/s], body frame.

    Returns
    -------
    rate : ndarray, shape (4,)
        [1/s].
    """
    return 0.5 * quaternion_columns(q) @ omega


def quaternion_columns(q: FloatArray) -> FloatArray:
    """Return twice the derivative of dq/dt on the body rates.

    Parameters
    ----------
    q : ndarray, shape (4,)
        Quaternion w x y z, body to world.

    Returns
    -------
    columns : ndarray, shape (4, 3)
        The products of q with the three imaginary units.
    """
    w, x, y, z = q
    return np.array([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]])
