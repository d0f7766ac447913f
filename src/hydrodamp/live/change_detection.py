"""Has the vehicle changed? What an estimate held still leaves over, summed up axis by axis.

Recursive least squares follows a change and so hides it. A reference does not: its coefficients,
its noise and the correlation of that from row to row are those of a while ago. Whitened, and in its
own standard deviations, what it leaves over of a new row is z, and each axis has a cumulative sum
(E. Page, Biometrika 41 (1954) 100),

    climb <- max(0, climb + min(z^2, MOST) - DRIFT).

A model that is a little wrong leaves more over in some manoeuvres than in others. So noise is the
highest that there was, slowly forgotten, and a climb is measured by those before that ended.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.atoms import AXES
from hydrodamp.identification.recursive import RecursiveState
from hydrodamp.kernels.core import Estimate, Recursion
from hydrodamp.kernels.plant import Sample
from hydrodamp.live.evidence import Evidence, innovations_of, restore_evidence

# Rows, of which a second brings one: from which noise counts, of the first reference; how long a
# reference is held, and how long at most while a sum climbs; and how long axes that follow belong
# to the same change.
_WARM, _LEARNT = 100, 300
_HELD, _LONGEST, _TOGETHER = 100, 300, 60

# A row of more leverage than this on its axis says nothing of a change; an axis is settled when so
# many rows have passed without one.
_NOVEL, _SETTLED = 0.1, 100
_TESTED = 10  # rows of new motion that an axis must predict before one may be a change

# Of the leverage of a motion among all products of two velocities: what makes it new, beside so
# many times the mean.
_NEW, _TIMES = 0.1, 3.0

_DRIFT, _MOST = 2.0, 9.0
_USUAL, _FACTOR = 40.0, 1.5  # a climb that is usual for every vehicle, and how far beyond is none
_CLIMBING = 10.0  # a climb from which residuals that persist may be those of a change
_KEPT = 0.9997  # of the highest noise, from row to row
_STEADIEST = 0.9  # correlation from row to row

#: Why an axis is not armed.
RELEARNING = "relearning: the vehicle has changed."
STARTING = "starting: too few rows."
QUIET = "quiet: too little of its force is predicted."
UNSETTLED = "unsettled: its motion is new."
MODEL_FORM = "model form: its residuals persist; terms are missing, or something pushes."
TRANSFER = "model form: what it learnt did not predict a new motion."


class Reference(NamedTuple):
    """An axis as it was: coefficients in units, their covariance over that of noise, noise."""

    known: FloatArray
    spread: FloatArray
    noise: float
    correlation: float


class CusumTest(NamedTuple):
    """What is remembered of an axis."""

    noise: float = 0.0  # the highest
    reference: Reference | None = None
    age: int = 0  # of the reference, in rows
    residual: float = 0.0  # of the last row, in standard deviations
    cusum: float = 0.0
    peak: float = 0.0  # of the climb under way
    reference_peak: float = _USUAL  # the highest that ended
    onset: float = 0.0  # s, when the climb began
    rows_since_leverage: int = 0  # rows since one of high leverage
    was_excited: bool = False
    is_model_form: bool = False  # before any climb
    has_failed: bool = False  # to predict a new motion
    was_novel: bool = False  # whether the last row's motion was
    n_novel_rows: int = 0  # rows of new motion that were predicted
    evidence: Evidence = Evidence()

    @property
    def lacks_terms(self) -> bool:
        """Whether the model's form fails on the axis."""
        return self.is_model_form or self.has_failed

    @property
    def has_model_form(self) -> bool:
        """The same of what the axis has learnt by now."""
        return self.evidence.is_model_form or self.has_failed

    @property
    def disarm_reason(self) -> str | None:
        """Why a climb is no alarm, if it is none."""
        if self.reference is None:
            return STARTING
        if not self.was_excited:
            return QUIET
        if self.is_model_form:
            return MODEL_FORM
        if self.has_failed:
            return TRANSFER
        return UNSETTLED if self.rows_since_leverage < _SETTLED else None

    @property
    def alarm_ratio(self) -> float:
        """How far the climb is on its way to an alarm."""
        return self.cusum / (_FACTOR * self.reference_peak)

    def accumulate(self, white: float, time: float) -> CusumTest:
        """Return the axis after a whitened residual."""
        climb = max(0.0, self.cusum + min(white * white, _MOST) - _DRIFT)
        if not climb:
            return self._replace(
                cusum=0.0, peak=0.0, reference_peak=max(self.reference_peak, self.peak)
            )
        since = self.onset if self.cusum else time
        return self._replace(cusum=climb, peak=max(self.peak, climb), onset=since)


