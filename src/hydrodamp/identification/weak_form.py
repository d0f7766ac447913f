"""The weak form of equation 3: integrals against test functions in place of derivatives."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import VELOCITIES
from hydrodamp.errors import MethodError, demand
from hydrodamp.identification.differentiation import (
    SMOOTHING_WINDOWS,
    median_step,
    signal_to_noise,
    smooth_velocity,
)
from hydrodamp.identification.regression_rows import Rows
from hydrodamp.kernels import core
from hydrodamp.simulation.problem import Problem

# Steps worked on at once: they stay in cache.
_STEPS = 4096

# What a support may be longer than a segment, as a share, and still fit.
_ROUNDING = 1e-9

# Share of noise in the mean square of what the test functions see, averaged over the velocities:
# noise then adds some 5 % to the root mean square. Set with the re-enacted campaign in view, where
# shares from 0.2 to 0.02 belong to supports of 1 to 2.8 s: with shorter ones the large models
# suffer from noise, with longer ones the small models replay worse.
_NOISE = 0.1

# A velocity varies more than its noise where the ratio of the variances is above this.
_HEARD = 2.0

# Lengths tried: from this many steps to this share of a segment, so many in each doubling, with so
# many functions over an instant.
_LEAST_STEPS, _PER_SEGMENT, _PER_OCTAVE, _OVERLAP = 4, 4.0, 4, 2


@dataclass(frozen=True)
class WeakRegression:
    """One row a test function, segment by segment, on the log's own clock.

    Parameters
    ----------
    support : float, optional
        Length of a test function [s]; by default the shortest that hears more motion
        than noise. Segments shorter than that give no rows.
    overlap : int
        How many functions cover an instant. More than four tell nothing new.
    windows : tuple of int
        Odd lengths [samples] of local quadratics offered to each velocity before terms are
        evaluated; the one of the least estimated risk is taken. ``()`` evaluates terms at
        velocities as measured. The momentum is always as measured.

    Raises
    ------
    MethodError
        If the support is not positive, the overlap less than one, a window even or under
        three, or (when it is used) no segment as long as the support asked for.

    Examples
    --------
    >>> WeakRegression(support=1.5)
    WeakRegression(support=1.5, overlap=4, windows=(5, 7, 9, 11, 15, 21, 31))
    """

    support: float | None = None
    overlap: int = 4
    windows: tuple[int, ...] = SMOOTHING_WINDOWS

    def __post_init__(self) -> None:
        """Refuse what makes no test function."""
        long = self.support is None or 0.0 < self.support < np.inf
        demand(long, "support", "positive [s]", self.support)
        demand(self.overlap >= 1, "overlap", "at least 1", self.overlap)
        odd = all(window >= 3 and window % 2 for window in self.windows)
        demand(odd, "windows", "odd, 3 or more", self.windows)

    def rows(self, problem: Problem) -> Rows:
        """Return one row a test function.

        Parameters
        ----------
        problem : Problem
            Samples and terms.

        Returns
        -------
        rows : Rows
            Weighted means of equation 1 under each function, at the time of its middle. The
            remarks say which test functions and smoothed velocities were used.
        """
        support, heard = (self.support, np.nan) if self.support else select_support(problem)
        clocks = [problem.inputs.time[start:stop] for start, stop in problem.segments.tolist()]
        used = [len(time) for time in clocks if _covered(time, support)]
        if self.support and not used:
            raise MethodError(
                f"no segment of the log is as long as the test functions, {self.support:g} s: "
                "give a shorter `support`, or none to have it chosen"
            )
        velocity, windows, _ = smooth_velocity(problem, self.windows)
        n_terms = len(problem.equations.basis)
        parts = [(np.zeros((0, n_terms)), np.zeros((0, 6)), np.zeros(0), np.zeros(0, dtype=int))]
        for number, (start, time) in enumerate(zip(problem.segments[:, 0], clocks, strict=True)):
            for some in iterate_test_functions(time, support, self.overlap):
                first, last = int(start) + some.start, int(start) + some.stop
                design, target = step_equations(problem, first, last, velocity)
                where = np.full(len(some.centres), number)
                parts.append((some.weights @ design, some.weights @ target, some.centres, where))
        design, target, time, segment = (
            np.concatenate(column) for column in zip(*parts, strict=True)
        )
        return Rows(
            basis=problem.equations.basis,
            design=design,
            target=target,
            segment=segment,
            time=time,
            n_samples=sum(used),
            variance_inflation=variance_inflation(self.overlap),
            remarks=_remarks(problem, support, heard, len(clocks) - len(used), windows),
        )


@dataclass(frozen=True, eq=False)
class BumpFunctions:
    """Test functions next to each other, and the samples they reach."""

    centres: FloatArray
    start: int
    stop: int
    weights: csr_array


def iterate_test_functions(
    time: FloatArray, support: float, overlap: int
) -> Iterator[BumpFunctions]:
    """Go through the test functions of one segment, some at a time."""
    if not _covered(time, support):
        return
    step = float(time[-1] - time[0]) / (len(time) - 1)
    stride = max(support / overlap, step)
    room = max(float(time[-1] - time[0]) - support, 0.0)
    n = int(room / stride * (1.0 + _ROUNDING)) + 1
    first = time[0] + 0.5 * (support + room - (n - 1) * stride)
    centres: FloatArray = first + stride * np.arange(n)
    taken = max(int(max(_STEPS * step, 4.0 * support) / stride), 1)
    for place in range(0, n, taken):
        yield _bumps(time, centres[place : place + taken], support)


def variance_inflation(overlap: int) -> float:
    """Return how many rows count as one: ``Σ_j ∫φ(t)φ(t + jδ)dt / ∫φ²dt``."""
    area, square = 16.0 / 15.0, 256.0 / 315.0
    return max(area**2 / square * overlap / 2.0, 1.0)


def step_equations(
    problem: Problem, start: int, stop: int, velocity: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return design and target of the steps between samples of one segment.

    Equation 3 from sample to sample: momentum gained against the mean of what acted, terms
    evaluated at the velocity given.
    """
    mass, part, n_known = problem.vehicle.mass_matrix, slice(start, stop), problem.equations.n_known
    inputs, factors = problem.inputs.select(part, velocity[part]), problem.equations.plant.factors
    opening, closing = inputs.propulsion.T
    down, held = inputs.down, inputs.channels[:-1]
    if not inputs.n_channels and np.array_equal(opening, closing):  # nothing held: once a sample
        ends = core.regressor(factors, inputs.velocity, down, inputs.channels, opening)
        regressor = _mean(ends)
    else:
        regressor = core.regressor(factors, inputs.velocity[:-1], down[:-1], held, opening[:-1])
        regressor += core.regressor(factors, inputs.velocity[1:], down[1:], held, closing[1:])
        regressor *= 0.5
    acting = core.coriolis(mass, inputs.velocity) + inputs.wrench
    step = np.diff(inputs.time)[:, None]
    gained = np.diff(problem.inputs.velocity[part], axis=0) / step @ mass
    known = _mean(acting) + regressor[:, :n_known] @ problem.equations.known
    return regressor[:, n_known:], (gained - known) * problem.vehicle.free


