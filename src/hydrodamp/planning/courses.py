"""Courses of the stretches of a dive, so that it stays in its area."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.planning.envelope import Area
from hydrodamp.planning.sailing import Voyage

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

    ``ways`` (draws, m, 2) are where each stretch leads on a course north.
    """

    area: Area | None
    ways: Sequence[FloatArray]
    samples: int
    courses: list[float] = field(default_factory=list)

    def __call__(self, place: int, here: FloatArray) -> float:
        """Return the course at a sample [rad], with the draws at some places, (draws, 2)."""
        if place == len(self.courses) * self.samples:
            before = self.courses[-1] if self.courses else 0.0
            way = self.ways[place // self.samples]
            self.courses.append(_course(self.area, here[:, None], way, before))
        return self.courses[-1]


def sailed_ways(voyage: Voyage, courses: Sequence[float], samples: int) -> list[FloatArray]:
    """Return where each stretch of a dive led in each draw, on a course north."""
    places = voyage.states[:, :, 9:11].transpose(1, 0, 2)
    found = []
    for number, course in enumerate(courses):
        own = places[:, number * samples : (number + 1) * samples]
        found.append(_turned(own[:, ::_EVERY] - own[:, :1], -course))
    return found


def reckoned(told: FloatArray, period: float) -> FloatArray:
    """Return where a stretch leads at the speeds and headings told, one draw."""
    step = told[:, 0] * period
    ahead = np.column_stack([np.cos(told[:, 1]), np.sin(told[:, 1])]) * step[:, None]
    return np.cumsum(ahead, axis=0)[None, ::_EVERY]


def _turned(way: FloatArray, course: float) -> FloatArray:
    turn = np.array([[np.cos(course), np.sin(course)], [-np.sin(course), np.cos(course)]])
    return np.asarray(way @ turn)


def _course(area: Area | None, here: FloatArray, way: FloatArray, before: float) -> float:
    """Return the course of least turn that leaves room in the area, else of most room."""
    if area is None:
        return 0.0
    bands = np.array([area.north, area.east])
    width = np.ptp(bands, axis=1).min()
    trials = np.array([here + _turned(way, course) for course in _COURSES]) - bands.mean(axis=1)
    room = 0.5 * np.ptp(bands, axis=1) - np.abs(trials)
    least = np.quantile(room.min(axis=(2, 3)), _FEW, axis=1) / width
    # What is left in the end, too: a stretch that ends in a corner leaves the next no way.
    ends = np.quantile(np.abs(trials[:, :, -1]).max(axis=2), 1.0 - _FEW, axis=1) / width
    turn = np.abs(np.angle(np.exp(1j * (_COURSES - before))))
    return float(_COURSES[np.argmin(np.where(least > _ROOM, 0.1 * turn + ends, 10.0 - least))])