class MotionNovelty(NamedTuple):
    """Which motion there was: moments of all products of two velocities, and of one."""

    rows: int = 0
    moments: FloatArray | None = None
    settled: int = 0  # rows since a new one

    def absorb(self, velocity: FloatArray) -> MotionNovelty:
        """Return the moments after a row, and whether its motion is new."""
        one = np.array([1.0, *velocity])
        products = np.outer(one, one)[np.triu_indices(len(one))]
        square = np.outer(products, products)
        if self.moments is None:
            return MotionNovelty(1, frozen(square), 0)
        sizes = self.moments.diagonal()
        size = np.where(sizes > 0.0, sizes / self.rows, 1.0)
        leverage = float(products @ np.linalg.solve(self.moments + np.diag(size), products))
        is_new = leverage > _NEW + _TIMES * len(products) / self.rows
        moments = frozen(self.moments + square)
        return MotionNovelty(self.rows + 1, moments, 0 if is_new else self.settled + 1)


class DetectedChange(NamedTuple):
    """A change that was found: when it was told, when its climb began, and the axes in order."""

    time: float
    since: float
    axes: tuple[str, ...]


class Alarm(NamedTuple):
    """Where the watch for changes stands."""

    rows_since_alarm: int = 0  # rows since an alarm; 0 for none
    axes: tuple[CusumTest, ...] = (CusumTest(),) * 6
    changes: int = 0
    last: DetectedChange | None = None
    motion: MotionNovelty = MotionNovelty()

    def line(self, axes: Iterable[int]) -> dict[str, Any]:
        """Return what an estimate line says of it, for the axes that have terms."""
        last = self.last and self.last._asdict()
        found = {
            AXES[axis]: RELEARNING if self.rows_since_alarm else self.axes[axis].disarm_reason
            for axis in axes
        }
        return {
            "armed": [name for name, reason in found.items() if reason is None],
            "not_armed": {name: reason for name, reason in found.items() if reason is not None},
            "changes": self.changes,
            "last": last,
        }


def update_alarm(alarm: Alarm, before: RecursiveState, after: RecursiveState, time: float) -> Alarm:
    """Return the alarm after a row, of which recursive least squares knew nothing before."""
    if alarm.rows_since_alarm > _TOGETHER:
        alarm = Alarm(changes=alarm.changes, last=alarm.last, motion=alarm.motion)
    motion = alarm.motion.absorb(_motion_of(after.last))
    recursion, axes = before.adaptation.recursion, list(alarm.axes)
    lacks_terms = any(one.lacks_terms for one in axes)
    is_climbing = any(one.cusum > _CLIMBING for one in axes)
    for axis in np.flatnonzero(np.diff(recursion.starts)).tolist():
        one = _absorb(axes[axis], recursion, axis, before.estimate, after.estimate, is_climbing)
        axes[axis] = _compare(
            one, recursion, axis, before.estimate, after.estimate, motion, lacks_terms, time
        )
    return _judged(alarm._replace(axes=tuple(axes), motion=motion), time)


def _motion_of(sample: Sample) -> FloatArray:
    """Return velocities, surge by the propeller's command where there is one."""
    velocity, command = sample.velocity.copy(), float(sample.propulsion[1])
    velocity[0] = command or velocity[0]
    return velocity


def _absorb(
    one: CusumTest,
    recursion: Recursion,
    axis: int,
    known: Estimate,
    now: Estimate,
    is_climbing: bool,
) -> CusumTest:
    """Return an axis with the moments of its last row."""
    terms, target, _ = recursion.last_row(axis, now.iv_state)
    innovation, earlier = innovations_of(recursion, axis, known, now)
    evidence = one.evidence.absorb(terms, target, innovation, earlier)
    _, information = recursion.axis_block(axis, known.information)
    leverage = float(terms @ np.linalg.solve(np.eye(len(terms)) + information, terms))
    one = one._replace(
        evidence=evidence,
        rows_since_leverage=0 if leverage > _NOVEL else one.rows_since_leverage + 1,
        was_excited=one.was_excited or (evidence.rows > _LEARNT and evidence.is_excited),
    )
    if not is_climbing:
        one = one._replace(is_model_form=evidence.is_model_form)
    if evidence.rows > _WARM:
        one = one._replace(noise=max(_KEPT * one.noise, float(known.noise[axis])))
    return one


