"""Covariance of linear estimates under coloured noise, from Gram matrices of stretches of time.

Rows are made orthonormal by the triangle first, so that Gram matrices lose no digits that
matter; they serve covariances only and are never solved from.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import pairwise

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.linalg import block_diag, pinvh

from hydrodamp.arrays import FloatArray, IntArray, factorisation
from hydrodamp.basis.term import Term
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Uncertainty
from hydrodamp.identification.qr_factor import AxisSolution, Span, Triangle, column_span
from hydrodamp.identification.regression_rows import Rows
from hydrodamp.models.catalog import catalog
from hydrodamp.models.model import DampingModel

# Bins of time that a log is divided into, at most.
_BINS = 256

# Lags are summed up to this many correlation times: A. Sokal, "Monte Carlo Methods in Statistical
# Mechanics" (1997), doi:10.1007/978-1-4899-0319-8_6, section 3.
_TIMES = 5.0

# Degrees of freedom wanted of T independent parts, over T^(2/3): E. Lazarus et al., "HAR
# Inference" (2018), doi:10.1080/07350015.2018.1506926, section 1. Those of a half sine are the
# duration over this roughness and the length of a block.
_FREEDOM, _ROUGHNESS = 0.4, 0.5866

# Blocks that cover an instant, and as many where the loss of a fit is computed.
_OVERLAP, _COARSE = 8, 4

# A direction of which the fit took more than the rest of this is taken to have lost so much.
_LEAST_LEFT = 0.1

# A direction that lies outside others by less than this share is within them.
_OUTSIDE = 1e-6

# How far the instruments are [s]: longer than the noise of a sensor stays correlated, and no longer
# than a vehicle takes to change its motion. So many rows are enough,
# taken so many at a time.
_LAG, _INSTRUMENTED, _CHUNK = 1.5, 16_384, 1024

# What the clock of the rows may be off [s].
_CLOCK = 1e-6

# Eigenvalues of moments below this share of the largest are rounding.
_ROUNDING = 1e-10

_NOISY_TERMS = f"noise in the terms themselves, by instruments {_LAG:g} s away"


@dataclass(frozen=True, eq=False)
class Bins:
    """Bins of nearly equal time, none across a join: first rows, and how many a segment has."""

    starts: IntArray
    counts: IntArray
    duration: float

    @classmethod
    def of(cls, segment: IntArray, time: FloatArray, most: int = _BINS) -> Bins:
        """Divide rows into bins."""
        first = np.concatenate([[0], np.flatnonzero(np.diff(segment)) + 1])
        ends = np.append(first[1:], len(time))
        spans = time[ends - 1] - time[first]
        spans = spans + (spans.sum() / max(len(time) - len(first), 1) or 1.0)
        width = spans.sum() / min(len(time), most)
        parts = []
        for start, end, span in zip(first.tolist(), ends.tolist(), spans.tolist(), strict=True):
            n = max(round(span / width), 1)
            edges = time[start] + span * (np.arange(n) - 1e-6) / n
            first_rows = start + np.searchsorted(time[start:end], edges)
            parts.append(np.unique(np.minimum(first_rows, end - 1)))  # the clock may be uneven
        counts = np.array([len(part) for part in parts])
        return cls(np.concatenate(parts), counts, float(spans.sum()))

    @property
    def n(self) -> int:
        """How many bins there are."""
        return len(self.starts)

    def merge(self, size: int) -> Bins:
        """Return bins of so many bins."""
        counts = -(-self.counts // size)
        starts = np.concatenate([[0], np.cumsum(self.sizes(size))[:-1]])
        return Bins(starts, counts, self.duration)

    def sizes(self, size: int) -> IntArray:
        """Return how many bins are merged into each of so many; fewer at a segment's end."""
        sizes = [np.minimum(count - np.arange(0, count, size), size) for count in self.counts]
        return np.concatenate(sizes)

    def sums(self, values: FloatArray) -> FloatArray:
        """Return the sum of values over each bin."""
        found: FloatArray = np.add.reduceat(values, self.starts, axis=0)
        return found

    def correlation_time(self, sums: FloatArray) -> float:
        """Return the time over which sums of bins are correlated: integrated autocorrelation."""
        width = self.duration / self.n
        size = next_fast_len(2 * int(self.counts.max()), real=True)
        covariance = np.zeros((size, sums.shape[1]))
        for part in np.split(sums, np.cumsum(self.counts)[:-1]):
            covariance += irfft(np.abs(rfft(part, size, axis=0)) ** 2, size, axis=0)
        covariance = covariance[: size // 4 + 1]
        kept = covariance[0] > 0.0
        if not kept.any():
            return width
        correlation = np.mean(covariance[:, kept] / covariance[0, kept], axis=1)
        times = 1.0 + 2.0 * np.cumsum(correlation[1:])
        enough = np.flatnonzero(np.arange(1, len(times) + 1) >= _TIMES * times)
        last = times[enough[0]] if len(enough) else times.max(initial=1.0)
        return width * max(float(last), 1.0)

    def block_stride(self, sums: FloatArray) -> int:
        """Return how many bins apart blocks should start."""
        parts = self.duration / self.correlation_time(sums)
        freedom: float = max(_FREEDOM * parts ** (2.0 / 3.0), 1.0)
        return max(round(self.n / (freedom * _ROUGHNESS * _OVERLAP)), 1)

    def taper_weights(self, overlap: int = _OVERLAP) -> FloatArray:
        """Return blocks of so many bins that fade as half sines, one a row, none across a join."""
        taper = np.sin(np.pi * (np.arange(overlap) + 0.5) / overlap)
        taper /= np.linalg.norm(taper)
        blocks = []
        for count in self.counts.tolist():
            place = np.arange(count + overlap - 1)[:, None] - np.arange(count)
            inside = (place >= 0) & (place < overlap)
            blocks.append(np.where(inside, taper[np.clip(place, 0, overlap - 1)], 0.0))
        made: FloatArray = block_diag(*blocks)
        return made


def long_run_covariance(bins: Bins, sums: FloatArray, hop: int | None = None) -> Uncertainty:
    """Return the covariance of the sum of correlated scores from their sums over bins."""
    coarse = bins.merge(hop or bins.block_stride(sums))
    tapers = coarse.taper_weights()
    blocks, overlaps = tapers @ coarse.sums(sums), tapers @ tapers.T
    length = bins.duration / coarse.n * _OVERLAP
    return Uncertainty(
        covariance=blocks.T @ blocks,
        degrees_of_freedom=float(np.trace(overlaps) ** 2 / np.sum(overlaps**2)),
        method="the scores of the model's residuals",
        block=length,
        n_blocks=max(round(bins.duration / length), 1),
    )


@cache
def reference_model(axes: tuple[str, ...]) -> DampingModel:
    """Return Gertler and Hagen's terms without (eta-1): what they leave over too is noise."""
    full = catalog["gertler-hagen"].restricted_to(axes)
    rows = tuple(tuple(t for t in terms if not t.needs_propulsion) for terms in full.terms)
    return replace(full, terms=rows)


# Directions of each axis, orthonormal in the coordinates of all columns.
Fits = list[FloatArray]


@dataclass(frozen=True, eq=False)
class HarCovariance:
    """What some rows tell of coloured noise: orthonormal columns, their Gram matrix in each bin.

    ``gram`` (bins, rank, rank) and ``cross`` (bins, rank, 6) are with themselves and the target;
    ``moments`` are those of instruments, columns and target side by side.
    """

    triangle: Triangle
    span: Span[int]
    bins: Bins
    gram: FloatArray
    cross: FloatArray
    moments: FloatArray
    n_instrumented: int
    _tapered: dict[int, FloatArray] = field(default_factory=dict)

    @classmethod
    def of(cls, rows: Rows, triangle: Triangle) -> HarCovariance:
        """Go through rows once, after they were folded into a triangle."""
        columns = range(len(rows.basis))
        span = column_span(triangle.r[:, : len(columns)], columns)
        unit = rows.design @ span.coefficients
        bins = Bins.of(rows.segment, rows.time)
        gram = np.empty((bins.n, span.rank, span.rank))
        cross = np.empty((bins.n, span.rank, 6))
        edges = np.append(bins.starts, rows.n).tolist()
        for place, (start, stop) in enumerate(pairwise(edges)):
            part = unit[start:stop]
            np.matmul(part.T, part, out=gram[place])
            np.matmul(part.T, rows.target[start:stop], out=cross[place])
        moments, n = _moments(rows, unit)
        return cls(triangle, span, bins, gram, cross, moments, n)

    def uncertainty(
        self, solved: Sequence[AxisSolution], rich: DampingModel, *, noisy_terms: bool = False
    ) -> Uncertainty | None:
        """Return the covariance of a linear estimate, all axes together; None for too few rows.

        That of all the estimate leaves over, and of what richer terms leave over too: noise alone.
        Noisy terms widen it by how far the estimate moves where only what instruments predict of
        the terms counts.
        """
        if not self.span.rank or not any(one.span.rank for one in solved):
            raise MethodError(
                "the log determines no coefficient: nothing that a term depends on changes, or"
                " `time` is not in seconds"
            )
        axes = [axis for axis, one in enumerate(solved) if len(one.coefficients)]
        keys = [id(solved[axis].span) for axis in axes]  # axes with the same terms share work
        spans = {key: solved[axis].span for key, axis in zip(keys, axes, strict=True)}
        found = {key: self.span.directions.T @ span.directions for key, span in spans.items()}
        own = [found[key] for key in keys]
        wide = [self._wider(one, rich.terms[axis]) for axis, one in zip(axes, own, strict=True)]
        if self.triangle.n_samples <= max(one.shape[1] for one in wide):
            return None
        scores = self._scores(axes, own, (own, wide))
        hop = self.bins.block_stride(np.hstack(scores[0]))
        made = [solved[axis].span.coefficients * solved[axis].share for axis in axes]
        shared = {key: self._blocks(one, hop) for key, one in found.items()}
        blocks = [shared[key] for key in keys]
        whole, noise = (
            self._covariance(*each, made, blocks, hop)
            for each in zip(scores, (own, wide), strict=True)
        )
        uncertainty = replace(whole, noise=noise.covariance)
        if not noisy_terms:
            return uncertainty
        moves = {key: spans[key].coefficients @ self._two_stage(one) for key, one in found.items()}
        target = self.moments[:-6, -6:]
        parts = zip(keys, axes, strict=True)
        shift = np.concatenate([moves[key] @ target[:, axis] for key, axis in parts])
        return uncertainty.inflate(shift, _NOISY_TERMS)

    @factorisation("design matrix")
    def _wider(self, own: FloatArray, terms: Sequence[Term]) -> FloatArray:
        """Return orthonormal directions of an estimate and of some terms together."""
        columns = self.span.directions.T @ self.triangle.columns(terms)
        columns /= np.maximum(np.linalg.norm(columns, axis=0), np.finfo(np.float64).tiny)
        rest = columns - own @ (own.T @ columns)
        left, singular, _ = np.linalg.svd(rest, full_matrices=False)
        return np.hstack([own, left[:, singular > _OUTSIDE]])

    def _scores(
        self, axes: list[int], own: Fits, fitted: Sequence[Fits]
    ) -> tuple[list[FloatArray], ...]:
        """Return the scores of directions in each bin, residuals being those of some fits."""
        target = self.span.directions.T @ self.triangle.r[:, -6:][:, axes]
        amounts = [f @ (f.T @ t) for each in fitted for f, t in zip(each, target.T, strict=True)]
        shape = (self.bins.n, self.span.rank, len(fitted), len(axes))
        gram = self.gram.reshape(-1, self.span.rank)
        left = self.cross[:, :, None, axes] - (gram @ np.column_stack(amounts)).reshape(shape)
        return tuple(
            [left[:, :, number, place] @ one for place, one in enumerate(own)]
            for number in range(len(fitted))
        )

    def _blocks(self, own: FloatArray, hop: int) -> FloatArray:
        """Return what directions share with all columns in each of some coarse blocks."""
        if hop not in self._tapered:
            size = hop * _OVERLAP // _COARSE
            tapers = self.bins.merge(size).taper_weights(_COARSE)
            every = np.repeat(tapers, self.bins.sizes(size), axis=1)
            self._tapered[hop] = every @ self.gram.reshape(self.bins.n, -1)
        tapered = self._tapered[hop].reshape(-1, self.span.rank, self.span.rank)
        return (tapered @ own).transpose(2, 0, 1)

    @factorisation("covariance of the rows")
    def _covariance(
        self, scores: Fits, fitted: Fits, made: Fits, blocks: Fits, hop: int
    ) -> Uncertainty:
        """Return that of coefficients; a fit takes some variance from its residuals' scores."""
        sums = []
        for z, one, back, shares in zip(scores, fitted, made, blocks, strict=True):
            taken = (shares @ one).reshape(len(shares), shares.shape[1] * one.shape[1])
            lost, axes = np.linalg.eigh(taken @ taken.T)
            left = np.sqrt(np.maximum(1.0 - lost, _LEAST_LEFT))
            sums.append(z @ (back @ (axes / left) @ axes.T).T)
        return long_run_covariance(self.bins, np.hstack(sums), hop)

    def _two_stage(self, own: FloatArray) -> FloatArray:
        """Return what takes moments with a target to two-stage less ordinary least squares."""
        rank, size = own.shape[1], self.span.rank
        if not 0 < 2 * rank < self.n_instrumented:
            return np.zeros((rank, 3 * size))
        half = self.moments[:-6, :-6].reshape(-1, size) @ own
        found = (own.T @ half.reshape(3, size, -1)).reshape(3 * rank, 3 * rank)
        near, both = found[: 2 * rank, : 2 * rank], found[: 2 * rank, 2 * rank :]
        predicting = both.T @ _inverse(near)
        two_stage = _inverse(predicting @ both) @ predicting
        difference = np.hstack([two_stage, -_inverse(found[2 * rank :, 2 * rank :])])
        moves: FloatArray = (difference.reshape(rank, 3, rank) @ own.T).reshape(rank, -1)
        return moves


def _inverse(moments: FloatArray) -> FloatArray:
    return np.asarray(pinvh(moments, rtol=_ROUNDING), dtype=np.float64)


def _moments(rows: Rows, unit: FloatArray) -> tuple[FloatArray, int]:
    """Return moments of (instruments, columns, target), and the rows that have instruments.

    Instruments are means of the columns of the rows next beyond a lag before and after, and of
    those beyond two.
    """
    rank = unit.shape[1]
    moments, n = np.zeros((3 * rank + 6, 3 * rank + 6)), 0
    stride, reach = -(-rows.n // _INSTRUMENTED), 2.0 * _LAG - _CLOCK
    first = np.concatenate([[0], np.flatnonzero(np.diff(rows.segment)) + 1, [rows.n]]).tolist()
    for start, stop in pairwise(first):
        time, part, target = (one[start:stop] for one in (rows.time, unit, rows.target))
        inner = (time >= time[0] + reach) & (time <= time[-1] - reach)
        chosen = np.flatnonzero(inner)[::stride]
        for here in np.split(chosen, range(_CHUNK, len(chosen), _CHUNK)):
            table = np.empty((len(here), len(moments)))
            for place, lag in enumerate((_LAG, 2.0 * _LAG)):
                before = np.searchsorted(time, time[here] - lag + _CLOCK, "right") - 1
                after = np.searchsorted(time, time[here] + lag - _CLOCK)
                near = table[:, place * rank : (place + 1) * rank]
                np.add(part[before], part[after], out=near)
                near *= 0.5
            table[:, 2 * rank : -6], table[:, -6:] = part[here], target[here]
            moments += table.T @ table
            n += len(here)
    return moments, n
