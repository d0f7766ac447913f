"""CUSUM test on the innovations of a frozen reference model, axis by axis.

Recursive least squares follows a change and so hides it. The reference of an axis keeps the
coefficients a, their covariance P over the noise variance, the noise variance s² and the
correlation ρ of innovations from row to row, as they were some rows ago. A new row (φ, y) has the
standardised innovation r = (y − φᵀa) / √(s² (1 + φᵀPφ)), whitened z = (r − ρ r₋) / √(1 − ρ²), and
the one-sided cumulative sum (E. Page, Biometrika 41 (1954) 100)

    S ← max(0, S + min(z², MAX_SQUARE) − DRIFT).

An alarm needs S ≥ ALARM_RATIO · peak, with the highest peak of earlier sums that ended at zero.
Model-form error makes innovations larger in some manoeuvres, so s² is the highest noise variance
so far, with slow forgetting, and an axis whose residuals persist is not armed.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.term import AXES
from hydrodamp.identification.grades import MIN_R_SQUARED
from hydrodamp.identification.recursive import RecursiveState
from hydrodamp.kernels.core import N_LAGS, Estimate, Recursion

# All values are tuned on simulated campaigns and the VT-690 (studies/live_alarm.py). A row is 1 s.
NOISE_WARMUP_ROWS = 100  # before the noise variance counts
MIN_ROWS = 300  # before the first reference
MAX_REFERENCE_AGE = 100  # rows
MAX_REFERENCE_AGE_IN_CLIMB = 300  # rows, while the sum is above zero
MERGE_ROWS = 60  # rows after an alarm in which further axes belong to the same change
MAX_LEVERAGE = 0.1  # of a row on its axis, above which it is no evidence of a change
SETTLING_ROWS = 100  # rows without a high leverage after which an axis is settled
MIN_NOVEL_ROWS = 10  # rows of new motion that an axis must predict before one can be a change
NOVELTY_LEVERAGE, NOVELTY_RATIO = 0.1, 3.0  # of products of velocities; times the mean leverage
DRIFT, MAX_SQUARE = 2.0, 9.0  # of a whitened innovation, in variances
MIN_PEAK, ALARM_RATIO = 40.0, 1.5  # least reference peak; sum over it that is an alarm
CLIMB_START = 10.0  # sum above which persistent residuals may come from a change
NOISE_MEMORY = 0.9997  # of the highest noise variance, from row to row
MAX_CORRELATION = 0.9  # from row to row
FADING_ROWS = 3.0  # weights grow as the square of the count, as in csrc/recursive.c

# Mean correlation of innovations at lags of two to four rows, above which they persist: below 0.1
# with the right terms and white noise, 0.2 to 0.7 with missing terms (studies/live_alarm.py).
MAX_PERSISTENCE = 0.15

#: Why an axis is not armed.
RELEARNING = "relearning: the vehicle has changed."
STARTING = "starting: too few rows."
QUIET = "quiet: too little of the axis force is predicted."
UNSETTLED = "unsettled: the motion is new."
MODEL_FORM = "model form: the residuals persist; terms are missing, or an unmodelled force acts."
TRANSFER = "model form: the estimate did not predict a new motion."


class Reference(NamedTuple):
    """Frozen reference of an axis, with coefficients and covariance in units of the prior."""

    coefficients: FloatArray
    covariance: FloatArray  # over the noise variance
    noise_variance: float
    correlation: float


class Evidence(NamedTuple):
    """Exponentially weighted moments of the rows of an axis; columns in units of the prior."""

    rows: int = 0
    mean: float = 0.0  # of the target, [N s] or [N m s]
    square: float = 0.0  # of the target
    error: float = 0.0  # mean square of the innovation over 1 + leverage
    product: float = 0.0  # mean product of innovations at lags two to four
    columns: FloatArray | None = None  # mean square of each column

    def absorb(
        self, terms: FloatArray, target: float, innovation: float, earlier: float
    ) -> Evidence:
        """Return the moments after a row; ``earlier``: mean innovation at lags two to four."""
        weight = FADING_ROWS / (self.rows + FADING_ROWS)
        columns = np.zeros(len(terms)) if self.columns is None else self.columns
        return Evidence(
            self.rows + 1,
            self.mean + weight * (target - self.mean),
            self.square + weight * (target * target - self.square),
            self.error + weight * (innovation * innovation - self.error),
            self.product + weight * (innovation * earlier - self.product),
            frozen(columns + weight * (terms * terms - columns)),
        )

    @property
    def variance(self) -> float:
        """Variance of the target."""
        return max(0.0, self.square - self.mean * self.mean)

    @property
    def share(self) -> float:
        """Share of the target's variance that the estimate before each row predicts."""
        return max(0.0, 1.0 - self.error / self.variance) if self.variance > 0.0 else 0.0

    @property
    def is_excited(self) -> bool:
        """Whether the predicted share reaches the limit of `identify`."""
        return self.share >= MIN_R_SQUARED

    @property
    def response(self) -> float:
        """Root mean square of the predicted target."""
        return float(np.sqrt(self.share * self.variance))

    @property
    def persistence(self) -> float:
        """Mean correlation of innovations at lags two to four, at least 0."""
        return max(0.0, self.product / self.error) if self.error > 0.0 else 0.0

    @property
    def is_model_form(self) -> bool:
        """Whether the innovations persist: terms are missing, or an unmodelled force acts."""
        return self.persistence > MAX_PERSISTENCE


