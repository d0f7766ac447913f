"""Weak-form regression: integrals of equation 3 against test functions replace derivatives.

With bump functions ``φ(s) = (1 − s²)²`` of one support, each row is the weighted mean of the
equation of motion, ``∫φ (Mν̇ − known) dt = K ∫φ ξ(ν) dt`` with ``∫φ ν̇ = −∫φ̇ ν``. The shortest
support for which white noise is a small share of the weighted acceleration is selected.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.data.time_scale import motion_time_scale
from hydrodamp.errors import MethodError, demand
from hydrodamp.identification.differentiation import (
    SMOOTHING_WINDOWS,
    median_step,
    signal_to_noise,
    smooth_velocity,
)
from hydrodamp.identification.regression import Rows
from hydrodamp.kernels import core
from hydrodamp.simulation.problem import Problem

# Steps in a chunk: they fit the processor cache.
_CHUNK_STEPS = 4096

# Excess of the support over a segment [1] that counts as rounding.
_SUPPORT_TOLERANCE = 1e-9

# Share of noise [1] in the mean square weighted acceleration, averaged over the velocities: noise
# then adds about 5 % to its RMS. Tuned on the re-enacted campaign, where shares from 0.2 to 0.02
# give supports of 1 to 2.8 s: shorter ones expose large models to noise, longer ones increase the
# replay error of small models.
_MAX_NOISE_SHARE = 0.1

# Ratio of variances [1] above which a velocity is more than noise.
_MIN_SIGNAL_TO_NOISE = 2.0

# Trial supports: shortest one [steps], supports in a segment of mean length at least, supports per
# octave, and test functions that overlap at an instant.
_MIN_SUPPORT_STEPS, _SUPPORTS_PER_SEGMENT, _SUPPORTS_PER_OCTAVE, _TRIAL_OVERLAP = 4, 4.0, 4, 2


@dataclass(frozen=True)
class WeakRegression:
    """Weak-form regression with one row for each test function.

    Parameters
    ----------
    support : float, optional
        Length of a test function [s]; by default the shortest with a small share of noise.
        Segments shorter than that give no rows.
    overlap : int
        Test functions that overlap at an instant. More than four add no information.
    windows : tuple of int
        Odd lengths [samples] of local quadratics that smooth each velocity before terms are
        evaluated; the one of the least estimated risk is selected. ``()`` evaluates terms at
        measured velocities. The momentum is always the measured one.

    Raises
    ------
    MethodError
        If the support is not positive, the overlap less than one, a window even or under
        three, or (in ``rows``) no segment as long as the given support.

    Examples
    --------
    >>> WeakRegression(support=1.5)
    WeakRegression(support=1.5, overlap=4, windows=(5, 7, 9, 11, 15, 21, 31))
    """

    support: float | None = None
    overlap: int = 4
    windows: tuple[int, ...] = SMOOTHING_WINDOWS

    def __post_init__(self) -> None:
        """Check the settings."""
        positive = self.support is None or 0.0 < self.support < np.inf
        demand(positive, "support", "positive [s]", self.support)
        demand(self.overlap >= 1, "overlap", "at least 1", self.overlap)
        odd = all(window >= 3 and window % 2 for window in self.windows)
        demand(odd, "windows", "odd, 3 or more", self.windows)

    def rows(self, problem: Problem) -> Rows:
        """Return one row for each test function.

        Parameters
        ----------
        problem : Problem
            Samples and terms.

        Returns
        -------
        rows : Rows
            Weighted means of equation 1, at the centre of each test function. The remarks name
            the support and the smoothing windows.
        """
        support, noise = (self.support, np.nan) if self.support else select_support(problem)
        clocks = [problem.inputs.time[start:stop] for start, stop in problem.segments.tolist()]
        used = [len(time) for time in clocks if _is_long_enough(time, support)]
        if self.support and not used:
            raise MethodError(
                f"no segment of the log is as long as the test functions, {self.support:g} s: "
                "give a shorter `support`, or none to have it chosen"
            )
        velocity, windows, _ = smooth_velocity(problem, self.windows)
        n_terms = len(problem.equations.basis)
        rows = [(np.zeros((0, n_terms)), np.zeros((0, 6)), np.zeros(0), np.zeros(0, dtype=int))]
        for number, (start, time) in enumerate(zip(problem.segments[:, 0], clocks, strict=True)):
            for bumps in iterate_test_functions(time, support, self.overlap):
                first, last = int(start) + bumps.start, int(start) + bumps.stop
                design, target = step_equations(problem, first, last, velocity)
                weights, segment = bumps.weights, np.full(len(bumps.centres), number)
                rows.append((weights @ design, weights @ target, bumps.centres, segment))
        design, target, time, segment = map(np.concatenate, zip(*rows, strict=True))
        inflation, basis = variance_inflation(self.overlap), problem.equations.basis
        remarks = _remarks(problem, support, noise, len(clocks) - len(used), windows)
        time_scale = motion_time_scale(
            problem.inputs.time, velocity[:, problem.vehicle.free], problem.segments
        )
        arrays = design, target, segment, time
        return Rows(basis, *arrays, sum(used), inflation, remarks, time_scale)


@dataclass(frozen=True, eq=False)
class BumpFunctions:
    """Adjacent test functions, their weights of steps, and the samples they cover."""

    centres: FloatArray
    start: int
    stop: int
    weights: csr_array


def iterate_test_functions(
    time: FloatArray, support: float, overlap: int
) -> Iterator[BumpFunctions]:
    """Yield the test functions of one segment in chunks."""
    if not _is_long_enough(time, support):
        return
    step = float(time[-1] - time[0]) / (len(time) - 1)
    stride = max(support / overlap, step)
    room = max(float(time[-1] - time[0]) - support, 0.0)
    n = int(room / stride * (1.0 + _SUPPORT_TOLERANCE)) + 1
    first = time[0] + 0.5 * (support + room - (n - 1) * stride)
    centres: FloatArray = first + stride * np.arange(n)
    size = max(int(max(_CHUNK_STEPS * step, 4.0 * support) / stride), 1)
    for index in range(0, n, size):
        yield _bump_functions(time, centres[index : index + size], support)


def variance_inflation(overlap: int) -> float:
    """Return how many rows correspond to an independent one: ``Σ_j ∫φ(t)φ(t + jδ)dt / ∫φ²dt``."""
    area, square = 16.0 / 15.0, 256.0 / 315.0
    return max(area**2 / square * overlap / 2.0, 1.0)


def step_equations(
    problem: Problem, start: int, stop: int, velocity: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return design and target of equation 3 from sample to sample of one segment.

    The target is the change of momentum less the mean of the known wrench; terms are evaluated at
    ``velocity``.
    """
    mass, n_known = problem.vehicle.mass_matrix, problem.equations.n_known
    samples, factors = slice(start, stop), problem.equations.plant.factors
    inputs = problem.inputs.select(samples, velocity[samples])
    opening, closing = inputs.propulsion.T
    down, channels = inputs.down, inputs.channels[:-1]
    if not inputs.n_channels and np.array_equal(opening, closing):  # one evaluation per sample
        ends = core.regressor(factors, inputs.velocity, down, inputs.channels, opening)
        regressor = _mean(ends)
    else:
        regressor = core.regressor(factors, inputs.velocity[:-1], down[:-1], channels, opening[:-1])
        regressor += core.regressor(factors, inputs.velocity[1:], down[1:], channels, closing[1:])
        regressor *= 0.5
    wrench = core.coriolis(mass, inputs.velocity) + inputs.wrench
    step = np.diff(inputs.time)[:, None]
    momentum_rate = np.diff(problem.inputs.velocity[samples], axis=0) / step @ mass
    known = _mean(wrench) + regressor[:, :n_known] @ problem.equations.known
    return regressor[:, n_known:], (momentum_rate - known) * problem.vehicle.free


