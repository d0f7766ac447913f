"""Courses of the stretches of a dive, so that it stays in its area."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.planning.envelope import Area
from hydrodamp.planning.sailing import Voyage, turned

#: Share of an area's width that is to stay free at its edges.
_ROOM = 0.08

#: Draws in which too little room does not count, as the few that may stray.
_FEW = 0.05

#: Courses a stretch may have.
_COURSES = np.radians(np.arange(0.0, 360.0, 30.0))

#: Of where a stretch leads every so many samples are looked at.
_EVERY = 10


@dataclass
class Pilot:
    """Chooses the course of each stretch from where the draws are when it begins.

    ``told`` (stretches, samples, 3) are speeds, headings about the course and depths, ``off``
    (stretches, draws, m, 2) by how much the last dive missed its reckoning, on a course north.
    """

    area: Area | None
    told: FloatArray
    period: float
    off: FloatArray
    courses: list[float] = field(default_factory=list)
    ways: list[FloatArray] = field(default_factory=list)
    course: float = 0.0

    def __call__(self, place: int, here: FloatArray) -> float:
        """Return the course at a sample [rad], with the draws at some places, (draws, 2)."""
        if place == len(self.courses) * self.told.shape[1]:
            self._choose(here)
        return self.courses[-1]

    def learnt(self, voyage: Voyage) -> FloatArray:
        """Return by how much a dive missed its reckoning."""
        n, samples, _ = self.told.shape
        places = voyage.states[:, :, 9:11].reshape(n, samples, -1, 2).swapaxes(1, 2)
        led = places[:, :, ::_EVERY] - places[:, :, :1] - np.array(self.ways)[:, None]
        return np.array(
            [_about(one, -course) for one, course in zip(led, self.courses, strict=True)]
        )

    def _choose(self, here: FloatArray) -> None:
        """Take the course of least turn that leaves room in the area, else of most room."""
        number = len(self.courses)
        ways, courses = self._reckoned(self.told[number, ::_EVERY])
        best = 0
        if self.area is not None:
            bands = np.array([self.area.north, self.area.east])
            width = np.ptp(bands, axis=1).min()
            off = [_about(self.off[number], course) for course in _COURSES]
            trials = here[:, None] + ways[:, None] + off - bands.mean(axis=1)
            room = (0.5 * np.ptp(bands, axis=1) - np.abs(trials)).min(axis=(2, 3))
            least = np.quantile(room, _FEW, axis=1) / width
            # A stretch that ends in a corner leaves the next no way.
            ends = np.quantile(np.abs(trials[:, :, -1]).max(axis=2), 1.0 - _FEW, axis=1) / width
            turn = np.abs(np.angle(np.exp(1j * (_COURSES - self.course))))
            best = int(np.argmin(np.where(least > _ROOM, 0.1 * turn + ends, 10.0 - least)))
        self.courses.append(float(_COURSES[best]))
        self.ways.append(ways[best])
        self.course = float(courses[best])

    def _reckoned(self, told: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return where a stretch leads on each course, (courses, m, 2), and courses in the end."""
        course = np.full(len(_COURSES), self.course) if self.courses else _COURSES
        step, ways = self.period * _EVERY, [np.zeros((len(_COURSES), 2))]
        for speed, aside in told[:, :2].tolist():
            course = turned(course, _COURSES, step)
            ahead = np.column_stack([np.cos(course + aside), np.sin(course + aside)])
            ways.append(ways[-1] + speed * step * ahead)
        return np.stack(ways[:-1], axis=1), course


def _about(way: FloatArray, course: float) -> FloatArray:
    turn = np.array([[np.cos(course), np.sin(course)], [-np.sin(course), np.cos(course)]])
    return np.asarray(way @ turn)