def select_support(problem: Problem) -> tuple[float, float]:
    """Return one length for all axes and the share of noise: the shortest with little, or least."""
    lengths, ratio = _lengths(problem), signal_to_noise(problem)
    moving = ratio > _HEARD
    if not moving.any():
        return lengths[-1], 1.0
    noise = problem.inputs.velocity.var(axis=0) / ratio
    shares: list[float] = []
    for length in lengths:
        shares.append(float(noise_share(problem, length, noise)[moving].mean()))
        if shares[-1] <= _NOISE:
            return length, shares[-1]
    return lengths[int(np.argmin(shares))], min(shares)


def noise_share(problem: Problem, support: float, noise: FloatArray) -> FloatArray:
    """Return the share of noise in what test functions see of each velocity."""
    gain, power = 0.0, np.zeros(6)
    for start, stop in problem.segments.tolist():
        time, velocity = problem.inputs.time[start:stop], problem.inputs.velocity[start:stop]
        for some in iterate_test_functions(time, support, _OVERLAP):
            reach = slice(some.start, some.stop)
            rate = 1.0 / np.diff(time[reach])
            slopes = some.weights @ (rate[:, None] * np.diff(velocity[reach], axis=0))
            power += (slopes**2).sum(axis=0)
            # Neighbouring slopes share a sample, which each sees with the other's sign.
            each = (rate[some.weights.indices] * some.weights.data).reshape(len(slopes), -1)
            gain += 2.0 * float((each**2).sum() - (each[:, :-1] * each[:, 1:]).sum())
    return np.divide(gain * noise, power, out=np.ones(6), where=power > 0.0)


