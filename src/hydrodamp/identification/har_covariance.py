"""HAR covariance of linear estimates, with leverage correction and a bias allowance.

The scores ``z = Φᵀε`` are summed over bins of time. Their long-run covariance is the sum of outer
products over overlapping blocks weighted by a half sine, Σ_b (zᵀw_b)(zᵀw_b)ᵀ, with a block length
from the integrated autocorrelation time (heteroskedasticity and autocorrelation robust; Lazarus et
al. 2018), with effective degrees of freedom. The difference to an instrumental-variables estimate
(instruments: means of the regressors at a time lag) enters as an allowance for errors-in-variables
bias; the estimate itself does not change. Regressors are orthonormalised first, so that their Gram
matrices are well conditioned.
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
from hydrodamp.identification.regression import AxisSolution, Rows, Span, Triangle, column_span
from hydrodamp.models.catalog import catalog
from hydrodamp.models.model import DampingModel

# Bins of time of a log.
_MAX_BINS = 256

# Autocorrelations are summed up to this many correlation times: A. Sokal, "Monte Carlo Methods in
# Statistical Mechanics" (1997), doi:10.1007/978-1-4899-0319-8_6, section 3.
_SUMMED_CORRELATION_TIMES = 5.0

# Degrees of freedom of T independent residuals, over T^(2/3): E. Lazarus et al., "HAR Inference"
# (2018), doi:10.1080/07350015.2018.1506926, section 1. Those of a half sine are the duration over
# this roughness and the length of a block.
_FREEDOM_FACTOR, _HALF_SINE_ROUGHNESS = 0.4, 0.5866

# Blocks that overlap at an instant, and as many for the leverage of the fit.
_N_OVERLAPPING, _N_OVERLAPPING_COARSE = 8, 4

# Least residual share 1 - leverage [1] of a direction.
_MIN_RESIDUAL_SHARE = 0.1

# Sine [1] of the angle to a span from which a column adds a direction.
_MIN_SINE = 1e-6

# Lag of the instruments over the correlation time of the velocities. Rows used at most, and rows in
# memory at once.
_RELATIVE_LAG, _MAX_INSTRUMENTED_ROWS, _CHUNK_ROWS = 0.5, 16_384, 1024

# Rounding of the clock of the rows, relative to the lag.
_CLOCK_TOLERANCE = 1e-6

# Relative eigenvalue [1] of the moments below which a direction is rounding.
_EIGENVALUE_TOLERANCE = 1e-10


@dataclass(frozen=True, eq=False)
class Bins:
    """Bins of nearly equal time, none across segments: first rows, and the count per segment."""

    starts: IntArray
    counts: IntArray
    duration: float

    @classmethod
    def of(cls, segment: IntArray, time: FloatArray, max_bins: int = _MAX_BINS) -> Bins:
        """Divide rows into bins."""
        first = np.concatenate([[0], np.flatnonzero(np.diff(segment)) + 1])
        ends = np.append(first[1:], len(time))
        spans = time[ends - 1] - time[first]
        spans = spans + (spans.sum() / max(len(time) - len(first), 1) or 1.0)
        width = spans.sum() / min(len(time), max_bins)
        starts = []
        for start, end, span in zip(first.tolist(), ends.tolist(), spans.tolist(), strict=True):
            n = max(round(span / width), 1)
            edges = time[start] + span * (np.arange(n) - 1e-6) / n
            rows = start + np.searchsorted(time[start:end], edges)
            starts.append(np.unique(np.minimum(rows, end - 1)))  # the clock may be irregular
        counts = np.array([len(rows) for rows in starts])
        return cls(np.concatenate(starts), counts, float(spans.sum()))

    @property
    def n(self) -> int:
        """Number of bins."""
        return len(self.starts)

    def merge(self, size: int) -> Bins:
        """Return bins of ``size`` bins each."""
        counts = -(-self.counts // size)
        starts = np.concatenate([[0], np.cumsum(self.sizes(size))[:-1]])
        return Bins(starts, counts, self.duration)

    def sizes(self, size: int) -> IntArray:
        """Return how many bins each merged bin has; fewer at the end of a segment."""
        sizes = [np.minimum(count - np.arange(0, count, size), size) for count in self.counts]
        return np.concatenate(sizes)

    def sums(self, values: FloatArray) -> FloatArray:
        """Return the sum of values over each bin."""
        return np.asarray(np.add.reduceat(values, self.starts, axis=0))

    def correlation_time(self, sums: FloatArray) -> float:
        """Return the integrated autocorrelation time [s] of sums over bins."""
        width = self.duration / self.n
        size = next_fast_len(2 * int(self.counts.max()), real=True)
        covariance = np.zeros((size, sums.shape[1]))
        for segment in np.split(sums, np.cumsum(self.counts)[:-1]):
            covariance += irfft(np.abs(rfft(segment, size, axis=0)) ** 2, size, axis=0)
        covariance = covariance[: size // 4 + 1]
        nonzero = covariance[0] > 0.0
        if not nonzero.any():
            return width
        correlation = np.mean(covariance[:, nonzero] / covariance[0, nonzero], axis=1)
        times = 1.0 + 2.0 * np.cumsum(correlation[1:])
        lags = np.arange(1, len(times) + 1)
        enough = np.flatnonzero(lags >= _SUMMED_CORRELATION_TIMES * times)
        steps = times[enough[0]] if len(enough) else times.max(initial=1.0)
        return width * max(float(steps), 1.0)

    def block_stride(self, sums: FloatArray) -> int:
        """Return the number of bins from the start of one block to the next."""
        n_independent = self.duration / self.correlation_time(sums)
        freedom: float = max(_FREEDOM_FACTOR * n_independent ** (2.0 / 3.0), 1.0)
        return max(round(self.n / (freedom * _HALF_SINE_ROUGHNESS * _N_OVERLAPPING)), 1)

    def taper_weights(self, length: int = _N_OVERLAPPING) -> FloatArray:
        """Return half-sine weights of overlapping blocks of some bins, (n_blocks, n)."""
        taper = np.sin(np.pi * (np.arange(length) + 0.5) / length)
        taper /= np.linalg.norm(taper)
        blocks = []
        for count in self.counts.tolist():
            index = np.arange(count + length - 1)[:, None] - np.arange(count)
            inside = (index >= 0) & (index < length)
            blocks.append(np.where(inside, taper[np.clip(index, 0, length - 1)], 0.0))
        return np.asarray(block_diag(*blocks))


def long_run_covariance(bins: Bins, sums: FloatArray, stride: int | None = None) -> Uncertainty:
    """Return the covariance of the sum of correlated scores from their sums over bins."""
    coarse = bins.merge(stride or bins.block_stride(sums))
    weights = coarse.taper_weights()
    blocks, overlaps = weights @ coarse.sums(sums), weights @ weights.T
    length = bins.duration / coarse.n * _N_OVERLAPPING
    freedom = float(np.trace(overlaps) ** 2 / np.sum(overlaps**2))
    n_blocks, method = max(round(bins.duration / length), 1), "the scores of the model's residuals"
    return Uncertainty(blocks.T @ blocks, freedom, method, block=length, n_blocks=n_blocks)


@cache
def reference_model(axes: tuple[str, ...]) -> DampingModel:
    """Return Gertler and Hagen's model without (eta-1), whose residuals count as noise."""
    model = catalog["gertler-hagen"].restricted_to(axes)
    rows = tuple(tuple(t for t in terms if not t.needs_propulsion) for terms in model.terms)
    return replace(model, terms=rows)


