"""CUSUM test on the share of its damping force by which an axis has changed.

A row (φ, y) is regressed on x: its terms φ and all products of up to two velocities, which the
model may lack. The regression keeps all rows, with the covariance P over the noise variance and
the novelty n = xᵀPx of a motion. Three hypotheses predict a row before they absorb y/g: no change,
g = 1, and from the start of a climb on, a force that has grown or fallen by the share h, g = 1 ± h.
With their errors e = y − g xᵀm, the log-likelihood ratio of each change to none is accumulated
(E. Page, Biometrika 41 (1954) 100):

    S± ← max(0, S± + (e₀² − e±²) / 2V),    V = s² (1 + n) + (FORM_ERROR F)² n,

with the mean square F² of the force, or the square of the predicted force where that is larger.
The last term is the model-form error: a new motion has a large V and is no evidence of a change.
What remains of it in a motion of small force adds up slowly; a climb is therefore abandoned, and
the hypotheses rejoin, after MIN_ROWS rows (window-limited CUSUM: T. L. Lai, IEEE Transactions on
Information Theory 44 (1998) 2917).
s² is the variance of e₀ / √(1 + n) plus its long-run variance, from a sum with exponential weights:
coloured noise and pushes add up in the sum, white noise of the sensors cancels there because a row
is a difference. s² is not updated during a climb, because a change is no noise. An axis is armed
while s < hF/2.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.term import AXES
from hydrodamp.identification.grades import MIN_R_SQUARED
from hydrodamp.identification.recursive import MEMORY_BLOCKS, RELATIVE_BLOCK, RecursiveState
from hydrodamp.kernels.core import N_LAGS
from hydrodamp.simulation.ranges import TYPICAL_VELOCITY

#: Smallest change h that matters, a share of the force: twice the largest noise of an armed axis.
SMALLEST_CHANGE = 0.2

#: Rows to a false alarm: 1000 h of rows of 1 s.
RUN_LENGTH = 3.6e6

#: Error of the regression in a motion that it has not absorbed, a share of the force: with 0.35 new
#: motions raise false alarms, with 1 changes are found only after seven minutes and more.
FORM_ERROR = 0.5

#: Information of the regression without data, in rows at the typical velocity: nearly none.
PRIOR = 1e-4

# A CUSUM of a log-likelihood ratio with the threshold b has a run length of at least exp b
# (G. Lorden, Annals of Mathematical Statistics 42 (1971) 1897); there are two on each axis.
THRESHOLD = math.log(2 * len(AXES) * RUN_LENGTH)
MIN_ROWS = MEMORY_BLOCKS / 2.0  # to arm an axis, and the window: 30 times Lai's least one
MEMORY_OF_SUM = 1.0 - RELATIVE_BLOCK / 2.0  # from row to row: two correlation times of the velocity
FADING_ROWS = 3.0  # weights grow as the square of the count, as in csrc/recursive.c
GAINS = frozen(np.array([1.0, 1.0 + SMALLEST_CHANGE, 1.0 - SMALLEST_CHANGE]))  # g

# Mean correlation of innovations at lags of two to four rows, above which they persist: below 0.1
# with the right terms and white noise, 0.2 to 0.7 with missing terms (studies/live_alarm.py).
MAX_PERSISTENCE = 0.15

#: Why an axis is not armed.
STARTING = "starting: too few rows."
NOISY = (
    "noise: it hides a change of the axis force by a fifth; terms are missing, or an unmodelled"
    " force acts."
)


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

    evidence: Evidence = Evidence()
    coefficients: FloatArray | None = None  # m of the three hypotheses, shape (3, n)
    covariance: FloatArray | None = None  # P
    noise_sum: float = 0.0  # of standardised errors, with exponential weights
    noise: float = 0.0  # s²
    cusums: FloatArray = frozen(np.zeros(2))  # of a force that has grown, and of one that fell
    onsets: FloatArray = frozen(np.zeros(2))  # s, start of each climb
    lengths: FloatArray = frozen(np.zeros(2))  # rows of each climb

    @property
    def disarm_reason(self) -> str | None:
        """Why the axis raises no alarm; None where it is armed."""
        if self.evidence.rows < MIN_ROWS:
            return STARTING
        is_visible = self.noise < (SMALLEST_CHANGE / 2.0) ** 2 * self.evidence.square
        return None if is_visible else NOISY

    def absorb(
        self, evidence: Evidence, terms: FloatArray, target: float, time: float
    ) -> CusumTest:
        """Return the test after a row, with the moments of the row."""
        if self.coefficients is None or self.covariance is None:
            n = len(terms)
            fresh = self._replace(coefficients=np.zeros((3, n)), covariance=np.eye(n) / PRIOR)
            return fresh.absorb(evidence, terms, target, time)
        gain = self.covariance @ terms
        novelty = float(terms @ gain)
        step = gain / (1.0 + novelty)
        scaled = target / GAINS - self.coefficients @ terms
        none, *changed = (GAINS * scaled) ** 2
        force = max(self.evidence.square, (target - scaled[0]) ** 2)
        cusums, lengths = np.zeros(2), np.where(self.cusums > 0.0, self.lengths + 1.0, 0.0)
        if self.disarm_reason is None:
            variance = self.noise * (1.0 + novelty) + FORM_ERROR**2 * force * novelty
            cusums = np.maximum(0.0, self.cusums + (none - changed) / (2.0 * variance))
            cusums[lengths >= MIN_ROWS] = 0.0
        coefficients = self.coefficients + np.outer(scaled, step)
        coefficients[1:][cusums == 0.0] = coefficients[0]
        standardised = float(scaled[0]) / math.sqrt(1.0 + novelty)
        noise_sum = MEMORY_OF_SUM * self.noise_sum + standardised
        weight = max(FADING_ROWS / (self.evidence.rows + FADING_ROWS), 1.0 / MEMORY_BLOCKS)
        noise = standardised**2 + noise_sum**2 * (1.0 - MEMORY_OF_SUM**2)
        return CusumTest(
            evidence,
            frozen(coefficients),
            frozen(self.covariance - np.outer(gain, step)),
            noise_sum,
            self.noise if cusums.any() else self.noise + weight * (noise - self.noise),
            frozen(cusums),
            frozen(np.where(self.cusums > 0.0, self.onsets, time)),
            frozen(lengths),
        )


class DetectedChange(NamedTuple):
    """A change: times of the alarm and of the onset [s], and axes in order of significance."""

    time: float
    since: float
    axes: tuple[str, ...]


class Alarm(NamedTuple):
    """State of change detection on all axes."""

    axes: tuple[CusumTest, ...] = (CusumTest(),) * 6
    changes: int = 0
    last: DetectedChange | None = None
    velocity: FloatArray | None = None  # at the end of the last row

    def line(self, axes: Iterable[int]) -> dict[str, Any]:
        """Return the JSON entry of an estimate line, for the axes that have terms."""
        reasons = {AXES[axis]: self.axes[axis].disarm_reason for axis in axes}
        return {
            "armed": [name for name, reason in reasons.items() if reason is None],
            "not_armed": {name: reason for name, reason in reasons.items() if reason is not None},
            "changes": self.changes,
            "last": self.last and self.last._asdict(),
        }


def update_alarm(alarm: Alarm, before: RecursiveState, after: RecursiveState, time: float) -> Alarm:
    """Return the alarm after a row, given the recursive least squares before and after it."""
    recursion, tests = before.adaptation.settings, list(alarm.axes)
    velocity = np.array(after.last.velocity) / TYPICAL_VELOCITY
    if propulsion_speed := float(after.last.propulsion[1]):  # with a propeller
        velocity[0] = propulsion_speed / TYPICAL_VELOCITY[0]
    for axis in np.flatnonzero(np.diff(recursion.starts)).tolist():
        terms, target, is_first = recursion.last_row(axis, after.estimate.iv_state)
        # A row has two blocks of time.
        centre = velocity if alarm.velocity is None or is_first else alarm.velocity
        previous = recursion.iv_statistics(axis, before.estimate.iv_state).innovations
        earlier = float(previous[1:].mean()) if len(previous) == N_LAGS else 0.0
        # The core divides each innovation by √(1 + leverage).
        innovation = float(recursion.iv_statistics(axis, after.estimate.iv_state).innovations[0])
        evidence = tests[axis].evidence.absorb(terms, target, innovation, earlier)
        columns = np.concatenate([terms, _multiply_velocities(centre)])
        tests[axis] = tests[axis].absorb(evidence, columns, target, time)
    sums = {name: float(test.cusums.max()) for name, test in zip(AXES, tests, strict=True)}
    axes = [name for name in sorted(AXES, key=lambda name: -sums[name]) if sums[name] > THRESHOLD]
    if not axes:
        return alarm._replace(axes=tuple(tests), velocity=frozen(velocity))
    test = tests[AXES.index(axes[0])]
    since = float(test.onsets[test.cusums.argmax()])
    return Alarm(changes=alarm.changes + 1, last=DetectedChange(time, since, tuple(axes)))


def _multiply_velocities(velocity: FloatArray) -> FloatArray:
    """Return all products of up to two velocities, and each velocity times its magnitude."""
    factors = np.array([1.0, *velocity])
    products = np.outer(factors, factors)[np.triu_indices(len(factors))]
    return np.concatenate([products, velocity[1:] * np.abs(velocity[1:])])