def select_support(problem: Problem) -> tuple[float, float]:
    """Return the shortest support [s] with little noise for all axes, and its share of noise."""
    lengths, ratio = _trial_supports(problem), signal_to_noise(problem)
    moving = ratio > _MIN_SIGNAL_TO_NOISE
    if not moving.any():
        return lengths[-1], 1.0
    noise = problem.inputs.velocity.var(axis=0) / ratio
    shares: list[float] = []
    for length in lengths:
        shares.append(float(noise_share(problem, length, noise)[moving].mean()))
        if shares[-1] <= _MAX_NOISE_SHARE:
            return length, shares[-1]
    return lengths[int(np.argmin(shares))], min(shares)


def noise_share(problem: Problem, support: float, noise: FloatArray) -> FloatArray:
    """Return the share of noise in the weighted acceleration of each axis."""
    gain, power = 0.0, np.zeros(6)
    for start, stop in problem.segments.tolist():
        time, velocity = problem.inputs.time[start:stop], problem.inputs.velocity[start:stop]
        for bumps in iterate_test_functions(time, support, _TRIAL_OVERLAP):
            samples, weights = slice(bumps.start, bumps.stop), bumps.weights
            rate = 1.0 / np.diff(time[samples])
            acceleration = weights @ (rate[:, None] * np.diff(velocity[samples], axis=0))
            power += (acceleration**2).sum(axis=0)
            # The noise of a sample enters the two differences around it with opposite signs.
            factors = (rate[weights.indices] * weights.data).reshape(len(acceleration), -1)
            gain += 2.0 * float((factors**2).sum() - (factors[:, :-1] * factors[:, 1:]).sum())
    return np.divide(gain * noise, power, out=np.ones(6), where=power > 0.0)