def _lengths(problem: Problem) -> list[float]:
    duration = problem.durations
    least = _LEAST_STEPS * median_step(problem)
    longest = max(float(duration @ duration / duration.sum()) / _PER_SEGMENT, least)
    n = int(np.ceil(_PER_OCTAVE * np.log2(longest / least))) + 1
    lengths: list[float] = np.geomspace(least, longest, n).tolist()
    return lengths


def _bumps(time: FloatArray, centres: FloatArray, support: float) -> BumpFunctions:
    half, latest = 0.5 * support, len(time) - 1
    first = np.maximum(np.searchsorted(time, centres - half, "right") - 1, 0)
    last = np.minimum(np.searchsorted(time, centres + half, "left"), latest)
    width = int((last - first).max())
    # Places past the support, or past the last sample, get no weight: the area there is flat.
    edges = np.minimum(first[:, None] + np.arange(width + 1), latest)
    weights = np.diff(_area((time[edges] - centres[:, None]) / half))
    start, stop = int(first[0]), int(last[-1]) + 1
    columns = np.minimum(edges[:, :-1] - start, stop - start - 2)
    rows = width * np.arange(len(centres) + 1)
    shape = (len(centres), stop - start - 1)
    sparse = csr_array((weights.ravel(), columns.ravel(), rows), shape=shape)
    return BumpFunctions(centres, start, stop, sparse)


def _area(place: FloatArray) -> FloatArray:
    """Return the share of the bump ``(1 - s²)²`` left of a place, less a half."""
    s = np.clip(place, -1.0, 1.0)
    square = s * s
    area: FloatArray = s * (15.0 + square * (3.0 * square - 10.0)) / 16.0
    return area


def _mean(values: FloatArray) -> FloatArray:
    return 0.5 * (values[:-1] + values[1:])


def _covered(time: FloatArray, support: float) -> bool:
    """Return whether a segment is long enough for one test function."""
    return bool(time[-1] - time[0] >= support * (1.0 - _ROUNDING))


def _remarks(
    problem: Problem, support: float, heard: float, n_short: int, windows: tuple[int, ...]
) -> tuple[str, ...]:
    samples = round(support / median_step(problem))
    spans = ", ".join(f"{v} {w}" for v, w in zip(VELOCITIES, windows, strict=True) if w > 1)
    functions = f"Test functions span {support:.3g} s ({samples} samples)"
    noise = f"; {100.0 * heard:.0f} % of the mean square acceleration that they see is noise"
    short = f" {n_short} shorter segments are left out." if n_short else ""
    smooth = f"Terms are taken at smoothed velocities, over samples: {spans}."
    return (
        functions + ("" if np.isnan(heard) else noise) + "." + short,
        *([smooth] if spans else []),
    )
