"""Error of a replay in blocks of time, and jackknife standard errors of what follows from it.

With the mean squared error ``e_bi`` of velocity i in block b of ``n_b`` samples, and the mean
squared deviation ``s_bi`` of the log from its mean, equation 24 over k velocities is
``RMS² = Σ n_b e_bi / (k Σ n_b)``, and the fit of velocity i is
``100 (1 − √(Σ n_b e_bi / Σ n_b s_bi))``. A diverged replay counts as the mean of the log,
``e_bi = s_bi``, from the block in which it diverges.

The relative error is the mean over velocities of ``√(Σ n_b (e_bi − σ_i²) / Σ n_b s_bi)``, with the
variance σ_i² of the white noise of the log. An excess below σ_i² counts as σ_i²: an error at the
level of the noise is the least that there is, and no difference below the noise decides. The
relative error does not depend on the units of the velocities; equation 24 does.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from itertools import compress

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray, jackknife_covariance
from hydrodamp.basis.term import VELOCITY_OF
from hydrodamp.conditioning.velocity_smoother import white_noise_std
from hydrodamp.data.log import Log
from hydrodamp.simulation.replay import RateUnit, Trajectory, free_velocities

#: Length of a block over the correlation time of the velocities.
_RELATIVE_LENGTH = 5.0

#: Least number of blocks of a log, and the greatest.
_MIN_BLOCKS, _MAX_BLOCKS = 5, 60

#: Least mean square deviation of a velocity over that of its noise: as much motion as noise.
_MIN_MOTION = 2.0

#: Share of the least error within which two errors are equal for use.
EQUAL_SHARE = 0.25


@dataclass(frozen=True, eq=False)
class BlockErrors:
    """Errors of one replay in the blocks of a log; the same blocks for every replay of it.

    ``sizes`` and ``diverged`` have shape (b,), ``error``, ``deviation`` and ``noise`` (b, k) in
    squared units of equation 24, for the velocities ``names``.
    """

    names: tuple[str, ...]
    sizes: FloatArray
    error: FloatArray
    deviation: FloatArray
    noise: FloatArray
    diverged: BoolArray

    @property
    def n(self) -> int:
        """Number of blocks."""
        return len(self.sizes)

    @property
    def rms(self) -> float:
        """Equation 24 over all blocks."""
        return float(np.exp(self._log_rms(self.sizes)))

    @property
    def rms_of_mean(self) -> float:
        """Equation 24 of a replay that is the mean of the log."""
        return float(np.sqrt(self.sizes @ self.deviation.mean(axis=1) / self.sizes.sum()))

    @property
    def standard_error(self) -> float | None:
        """Standard error of :attr:`rms`; None for a single block."""
        deviation = self._jackknife(lambda weights: np.exp(self._log_rms(weights)))
        return None if deviation is None else float(deviation[0])

    @property
    def fit_by_axis(self) -> dict[str, float | None]:
        """Fit of each velocity [%]; None where the log does not vary."""
        return _by_name(self.names, self._fit(self.sizes))

    @property
    def standard_error_by_axis(self) -> dict[str, float | None]:
        """Standard error of the fit of each velocity [%]."""
        unknown = np.full(len(self.names), np.nan)
        deviation = self._jackknife(self._fit)
        return _by_name(self.names, unknown if deviation is None else deviation)

    @property
    def excited(self) -> tuple[str, ...]:
        """The velocities that move at least as much as their noise."""
        is_excited = self.sizes @ (self.deviation - _MIN_MOTION * self.noise) > 0.0
        return tuple(compress(self.names, is_excited))

    def relative_error(self, names: Collection[str]) -> float:
        """Return the mean error of velocities relative to their motion, without the noise."""
        return float(_mean(self._relative_errors(names)(self.sizes)))

    def relative_standard_error(self, names: Collection[str]) -> float | None:
        """Return the standard error of :meth:`relative_error`; None for a single block."""
        errors = self._relative_errors(names)
        deviation = self._jackknife(lambda weights: _mean(errors(weights)))
        return None if deviation is None else float(deviation[0])

    def is_equivalent(self, lowest: BlockErrors, names: Collection[str]) -> bool:
        """Whether the relative error of each velocity is within a quarter or a standard error.

        Errors are paired by block: L. Breiman et al., Classification and Regression Trees, 1984,
        section 3.4.3, with the jackknife for the standard error. A velocity that the lowest does
        not predict better than the mean of the log decides nothing.
        """
        errors, least = self._relative_errors(names), lowest._relative_errors(names)

        def difference(weights: FloatArray) -> FloatArray:
            return np.asarray(errors(weights) - least(weights))

        deviation = self._jackknife(difference)
        margin = 0.0 if deviation is None else deviation
        limit = np.maximum(EQUAL_SHARE * least(self.sizes), margin)
        is_equal = difference(self.sizes) <= limit
        return bool(np.all(is_equal | (least(self.sizes) >= 1.0)))

    def _relative_errors(self, names: Collection[str]) -> Callable[[FloatArray], FloatArray]:
        """Return the relative error of each velocity as a function of the weights of the blocks."""
        is_counted = np.isin(self.names, [*names])
        error, noise = self.error[:, is_counted], self.noise[:, is_counted]
        motion = self.sizes @ self.deviation[:, is_counted] / self.sizes.sum()

        def relative_errors(weights: FloatArray) -> FloatArray:
            excess = np.maximum(weights @ (error - noise), weights @ noise)
            return np.asarray(np.sqrt(excess / weights.sum(axis=-1, keepdims=True) / motion))

        return relative_errors

    def _log_rms(self, weights: FloatArray) -> FloatArray:
        with np.errstate(divide="ignore"):
            return np.asarray(
                0.5 * np.log(weights @ self.error.mean(axis=1) / weights.sum(axis=-1))
            )

    def _fit(self, weights: FloatArray) -> FloatArray:
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(
                100.0 * (1.0 - np.sqrt((weights @ self.error) / (weights @ self.deviation)))
            )

    def _jackknife(self, statistic: Callable[[FloatArray], FloatArray]) -> FloatArray | None:
        """Return the standard errors of statistics of the weights of the blocks."""
        if self.n < 2:
            return None
        without = statistic(self.sizes * (1.0 - np.eye(self.n))).reshape(self.n, -1)
        return np.sqrt(jackknife_covariance(without).diagonal())


def _mean(errors: FloatArray) -> FloatArray:
    """Return the mean over velocities, 0 without one."""
    return np.asarray(errors.sum(axis=-1) / max(errors.shape[-1], 1))


def _by_name(names: tuple[str, ...], values: FloatArray) -> dict[str, float | None]:
    pairs = zip(names, values.tolist(), strict=True)
    return {name: value if np.isfinite(value) else None for name, value in pairs}


def block_errors(trajectory: Trajectory, rate_unit: RateUnit = "deg") -> BlockErrors:
    """Return the errors of a replay in blocks of five correlation times of the velocities."""
    replayed, measured = free_velocities(trajectory, rate_unit)
    squares = (replayed - measured) ** 2
    deviations = (measured - measured.mean(axis=0)) ** 2
    bounds, segments = block_bounds(trajectory.log)
    sizes = np.diff(bounds, axis=1).ravel().astype(float)
    error, deviation = (
        np.add.reduceat(values, bounds[:, 0], axis=0) / sizes[:, None]
        for values in (squares, deviations)
    )
    diverged = _is_diverged(error, deviation, segments)
    error = np.where(diverged[:, None], deviation, error)
    names = tuple(VELOCITY_OF[axis] for axis in trajectory.axes)
    number = trajectory.log.segment_numbers
    std = np.array([white_noise_std(column, number) for column in measured.T])
    noise = np.broadcast_to(std**2, error.shape)
    return BlockErrors(names, sizes, error, deviation, noise, diverged)


def block_bounds(log: Log) -> tuple[IntArray, IntArray]:
    """Return first sample and end of each block, shape (b, 2), and the segment of each block."""
    length = _RELATIVE_LENGTH * log.time_scale
    n_blocks = np.clip(log.duration / length, _MIN_BLOCKS, _MAX_BLOCKS)
    n_samples = log.n / n_blocks
    bounds, segments = [], []
    for number, (start, stop) in enumerate(log.bounds.tolist()):
        count = max(round((stop - start) / n_samples), 1)
        edges = np.unique(np.linspace(start, stop, count + 1).astype(np.int64))
        bounds.append(np.column_stack([edges[:-1], edges[1:]]))
        segments += [number] * (len(edges) - 1)
    return np.concatenate(bounds), np.array(segments)


def _is_diverged(error: FloatArray, deviation: FloatArray, segments: IntArray) -> BoolArray:
    """Mark blocks from a divergence on, and blocks before it that are worse than the mean."""
    diverged = np.array(np.isnan(error).any(axis=1))
    motion = np.maximum(deviation.mean(axis=0), np.finfo(float).tiny)
    is_worse = ((error - deviation) / motion).sum(axis=1) > 0.0
    for block in range(len(segments) - 2, -1, -1):
        is_same = segments[block] == segments[block + 1]
        diverged[block] |= is_same and diverged[block + 1] and is_worse[block]
    return diverged


def pool(errors: Iterable[BlockErrors]) -> BlockErrors:
    """Return the errors of several replays as one."""
    listed = tuple(errors)
    fields = ("sizes", "error", "deviation", "noise", "diverged")
    joined = (np.concatenate([getattr(each, name) for each in listed]) for name in fields)
    return BlockErrors(listed[0].names, *joined)