def _compare(
    one: CusumTest,
    recursion: Recursion,
    axis: int,
    known: Estimate,
    now: Estimate,
    motion: MotionNovelty,
    lacks_terms: bool,
    time: float,
) -> CusumTest:
    """Return an axis after its last row has been compared with its reference."""
    if one.evidence.rows <= _LEARNT:
        return one
    # A new motion cannot be told from a change where terms are missing on any axis, nor where the
    # axis has not predicted one yet.
    is_new = motion.settled <= _SETTLED and (lacks_terms or one.n_novel_rows < _TESTED)
    has_settled = one.rows_since_leverage == _SETTLED or (one.was_novel and not is_new)
    one = one._replace(was_novel=is_new)
    if one.reference is None or has_settled or one.age >= (_LONGEST if one.cusum else _HELD):
        noise = one.noise * one.evidence.inflation
        one = one._replace(reference=_held(recursion, axis, known, noise), age=0)
    if has_settled:
        one = one._replace(cusum=0.0, peak=0.0, reference_peak=max(one.reference_peak, one.peak))
    one = one._replace(age=one.age + 1)
    if one.disarm_reason is not None:
        return one._replace(residual=0.0, cusum=0.0, peak=0.0)
    reference = one.reference
    assert reference is not None
    terms, target, is_first = recursion.last_row(axis, now.iv_state)
    variance = reference.noise * (1.0 + terms @ reference.spread @ terms)
    residual = float((target - terms @ reference.known) / np.sqrt(variance))
    kept = 0.0 if is_first else reference.correlation
    white = (residual - kept * one.residual) / float(np.sqrt(1.0 - kept * kept))
    one = one._replace(residual=residual).accumulate(white, time)
    tested = one.n_novel_rows + (motion.settled == 0)
    return one._replace(has_failed=is_new and one.alarm_ratio >= 1.0, n_novel_rows=tested)


def _held(recursion: Recursion, axis: int, known: Estimate, noise: float) -> Reference:
    part, information = recursion.axis_block(axis, known.information)
    unit, zero = recursion.unit[part], np.zeros(part.stop - part.start)
    products = recursion.iv_statistics(axis, known.iv_state).lag_products
    correlation = np.clip(products[0] / known.noise[axis], -_STEADIEST, _STEADIEST)
    return Reference(
        frozen(np.divide(known.coefficients[part], unit, out=zero, where=unit > 0.0)),
        frozen(np.linalg.inv(np.eye(len(unit)) + information)),
        noise,
        float(correlation),
    )


def _judged(alarm: Alarm, time: float) -> Alarm:
    pairs = zip(AXES, alarm.axes, strict=True)
    shares = {name: 0.0 if one.has_failed else one.alarm_ratio for name, one in pairs}
    over = [name for name in sorted(AXES, key=lambda name: -shares[name]) if shares[name] >= 1.0]
    if alarm.rows_since_alarm and alarm.last:
        axes = tuple(dict.fromkeys((*alarm.last.axes, *over)))
        return alarm._replace(
            rows_since_alarm=alarm.rows_since_alarm + 1, last=alarm.last._replace(axes=axes)
        )
    if not over:
        return alarm
    since = alarm.axes[AXES.index(over[0])].onset
    return alarm._replace(
        rows_since_alarm=1, changes=alarm.changes + 1, last=DetectedChange(time, since, tuple(over))
    )


def restore_alarm(content: dict[str, Any]) -> Alarm:
    """Return the alarm that was written as JSON makes of it."""
    last, (rows, moments, settled) = content["last"], content["motion"]
    return Alarm(
        content["told"],
        tuple(map(_axis, content["axes"])),
        content["changes"],
        None if last is None else DetectedChange(last[0], last[1], tuple(last[2])),
        MotionNovelty(rows, None if moments is None else frozen(np.array(moments)), settled),
    )


def _axis(values: list[Any]) -> CusumTest:
    one = CusumTest(*values)
    reference = one.reference
    if reference is not None:
        known, spread, *others = reference
        reference = Reference(frozen(np.array(known)), frozen(np.array(spread)), *others)
    evidence = restore_evidence(list(one.evidence))
    return one._replace(reference=reference, evidence=evidence)
