"""Guidance: a course for each stretch that keeps to the area, and line of sight to waypoints."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.errors import ProblemError
from hydrodamp.experiment_design.closed_loop import (
    ClosedLoopSimulator,
    Trajectories,
    limit_course_rate,
)
from hydrodamp.experiment_design.envelope import Area

#: Share of an area's width that is to stay free at its edges.
_ROOM = 0.08

#: Draws in which too little room does not count, as the few that may stray.
_FEW = 0.05

#: Courses a stretch may have.
_COURSES = np.radians(np.arange(0.0, 360.0, 30.0))

#: Of where a stretch leads every so many samples are looked at.
_EVERY = 10


#: Duration of a leg between waypoints [s]: shorter than most steps of a setpoint.
_LEG = 10.0


@dataclass
class CourseGuidance:
    """Chooses the course of each stretch from where the draws are when it begins.

    ``told`` (stretches, samples, 3) are speeds, headings about the course and depths, ``off``
    (stretches, draws, m, 2) by how much the last dive missed its reckoning, on a course north.
    """

    area: Area | None
    setpoints: FloatArray
    period: float
    drift_correction: FloatArray
    courses: list[float] = field(default_factory=list)
    ways: list[FloatArray] = field(default_factory=list)
    course: float = 0.0

    def __call__(self, place: int, here: FloatArray) -> float:
        """Return the course at a sample [rad], with the draws at some places, (draws, 2)."""
        if place == len(self.courses) * self.setpoints.shape[1]:
            self._choose(here)
        return self.courses[-1]

    def update_drift(self, trajectories: Trajectories) -> FloatArray:
        """Return by how much a dive missed its reckoning."""
        n, samples, _ = self.setpoints.shape
        places = trajectories.states[:, :, 9:11].reshape(n, samples, -1, 2).swapaxes(1, 2)
        led = places[:, :, ::_EVERY] - places[:, :, :1] - np.array(self.ways)[:, None]
        return np.array(
            [_about(one, -course) for one, course in zip(led, self.courses, strict=True)]
        )

    def _choose(self, here: FloatArray) -> None:
        """Take the course of least turn that leaves room in the area, else of most room."""
        number = len(self.courses)
        ways, courses = self._reckoned(self.setpoints[number, ::_EVERY])
        best = 0
        if self.area is not None:
            bands = np.array([self.area.north, self.area.east])
            width = np.ptp(bands, axis=1).min()
            off = [_about(self.drift_correction[number], course) for course in _COURSES]
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

    def _reckoned(self, setpoints: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return where a stretch leads on each course, (courses, m, 2), and courses in the end."""
        course = np.full(len(_COURSES), self.course) if self.courses else _COURSES
        step, ways = self.period * _EVERY, [np.zeros((len(_COURSES), 2))]
        for speed, aside in setpoints[:, :2].tolist():
            course = limit_course_rate(course, _COURSES, step)
            ahead = np.column_stack([np.cos(course + aside), np.sin(course + aside)])
            ways.append(ways[-1] + speed * step * ahead)
        return np.stack(ways[:-1], axis=1), course


@dataclass
class WaypointGuidance:
    """Line-of-sight guidance along straight legs, each vehicle on its path.

    T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control (2011), section 10.3:
    heading = bearing of the leg - atan(cross-track error / lookahead distance), and the next leg
    within a radius of acceptance. Depth is interpolated along a leg; a leg has a constant speed.

    ``paths`` (n, m, 4) are north, east, depth [m], and the speed of the leg to each waypoint [m/s];
    ``radius`` is both lookahead distance and radius of acceptance [m].
    """

    paths: FloatArray
    radius: float
    legs: IntArray = field(init=False)

    def __post_init__(self) -> None:
        """Start on the first leg."""
        self.legs = np.ones(len(self.paths), dtype=np.int64)

    def __call__(self, states: FloatArray) -> FloatArray:
        """Return setpoints of speed, heading and depth, shape (n, 3)."""
        start, end, along, across, length = self._on_leg(states)
        accepted = (length - along < self.radius) & (self.legs < self.paths.shape[1] - 1)
        if accepted.any():
            self.legs = self.legs + accepted
            start, end, along, across, length = self._on_leg(states)
        leg = end - start
        heading = np.arctan2(leg[:, 1], leg[:, 0]) - np.arctan(across / self.radius)
        depth = start[:, 2] + np.clip(along / length, 0.0, 1.0) * leg[:, 2]
        return np.column_stack([end[:, 3], heading, depth])

    def _on_leg(self, states: FloatArray) -> tuple[FloatArray, ...]:
        """Return both ends of each vehicle's leg, distances along and across it, and its length."""
        index = np.arange(len(self.paths))
        start, end = self.paths[index, self.legs - 1], self.paths[index, self.legs]
        leg, here = (end - start)[:, :2], states[:, 9:11] - start[:, :2]
        length = np.linalg.norm(leg, axis=1)
        along = np.sum(leg * here, axis=1) / length
        across = (leg[:, 0] * here[:, 1] - leg[:, 1] * here[:, 0]) / length
        return start, end, along, across, length


def follow_tracks(
    closed_loop: ClosedLoopSimulator, planned: Trajectories, radius: float, seed: int | None = None
) -> tuple[Trajectories, list[FloatArray]]:
    """Return the whole ensemble under waypoints along each planned track, and these waypoints."""
    n = len(closed_loop.matrices)
    several = [_waypoints(planned.select([k]), radius) for k in range(planned.states.shape[1])]
    longest = max(len(one) for one in several)
    paths = np.array([_extended(one[:, 1:], longest) for one in several])
    guidance = WaypointGuidance(np.repeat(paths, n, axis=0), radius)
    setpoints = np.repeat(planned.setpoints, n, axis=1)
    overlays = np.zeros((*setpoints.shape[:2], planned.commands.shape[2]))
    return closed_loop.simulate((setpoints, overlays), seed, guidance=guidance), several


def _waypoints(track: Trajectories, radius: float) -> FloatArray:
    """Return times, waypoints and speeds on the track of a vehicle, shape (m, 5).

    A leg takes ``_LEG``, or longer until it is twice the radius of acceptance.
    """
    every = max(round(_LEG / track.period), 1)
    states, speeds = track.states[:, 0], track.setpoints[:, 0, 0]
    chosen = [0]
    for index in [*range(every, len(states), every), len(states) - 1]:
        leg = states[index, 9:11] - states[chosen[-1], 9:11]
        if np.hypot(*leg) > 2.0 * radius:
            chosen.append(index)
    if len(chosen) == 1:
        raise ProblemError(
            f"the dive covers less than two waypoints {2.0 * radius:.2g} m apart: plan with mode "
            "'setpoints', or with more `speed`."
        )
    legs = zip([0, *chosen[:-1]], chosen, strict=True)
    speed = [speeds[start : end + 1].mean() for start, end in legs]
    return np.column_stack([track.period * np.array(chosen), states[chosen, 9:], speed])


def _extended(path: FloatArray, n: int) -> FloatArray:
    """Return a path of n waypoints: the last leg goes on."""
    further = np.arange(1, n - len(path) + 1)[:, None] * (path[-1, :2] - path[-2, :2])
    level = np.repeat(path[-1:, 2:], len(further), axis=0)
    return np.vstack([path, np.column_stack([path[-1, :2] + further, level])])


def _about(way: FloatArray, course: float) -> FloatArray:
    turn = np.array([[np.cos(course), np.sin(course)], [-np.sin(course), np.cos(course)]])
    return np.asarray(way @ turn)
