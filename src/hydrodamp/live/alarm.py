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

# Rows, of which a second brings one: from which noise counts, of the first reference, and from
# which an alarm may ring; how long a reference is held, and how long at most while a sum climbs;
# and how long axes that follow belong to the same change.
_WARM, _LEARNT, _ARMED = 100, 300, 400
_HELD, _LONGEST, _TOGETHER = 100, 300, 60

_DRIFT, _MOST = 2.0, 9.0
_USUAL, _FACTOR = 40.0, 1.5  # a climb that is usual for every vehicle, and how far beyond is none
_KEPT = 0.9997  # of the highest noise, from row to row
_STEADIEST = 0.9  # correlation from row to row


class Reference(NamedTuple):
    """An axis as it was: coefficients in units, their covariance over that of noise, noise."""

    known: FloatArray
    spread: FloatArray
    noise: float
    correlation: float


class Axis(NamedTuple):
    """What is remembered of an axis."""

    noise: float = 0.0  # the highest
    reference: Reference | None = None
    age: int = 0  # of the reference, in rows
    left: float = 0.0  # over by the last row, in standard deviations
    climb: float = 0.0
    top: float = 0.0  # of the climb under way
    usual: float = _USUAL  # the highest that ended
    since: float = 0.0  # s, when the climb began

    @property
    def share(self) -> float:
        """How far the climb is on its way to an alarm."""
        return self.climb / (_FACTOR * self.usual)

    def climbed(self, white: float, time: float) -> Axis:
        """Return the axis after a whitened residual."""
        climb = max(0.0, self.climb + min(white * white, _MOST) - _DRIFT)
        if not climb:
            return self._replace(climb=0.0, top=0.0, usual=max(self.usual, self.top))
        since = self.since if self.climb else time
        return self._replace(climb=climb, top=max(self.top, climb), since=since)


class Change(NamedTuple):
    """A change that was found: when it was told, when its climb began, and the axes in order."""

    time: float
    since: float
    axes: tuple[str, ...]


class Alarm(NamedTuple):
    """Where the watch for changes stands."""

    rows: int = 0  # since it began
    told: int = 0  # rows since an alarm; 0 for none
    axes: tuple[Axis, ...] = (Axis(),) * 6
    changes: int = 0
    last: Change | None = None

    @property
    def is_armed(self) -> bool:
        """Whether it may ring: not while a vehicle, or what became of it, is first learnt."""
        return self.rows > _ARMED and not self.told

    def line(self) -> dict[str, Any]:
        """Return what is told of it."""
        last = self.last and self.last._asdict()
        return {"armed": self.is_armed, "changes": self.changes, "last": last}


def watch(alarm: Alarm, before: RecursiveState, after: RecursiveState, time: float) -> Alarm:
    """Return the alarm after a row, of which recursive least squares knew nothing before."""
    if alarm.told > _TOGETHER:
        alarm = Alarm(changes=alarm.changes, last=alarm.last)
    alarm = alarm._replace(rows=alarm.rows + 1)
    if alarm.rows <= _WARM:
        return alarm
    recursion, known, axes = before.adaptation.recursion, before.estimate, list(alarm.axes)
    for place in np.flatnonzero(known.noise).tolist():
        noise = max(_KEPT * axes[place].noise, float(known.noise[place]))
        axes[place] = axes[place]._replace(noise=noise)
        if alarm.rows > _LEARNT:
            axes[place] = _seen(axes[place], recursion, place, known, after.estimate, time)
    alarm = alarm._replace(axes=tuple(axes))
    return _judged(alarm, time) if alarm.rows > _ARMED else alarm


def _seen(
    one: Axis, recursion: Recursion, place: int, known: Estimate, now: Estimate, time: float
) -> Axis:
    """Return an axis after the last row that was taken in."""
    is_due = one.age >= (_LONGEST if one.climb else _HELD)
    if one.reference is None or is_due:
        one = one._replace(reference=_held(recursion, place, known, one.noise), age=0)
    reference = one.reference
    assert reference is not None
    terms, target, is_first = recursion.last_row(place, now.witness)
    variance = reference.noise * (1.0 + terms @ reference.spread @ terms)
    left = float((target - terms @ reference.known) / np.sqrt(variance))
    kept = 0.0 if is_first else reference.correlation
    white = (left - kept * one.left) / float(np.sqrt(1.0 - kept * kept))
    return one._replace(left=left, age=one.age + 1).climbed(white, time)


def _held(recursion: Recursion, place: int, known: Estimate, noise: float) -> Reference:
    part, information = recursion.of(place, known.information)
    unit, zero = recursion.unit[part], np.zeros(part.stop - part.start)
    products, _ = recursion.witness_of(place, known.witness)
    correlation = np.clip(products[0] / known.noise[place], -_STEADIEST, _STEADIEST)
    return Reference(
        frozen(np.divide(known.coefficients[part], unit, out=zero, where=unit > 0.0)),
        frozen(np.linalg.inv(np.eye(len(unit)) + information)),
        noise,
        float(correlation),
    )


def _judged(alarm: Alarm, time: float) -> Alarm:
    shares = {name: one.share for name, one in zip(AXES, alarm.axes, strict=True)}
    over = [name for name in sorted(AXES, key=lambda name: -shares[name]) if shares[name] >= 1.0]
    if alarm.told and alarm.last:
        axes = tuple(dict.fromkeys((*alarm.last.axes, *over)))
        return alarm._replace(told=alarm.told + 1, last=alarm.last._replace(axes=axes))
    if not over:
        return alarm
    since = alarm.axes[AXES.index(over[0])].since
    return alarm._replace(told=1, changes=alarm.changes + 1, last=Change(time, since, tuple(over)))


def restored(content: dict[str, Any]) -> Alarm:
    """Return the alarm that was written as JSON makes of it."""
    axes = tuple(_axis(one) for one in content["axes"])
    last = content["last"]
    change = None if last is None else Change(last[0], last[1], tuple(last[2]))
    return Alarm(content["rows"], content["told"], axes, content["changes"], change)


def _axis(values: Iterable[Any]) -> Axis:
    noise, reference, *others = values
    if reference is not None:
        known, spread = (frozen(np.array(one)) for one in reference[:2])
        reference = Reference(known, spread, *reference[2:])
    return Axis(noise, reference, *others)
