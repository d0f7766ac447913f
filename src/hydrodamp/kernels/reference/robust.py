"""The robust adaptive identifier: gain matrices, leakage, dead zone and bounds.

With d the mid-step error, Gamma_i the gain matrix of axis i, xi_i its terms and
kappa_i its coefficients, one implicit midpoint step of length h solves::

    M (D_{k+1} - D_k)/h = f + K_mid xi - diag(a) d - M (nu_{k+1} - nu_k)/h
    (kappa_{k+1} - kappa_k)/h = -theta Gamma_i xi_i d_i - sigma (kappa_mid - rest)

and V = V_D + 1/2 sum E_i' Gamma_i^-1 E_i, with E = kappa - kappa_true, changes by
exactly -h theta (d'diag(a)d - d.eps) - h sigma sum (kappa_mid - rest)_i' Gamma_i^-1
E_mid,i: eq. 23 in discrete time for any gain matrices. V_D is half the square of what
|D|_M = sqrt(D'MD) has beyond the dead zone, and theta its discrete gradient: one far
outside the zone, zero within. The bounds are half-spaces; a projection on one in the
metric Gamma_i^-1 cannot raise V where the truth keeps them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.kernels.arguments import at_least, check_samples, matching, spans
from hydrodamp.kernels.fitting import fitting, steps_in
from hydrodamp.kernels.inputs import Inputs, Sample
from hydrodamp.kernels.plant import Plant
from hydrodamp.kernels.reference.identifier import Steps, part_of, steps_between, steps_of
from hydrodamp.kernels.robustness import Adapting, Robustness, RobustRun
from hydrodamp.kernels.track import Track

_SWEEPS = 8


def robust_step(
    plant: Plant,
    robustness: Robustness,
    adapting: Adapting,
    previous: Sample,
    current: Sample,
) -> Adapting:
    """Take the step from the previous sample to the current one.

    Parameters
    ----------
    plant : Plant
        Mass matrix, free axes, terms.
    robustness : Robustness
        Entries, gains and what makes them robust.
    adapting : Adapting
        Estimate so far; its velocity error is zero at a segment's first sample.
    previous, current : Sample
        The samples at both ends of the step.

    Returns
    -------
    adapting : Adapting
        The next, of new arrays.

    Raises
    ------
    ProblemError
        If a shape does not fit the plant.
    """
    fitting(plant, robustness.entries, adapting.coefficients)
    check_samples(plant, previous, current)
    return _midpoint(plant, robustness, adapting, steps_of(plant, previous, current), 0)


def robust_run(
    plant: Plant,
    robustness: Robustness,
    coefficients: FloatArray,
    inputs: Inputs,
    segments: IntArray,
    mean_from: int = 0,
    every: int = 0,
) -> RobustRun:
    """Run the robust identifier over a record: the fold of :func:`robust_step`.

    The velocity error starts at zero in every segment; the coefficients carry on.

    Parameters
    ----------
    plant : Plant
        Mass matrix, free axes, terms.
    robustness : Robustness
        Entries, gains and what makes them robust.
    coefficients : ndarray, shape (n,)
        To start from.
    inputs : Inputs
        The record.
    segments : ndarray of int64, shape (s, 2)
        First sample of each segment and the one after its last.
    mean_from : int, optional
        The mean over time begins with this step.
    every : int, optional
        Store the state after every so many steps; 0 stores nothing.

    Returns
    -------
    run : RobustRun
        Last state, and the track asked for with the velocity errors.

    Raises
    ------
    ProblemError
        If shapes do not agree, or a count is negative.
    """
    state = Adapting.at(fitting(plant, robustness.entries, coefficients))
    matching(plant, inputs)
    rows = spans(segments, inputs.n)
    at_least("mean_from", mean_from, 0)
    at_least("every", every, 0)
    track = Track.empty(steps_in(rows) // every if every else 0, robustness.entries.n)
    count = 0
    for start, stop in rows.tolist():
        steps = steps_between(plant, part_of(inputs, start, stop))
        state = Adapting(state.coefficients, np.zeros(6), state.total, state.duration)
        for k in range(stop - start - 1):
            if count == mean_from:
                zero = np.zeros_like(state.total)
                state = Adapting(state.coefficients, state.error, zero, 0.0)
            state = _midpoint(plant, robustness, state, steps, k)
            count += 1
            if every and count % every == 0:
                place = count // every - 1
                track.time[place] = inputs.time[start + k + 1]
                track.by_axis[place] = state.error
                track.coefficients[place] = state.coefficients
    return RobustRun(state, track)


@dataclass(frozen=True, eq=False)
class _Balance:
    """The 6 x 6 system for the mid-step error, but for theta."""

    mass: FloatArray
    left: FloatArray
    right: FloatArray
    stiffness: FloatArray
    error: FloatArray
    dead_zone: float

    def solved(self, theta: float) -> FloatArray:
        left = self.left + theta * np.diag(self.stiffness)
        return np.asarray(np.linalg.solve(left, self.right))

    def gap(self, theta: float) -> float:
        """Return the discrete gradient that this theta leads to, less theta."""
        before = _size(self.mass, self.error)
        after = _size(self.mass, 2.0 * self.solved(theta) - self.error)
        e, f = (max(size - self.dead_zone, 0.0) for size in (before, after))
        if after == before or (e > 0.0 and f > 0.0):
            slope = float(after > self.dead_zone)
        else:
            slope = (f - e) / (after - before)
        return (slope * (e + f) / (after + before) if after + before > 0.0 else 0.0) - theta

    def settled(self) -> tuple[float, FloatArray]:
        """Return theta and the error that belong to each other."""
        if self.dead_zone == 0.0:
            theta = 1.0
        elif not self.gap(0.0) > 0.0:
            theta = 0.0
        else:
            from scipy.optimize import brentq  # takes long to import

            theta = 1.0 if self.gap(1.0) >= 0.0 else float(brentq(self.gap, 0.0, 1.0, xtol=1e-16))
        return theta, self.solved(theta)


def _size(mass: FloatArray, error: FloatArray) -> float:
    return float(np.sqrt(error @ mass @ error))


def _midpoint(
    plant: Plant, robustness: Robustness, state: Adapting, steps: Steps, k: int
) -> Adapting:
    h, xi, entries = float(steps.h[k]), steps.xi[k], robustness.entries
    leak = h * robustness.leakage
    keep = 1.0 / (1.0 + leak / 2.0)
    terms = xi[entries.rows]
    gains = entries.squares(robustness.gains)
    reach = np.concatenate([gain @ terms[entries.of(i)] for i, gain in enumerate(gains)])
    resting = keep * (state.coefficients + leak / 2.0 * robustness.led_to)
    force = xi @ entries.known + np.bincount(entries.axes, resting * terms, minlength=6)
    stiffness = np.bincount(entries.axes, reach * terms, minlength=6)
    left = 2.0 / h * plant.mass_matrix + np.diag(robustness.a)
    right = 2.0 / h * (plant.mass_matrix @ state.error) + steps.forcing[k] - steps.gain[k] / h
    both_free = np.logical_and.outer(plant.free, plant.free)
    balance = _Balance(
        mass=plant.mass_matrix,
        left=np.where(both_free, left, np.eye(6)),
        right=np.where(plant.free, right + force, 0.0),
        stiffness=np.where(plant.free, 0.5 * h * keep * stiffness, 0.0),
        error=state.error,
        dead_zone=robustness.dead_zone,
    )
    theta, d = balance.settled()
    push = h * theta * d[entries.axes] * reach
    moved = state.coefficients - keep * (push + leak * (state.coefficients - robustness.led_to))
    estimate = _bounded(robustness, gains, moved)
    total, duration = state.total + h * estimate, state.duration + h
    return Adapting(estimate, 2.0 * d - state.error, total, duration)


def _bounded(robustness: Robustness, gains: list[FloatArray], found: FloatArray) -> FloatArray:
    """Project on one violated half-space after the other, in the metric of the gains."""
    estimate, (lower, upper) = found.copy(), robustness.bounds
    for axis, gain in enumerate(gains):
        part = robustness.entries.of(axis)
        for _ in range(_SWEEPS):
            moved = False
            for j in range(len(gain)):
                value = estimate[part][j]
                wanted = min(max(value, lower[part][j]), upper[part][j])
                if wanted != value and gain[j, j] > 0.0:
                    estimate[part] += gain[j] * (wanted - value) / gain[j, j]
                    estimate[part.start + j] = wanted
                    moved = True
            if not moved:
                break
    return estimate
