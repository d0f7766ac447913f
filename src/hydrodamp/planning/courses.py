"""Courses of the stretches of a dive, so that it stays in its area, and its orders as a whole."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.planning.envelope import Area
from hydrodamp.planning.manoeuvres import Manoeuvre
from hydrodamp.planning.sailing import Fleet, Orders, Voyage

#: Share of an area's width that is to stay free at its edges.
_ROOM = 0.08

#: Courses a stretch may have.
_COURSES = np.radians(np.arange(0.0, 360.0, 30.0))

#: Of where a stretch leads every so many samples are looked at.
_EVERY = 10


def assembled(
    fleet: Fleet, several: Sequence[Manoeuvre], samples: int, ways: Sequence[FloatArray] = ()
) -> tuple[Orders, FloatArray]:
    """Return the orders of a whole dive, (n, 3) and (n, k), and the course of each stretch [rad].

    ``ways`` (draws, m, 2) are where each stretch leads on a course north; by dead reckoning where
    they are not known.
    """
    envelope, helm = fleet.envelope, fleet.helm
    orders = [one.orders(helm, envelope, samples) for one in several]
    if not ways:
        under_way = helm.propeller is not None
        ways = [_reckoned(own, envelope.period) * under_way for own, _ in orders]
    courses = _courses(envelope.area, ways)
    told = np.concatenate([own for own, _ in orders])
    told[:, 1] += np.repeat(courses, samples)
    told[:, 2] += envelope.middle
    return (told, np.concatenate([added for _, added in orders])), courses


def sailed_ways(voyage: Voyage, courses: FloatArray, samples: int) -> list[FloatArray]:
    """Return where each stretch of a dive led in each draw, on a course north."""
    places = voyage.states[:, :, 9:11].transpose(1, 0, 2)
    found = []
    for number, course in enumerate(courses.tolist()):
        own = places[:, number * samples : (number + 1) * samples]
        found.append(_turned(own[:, ::_EVERY] - own[:, :1], -course))
    return found


def _reckoned(told: FloatArray, period: float) -> FloatArray:
    """Return where a stretch leads at the speeds and headings told, one draw."""
    step = told[:, 0] * period
    ahead = np.column_stack([np.cos(told[:, 1]), np.sin(told[:, 1])]) * step[:, None]
    return np.cumsum(ahead, axis=0)[None, ::_EVERY]


def _turned(way: FloatArray, course: float) -> FloatArray:
    turn = np.array([[np.cos(course), np.sin(course)], [-np.sin(course), np.cos(course)]])
    return np.asarray(way @ turn)


def _courses(area: Area | None, ways: Sequence[FloatArray]) -> FloatArray:
    """Return courses of least turns that leave room in the area in all draws, else of most room."""
    found = np.zeros(len(ways))
    if area is None:
        return found
    bands = np.array([area.north, area.east])
    width = np.ptp(bands, axis=1).min()
    here = np.zeros((len(ways[0]), 1, 2))
    for number, way in enumerate(ways):
        trials = [here + _turned(way, course) for course in _COURSES]
        room = [np.minimum(one - bands[:, 0], bands[:, 1] - one).min() / width for one in trials]
        # What is left in the end, too: a stretch that ends in a corner leaves the next no way.
        ends = [np.abs(one[:, -1] - bands.mean(axis=1)).max() / width for one in trials]
        turn = np.abs(np.angle(np.exp(1j * (_COURSES - found[max(number - 1, 0)]))))
        cost = np.where(np.array(room) > _ROOM, 0.1 * turn + ends, 10.0 - np.array(room))
        best = int(np.argmin(cost))
        found[number], here = _COURSES[best], trials[best][:, -1:]
    return found