# Arrays of each axis: orthonormal directions in the coordinates of all columns, or scores.
Arrays = list[FloatArray]


@dataclass(frozen=True, eq=False)
class HarCovariance:
    """Gram matrices of orthonormal columns in bins of time, for covariances of linear estimates.

    ``gram`` (bins, rank, rank) and ``cross`` (bins, rank, 6) are of the columns with themselves
    and with the target; ``moments`` are of [instruments, columns, target].
    """

    triangle: Triangle
    span: Span[int]
    bins: Bins
    gram: FloatArray
    cross: FloatArray
    moments: FloatArray
    n_instrumented: int
    lag: float
    _tapered_grams: dict[int, FloatArray] = field(default_factory=dict)

    @classmethod
    def of(cls, rows: Rows, triangle: Triangle) -> HarCovariance:
        """Accumulate the Gram matrices of rows whose R factor is ``triangle``."""
        columns = range(len(rows.basis))
        span = column_span(triangle.r[:, : len(columns)], columns)
        unit = rows.design @ span.coefficients
        bins = Bins.of(rows.segment, rows.time)
        gram = np.empty((bins.n, span.rank, span.rank))
        cross = np.empty((bins.n, span.rank, 6))
        edges = np.append(bins.starts, rows.n).tolist()
        for index, (start, stop) in enumerate(pairwise(edges)):
            bin_rows = unit[start:stop]
            np.matmul(bin_rows.T, bin_rows, out=gram[index])
            np.matmul(bin_rows.T, rows.target[start:stop], out=cross[index])
        lag = _RELATIVE_LAG * rows.time_scale
        moments, n = _instrument_moments(rows, unit, lag)
        return cls(triangle, span, bins, gram, cross, moments, n, lag)

    def uncertainty(
        self,
        solved: Sequence[AxisSolution],
        noise_reference_model: DampingModel,
        *,
        errors_in_variables: bool = False,
    ) -> Uncertainty | None:
        """Return the joint covariance of a linear estimate of all axes; None for too few rows.

        ``covariance`` is from the residuals of the model, ``noise`` from those of the model
        augmented by the terms of ``noise_reference_model``. With ``errors_in_variables``, both are
        inflated by the difference of the instrumental-variables to the least-squares estimate.
        """
        if not self.span.rank or not any(solution.span.rank for solution in solved):
            raise MethodError(
                "the log determines no coefficient: every regressor is zero or constant, or"
                " `time` is not in seconds"
            )
        axes = [axis for axis, solution in enumerate(solved) if len(solution.coefficients)]
        keys = [id(solved[axis].span) for axis in axes]  # axes with the same terms share work
        spans = {key: solved[axis].span for key, axis in zip(keys, axes, strict=True)}
        basis_of = {key: self.span.directions.T @ span.directions for key, span in spans.items()}
        bases = [basis_of[key] for key in keys]
        augmented = [
            self._augment(basis_of[k], noise_reference_model.terms[axis])
            for k, axis in zip(keys, axes, strict=True)
        ]
        if self.triangle.n_samples <= max(basis.shape[1] for basis in augmented):
            return None
        scores = self._scores(axes, bases, (bases, augmented))
        stride = self.bins.block_stride(np.hstack(scores[0]))
        maps = [solved[axis].span.coefficients * solved[axis].share for axis in axes]
        tapered = {key: self._tapered_gram(basis, stride) for key, basis in basis_of.items()}
        grams = [tapered[key] for key in keys]
        total = self._covariance(scores[0], bases, maps, grams, stride)
        noise = self._covariance(scores[1], augmented, maps, grams, stride)
        uncertainty = replace(total, noise=noise.covariance)
        if not errors_in_variables:
            return uncertainty
        two_stage = {key: self._two_stage(basis) for key, basis in basis_of.items()}
        shifts = {key: span.coefficients @ two_stage[key] for key, span in spans.items()}
        target = self.moments[:-6, -6:]
        shift = [shifts[key] @ target[:, axis] for key, axis in zip(keys, axes, strict=True)]
        allowance = f"noise in the regressors, by instruments {self.lag:.2g} s away"
        return uncertainty.inflate(np.concatenate(shift), allowance)

    @factorisation("design matrix")
    def _augment(self, basis: FloatArray, terms: Sequence[Term]) -> FloatArray:
        """Return an orthonormal basis of a basis and some terms."""
        columns = self.span.directions.T @ self.triangle.columns(terms)
        columns /= np.maximum(np.linalg.norm(columns, axis=0), np.finfo(np.float64).tiny)
        orthogonal = columns - basis @ (basis.T @ columns)
        directions, singular, _ = np.linalg.svd(orthogonal, full_matrices=False)
        return np.hstack([basis, directions[:, singular > _MIN_SINE]])

    def _scores(
        self, axes: list[int], bases: Arrays, fitted: Sequence[Arrays]
    ) -> tuple[Arrays, ...]:
        """Return the scores of bases in each bin, with the residuals of each fitted basis."""
        target = self.span.directions.T @ self.triangle.r[:, -6:][:, axes]
        fits = [b @ (b.T @ t) for each in fitted for b, t in zip(each, target.T, strict=True)]
        shape = (self.bins.n, self.span.rank, len(fitted), len(axes))
        gram = self.gram.reshape(-1, self.span.rank)
        scores = self.cross[:, :, None, axes] - (gram @ np.column_stack(fits)).reshape(shape)
        return tuple(
            [scores[:, :, fit, index] @ basis for index, basis in enumerate(bases)]
            for fit in range(len(fitted))
        )

    def _tapered_gram(self, basis: FloatArray, stride: int) -> FloatArray:
        """Return the Gram matrix of a basis with all columns in each of some coarse blocks."""
        if stride not in self._tapered_grams:
            size = stride * _N_OVERLAPPING // _N_OVERLAPPING_COARSE
            weights = self.bins.merge(size).taper_weights(_N_OVERLAPPING_COARSE)
            weights = np.repeat(weights, self.bins.sizes(size), axis=1)
            self._tapered_grams[stride] = weights @ self.gram.reshape(self.bins.n, -1)
        tapered = self._tapered_grams[stride].reshape(-1, self.span.rank, self.span.rank)
        return (tapered @ basis).transpose(2, 0, 1)

    @factorisation("covariance of the rows")
    def _covariance(
        self, scores: Arrays, fitted: Arrays, maps: Arrays, grams: Arrays, stride: int
    ) -> Uncertainty:
        """Return the covariance of coefficients, with scores corrected for the fit's leverage."""
        sums = []
        for z, basis, mapping, gram in zip(scores, fitted, maps, grams, strict=True):
            projection = (gram @ basis).reshape(len(gram), gram.shape[1] * basis.shape[1])
            leverage, axes = np.linalg.eigh(projection @ projection.T)
            scale = np.sqrt(np.maximum(1.0 - leverage, _MIN_RESIDUAL_SHARE))
            sums.append(z @ (mapping @ (axes / scale) @ axes.T).T)
        return long_run_covariance(self.bins, np.hstack(sums), stride)

    def _two_stage(self, basis: FloatArray) -> FloatArray:
        """Return the map of moments to the two-stage minus the ordinary least-squares estimate."""
        rank, size = basis.shape[1], self.span.rank
        if not 0 < 2 * rank < self.n_instrumented:
            return np.zeros((rank, 3 * size))
        projected = (self.moments[:-6, :-6].reshape(-1, size) @ basis).reshape(3, size, -1)
        moments = (basis.T @ projected).reshape(3 * rank, 3 * rank)
        instruments, cross = moments[: 2 * rank, : 2 * rank], moments[: 2 * rank, 2 * rank :]
        first_stage = cross.T @ _inverse(instruments)
        second_stage = _inverse(first_stage @ cross) @ first_stage
        difference = np.hstack([second_stage, -_inverse(moments[2 * rank :, 2 * rank :])])
        return np.asarray((difference.reshape(rank, 3, rank) @ basis.T).reshape(rank, -1))