class CusumTest(NamedTuple):
    """State of the test of one axis."""

    highest_noise: float = 0.0  # variance
    reference: Reference | None = None
    age: int = 0  # of the reference, in rows
    residual: float = 0.0  # standardised, of the last row
    cusum: float = 0.0
    peak: float = 0.0  # of the present climb
    reference_peak: float = MIN_PEAK  # highest of the climbs that ended
    onset: float = 0.0  # s, start of the climb
    rows_since_leverage: int = 0
    was_excited: bool = False
    is_model_form: bool = False  # before the climb
    has_failed: bool = False  # to predict a new motion
    was_novel: bool = False  # the last row's motion
    n_novel_rows: int = 0  # of new motion, predicted
    evidence: Evidence = Evidence()

    @property
    def has_model_form(self) -> bool:
        """Whether the present estimate has a model-form error."""
        return self.evidence.is_model_form or self.has_failed

    @property
    def disarm_reason(self) -> str | None:
        """Why the axis raises no alarm; None where it is armed."""
        if self.reference is None:
            return STARTING
        if not self.was_excited:
            return QUIET
        if self.is_model_form:
            return MODEL_FORM
        if self.has_failed:
            return TRANSFER
        return UNSETTLED if self.rows_since_leverage < SETTLING_ROWS else None

    @property
    def alarm_ratio(self) -> float:
        """The sum over its threshold."""
        return self.cusum / (ALARM_RATIO * self.reference_peak)

    def accumulate(self, innovation: float, time: float) -> CusumTest:
        """Return the test after a whitened innovation."""
        cusum = max(0.0, self.cusum + min(innovation * innovation, MAX_SQUARE) - DRIFT)
        if not cusum:
            return self.end_climb()
        onset = self.onset if self.cusum else time
        return self._replace(cusum=cusum, peak=max(self.peak, cusum), onset=onset)

    def end_climb(self) -> CusumTest:
        """Return the test with its sum at zero and the peak remembered."""
        reference_peak = max(self.reference_peak, self.peak)
        return self._replace(cusum=0.0, peak=0.0, reference_peak=reference_peak)