def _trial_supports(problem: Problem) -> list[float]:
    duration = problem.durations
    shortest = _MIN_SUPPORT_STEPS * median_step(problem)
    longest = max(float(duration @ duration / duration.sum()) / _SUPPORTS_PER_SEGMENT, shortest)
    n = int(np.ceil(_SUPPORTS_PER_OCTAVE * np.log2(longest / shortest))) + 1
    return list(np.geomspace(shortest, longest, n).tolist())


def _bump_functions(time: FloatArray, centres: FloatArray, support: float) -> BumpFunctions:
    half, latest = 0.5 * support, len(time) - 1
    first = np.maximum(np.searchsorted(time, centres - half, "right") - 1, 0)
    last = np.minimum(np.searchsorted(time, centres + half, "left"), latest)
    width = int((last - first).max())
    # Edges beyond the support, or beyond the last sample, get no weight: the area is constant.
    edges = np.minimum(first[:, None] + np.arange(width + 1), latest)
    weights = np.diff(_area((time[edges] - centres[:, None]) / half))
    start, stop = int(first[0]), int(last[-1]) + 1
    columns = np.minimum(edges[:, :-1] - start, stop - start - 2)
    rows = width * np.arange(len(centres) + 1)
    shape = (len(centres), stop - start - 1)
    sparse = csr_array((weights.ravel(), columns.ravel(), rows), shape=shape)
    return BumpFunctions(centres, start, stop, sparse)


def _area(s: FloatArray) -> FloatArray:
    """Return the share of the area of ``(1 - s²)²`` from 0 to s."""
    s = np.clip(s, -1.0, 1.0)
    square = s * s
    return np.asarray(s * (15.0 + square * (3.0 * square - 10.0)) / 16.0)


def _mean(values: FloatArray) -> FloatArray:
    return 0.5 * (values[:-1] + values[1:])


def _is_long_enough(time: FloatArray, support: float) -> bool:
    """Return whether a segment covers one test function."""
    return bool(time[-1] - time[0] >= support * (1.0 - _SUPPORT_TOLERANCE))


def _remarks(
    problem: Problem, support: float, noise: float, n_short: int, windows: tuple[int, ...]
) -> tuple[str, ...]:
    samples = round(support / median_step(problem))
    spans = ", ".join(f"{v} {w}" for v, w in zip(VELOCITIES, windows, strict=True) if w > 1)
    functions = f"Test functions span {support:.3g} s ({samples} samples)"
    share = f"; {100.0 * noise:.0f} % of their mean square acceleration is noise"
    share = "" if np.isnan(noise) else share
    short = f" {n_short} shorter segments are omitted." if n_short else ""
    smooth = f"Terms are evaluated at velocities smoothed over these samples: {spans}."
    return (f"{functions}{share}.{short}", *([smooth] if spans else []))