def _inverse(moments: FloatArray) -> FloatArray:
    return np.asarray(pinvh(moments, rtol=_EIGENVALUE_TOLERANCE), dtype=np.float64)


def _instrument_moments(rows: Rows, unit: FloatArray, lag: float) -> tuple[FloatArray, int]:
    """Return the moments of [instruments, columns, target], and the number of rows used.

    The instruments of a row are the means of the columns one lag [s] before and after it, and the
    same of two lags. There are none without a lag.
    """
    rank = unit.shape[1]
    moments, n = np.zeros((3 * rank + 6, 3 * rank + 6)), 0
    if not lag > 0.0:
        return moments, n
    stride = -(-rows.n // _MAX_INSTRUMENTED_ROWS)
    tolerance = _CLOCK_TOLERANCE * lag
    margin = 2.0 * lag - tolerance
    first = np.concatenate([[0], np.flatnonzero(np.diff(rows.segment)) + 1, [rows.n]]).tolist()
    for start, stop in pairwise(first):
        time, columns = rows.time[start:stop], unit[start:stop]
        inner = (time >= time[0] + margin) & (time <= time[-1] - margin)
        used = np.flatnonzero(inner)[::stride]
        for chunk in np.split(used, range(_CHUNK_ROWS, len(used), _CHUNK_ROWS)):
            table = np.empty((len(chunk), len(moments)))
            for number in range(2):
                distance = (number + 1) * lag - tolerance
                before = np.searchsorted(time, time[chunk] - distance, "right") - 1
                after = np.searchsorted(time, time[chunk] + distance)
                instrument = table[:, number * rank : (number + 1) * rank]
                np.add(columns[before], columns[after], out=instrument)
                instrument *= 0.5
            table[:, 2 * rank : -6] = columns[chunk]
            table[:, -6:] = rows.target[start:stop][chunk]
            moments += table.T @ table
            n += len(chunk)
    return moments, n