class MotionNovelty(NamedTuple):
    """Second moments of all products of up to two velocities; they detect new motion."""

    rows: int = 0
    moments: FloatArray | None = None
    rows_since_novel: int = 0

    def absorb(self, velocity: Iterable[float]) -> MotionNovelty:
        """Return the moments after a row; a row of high leverage is a new motion."""
        factors = np.array([1.0, *velocity])
        products = np.outer(factors, factors)[np.triu_indices(len(factors))]
        square = np.outer(products, products)
        if self.moments is None:
            return MotionNovelty(1, frozen(square), 0)
        sizes = self.moments.diagonal()
        prior = np.where(sizes > 0.0, sizes / self.rows, 1.0)
        leverage = float(products @ np.linalg.solve(self.moments + np.diag(prior), products))
        is_new = leverage > NOVELTY_LEVERAGE + NOVELTY_RATIO * len(products) / self.rows
        moments = frozen(self.moments + square)
        return MotionNovelty(self.rows + 1, moments, 0 if is_new else self.rows_since_novel + 1)


class DetectedChange(NamedTuple):
    """A change: times of the alarm and of the onset [s], and axes in order of significance."""

    time: float
    since: float
    axes: tuple[str, ...]


class Alarm(NamedTuple):
    """State of change detection on all axes."""

    rows_since_alarm: int = 0  # 0 for none
    axes: tuple[CusumTest, ...] = (CusumTest(),) * 6
    changes: int = 0
    last: DetectedChange | None = None
    motion: MotionNovelty = MotionNovelty()

    def line(self, axes: Iterable[int]) -> dict[str, Any]:
        """Return the JSON entry of an estimate line, for the axes that have terms."""
        reasons = {
            AXES[axis]: RELEARNING if self.rows_since_alarm else self.axes[axis].disarm_reason
            for axis in axes
        }
        return {
            "armed": [name for name, reason in reasons.items() if reason is None],
            "not_armed": {name: reason for name, reason in reasons.items() if reason is not None},
            "changes": self.changes,
            "last": self.last and self.last._asdict(),
        }


class _Row(NamedTuple):
    """The last row of an axis, in units of the prior, and the estimate before it."""

    recursion: Recursion
    axis: int
    before: Estimate
    information: FloatArray  # and that of the prior
    terms: FloatArray
    target: float
    is_first: bool  # of a segment


def update_alarm(alarm: Alarm, before: RecursiveState, after: RecursiveState, time: float) -> Alarm:
    """Return the alarm after a row, given the recursive least squares before and after it."""
    if alarm.rows_since_alarm > MERGE_ROWS:
        alarm = Alarm(changes=alarm.changes, last=alarm.last, motion=alarm.motion)
    velocity, propulsion_speed = after.last.velocity, float(after.last.propulsion[1])
    surge = propulsion_speed or velocity[0]  # with a propeller, its propulsion speed
    motion = alarm.motion.absorb([surge, *velocity[1:]])
    recursion, tests = before.adaptation.settings, list(alarm.axes)
    lacks_terms = any(test.is_model_form or test.has_failed for test in tests)
    is_climbing = any(test.cusum > CLIMB_START for test in tests)
    for axis in np.flatnonzero(np.diff(recursion.starts)).tolist():
        _, information = recursion.axis_block(axis, before.estimate.information)
        content = recursion.last_row(axis, after.estimate.iv_state)
        row = _Row(
            recursion, axis, before.estimate, np.eye(len(information)) + information, *content
        )
        test = _absorb(tests[axis], row, after.estimate, is_climbing)
        if test.evidence.rows > MIN_ROWS:
            test = _test_row(test, row, motion, lacks_terms, time)
        tests[axis] = test
    return _decide(alarm._replace(axes=tuple(tests), motion=motion), time)


def _absorb(test: CusumTest, row: _Row, after: Estimate, is_climbing: bool) -> CusumTest:
    """Return the test with the moments of the row."""
    recursion, axis, before, information, terms, target, _ = row
    # The core divides each innovation by √(1 + leverage).
    previous = recursion.iv_statistics(axis, before.iv_state).innovations
    earlier = float(previous[1:].mean()) if len(previous) == N_LAGS else 0.0
    innovation = float(recursion.iv_statistics(axis, after.iv_state).innovations[0])
    evidence = test.evidence.absorb(terms, target, innovation, earlier)
    leverage = float(terms @ np.linalg.solve(information, terms))
    noise = test.highest_noise
    if evidence.rows > NOISE_WARMUP_ROWS:
        noise = max(NOISE_MEMORY * noise, float(before.noise[axis]))
    return test._replace(
        evidence=evidence,
        rows_since_leverage=0 if leverage > MAX_LEVERAGE else test.rows_since_leverage + 1,
        was_excited=test.was_excited or (evidence.rows > MIN_ROWS and evidence.is_excited),
        is_model_form=test.is_model_form if is_climbing else evidence.is_model_form,
        highest_noise=noise,
    )


def _test_row(
    test: CusumTest, row: _Row, motion: MotionNovelty, lacks_terms: bool, time: float
) -> CusumTest:
    """Return the test after the innovation of the row, with a new reference where it is due."""
    # A new motion looks like a change where terms are missing on any axis, or where the axis has
    # not predicted a new motion yet.
    is_novel = motion.rows_since_novel <= SETTLING_ROWS and (
        lacks_terms or test.n_novel_rows < MIN_NOVEL_ROWS
    )
    has_settled = test.rows_since_leverage == SETTLING_ROWS or (test.was_novel and not is_novel)
    test = test._replace(was_novel=is_novel)
    max_age = MAX_REFERENCE_AGE_IN_CLIMB if test.cusum else MAX_REFERENCE_AGE
    if test.reference is None or has_settled or test.age >= max_age:
        # The long-run variance of the residual has all lags, from lags two to four.
        noise = test.highest_noise * (1.0 + 6.0 * test.evidence.persistence)
        test = test._replace(reference=_make_reference(row, noise), age=0)
    if has_settled:
        test = test.end_climb()
    test = test._replace(age=test.age + 1)
    reference = test.reference
    if reference is None or test.disarm_reason is not None:
        return test._replace(residual=0.0, cusum=0.0, peak=0.0)
    terms = row.terms
    variance = reference.noise_variance * (1.0 + terms @ reference.covariance @ terms)
    residual = float((row.target - terms @ reference.coefficients) / np.sqrt(variance))
    correlation = 0.0 if row.is_first else reference.correlation
    white = (residual - correlation * test.residual) / float(np.sqrt(1.0 - correlation**2))
    test = test._replace(residual=residual).accumulate(white, time)
    return test._replace(
        has_failed=is_novel and test.alarm_ratio >= 1.0,
        n_novel_rows=test.n_novel_rows + (motion.rows_since_novel == 0),
    )


def _make_reference(row: _Row, noise_variance: float) -> Reference:
    """Freeze the estimate before the row."""
    recursion, axis, before = row[:3]
    columns = slice(*recursion.starts[axis : axis + 2].tolist())
    unit, zero = recursion.unit[columns], np.zeros(len(row.terms))
    products = recursion.iv_statistics(axis, before.iv_state).lag_products
    correlation = np.clip(products[0] / before.noise[axis], -MAX_CORRELATION, MAX_CORRELATION)
    return Reference(
        frozen(np.divide(before.coefficients[columns], unit, out=zero, where=unit > 0.0)),
        frozen(np.linalg.inv(row.information)),
        noise_variance,
        float(correlation),
    )


def _decide(alarm: Alarm, time: float) -> Alarm:
    """Return the alarm with a change where an armed axis is above its threshold."""
    pairs = zip(AXES, alarm.axes, strict=True)
    ratios = {name: 0.0 if test.has_failed else test.alarm_ratio for name, test in pairs}
    axes = [name for name in sorted(AXES, key=lambda name: -ratios[name]) if ratios[name] >= 1.0]
    if alarm.rows_since_alarm and alarm.last:
        merged = alarm.last._replace(axes=tuple(dict.fromkeys((*alarm.last.axes, *axes))))
        return alarm._replace(rows_since_alarm=alarm.rows_since_alarm + 1, last=merged)
    if not axes:
        return alarm
    change = DetectedChange(time, alarm.axes[AXES.index(axes[0])].onset, tuple(axes))
    return alarm._replace(rows_since_alarm=1, changes=alarm.changes + 1, last=change)
