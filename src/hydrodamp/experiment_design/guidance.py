"""Guidance: a course for each segment that keeps to the area, and line-of-sight path following.

Line of sight: heading = bearing of the leg - atan(cross-track error / lookahead distance), and the
next leg within a radius of acceptance. T. I. Fossen, Handbook of Marine Craft Hydrodynamics and
Motion Control (2011), section 10.3.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import ProblemError
from hydrodamp.experiment_design.closed_loop import (
    ClosedLoopSimulator,
    Trajectories,
    limit_course_rate,
)
from hydrodamp.experiment_design.envelope import Area

AREA_MARGIN = 0.08
"""Distance to keep from the edges, as a share of the area's smaller width; assumed."""

EXCLUDED_SHARE = 0.05
"""Share of the members whose distance to the edges is not counted."""

COURSES = np.radians(np.arange(0.0, 360.0, 30.0))
"""Courses of a segment [rad]."""

TRACK_STRIDE = 10
"""Samples between the positions of a segment that are compared with the area."""

TURN_WEIGHT = 0.1
"""Cost of a turn [1/rad] relative to the distance of a segment's end from the area's centre."""

LEG_DURATION = 10.0
"""Time between waypoints [s]: shorter than most steps of a setpoint."""


@dataclass
class CourseGuidance:
    """Selects the course of each segment from the members' positions at its start.

    ``setpoints`` (segments, samples, 3) are speed, heading relative to the course, and depth;
    ``drift_correction`` (segments, members, m, 2) the difference of the simulated and the dead
    reckoning track in the previous iteration, on a course north [m].
    """

    area: Area | None
    setpoints: FloatArray
    period: float
    drift_correction: FloatArray
    courses: list[float] = field(default_factory=list)
    tracks: list[FloatArray] = field(default_factory=list)
    final_course: float = 0.0

    def __call__(self, index: int, positions: FloatArray) -> float:
        """Return the course at a sample [rad]; positions are those of the members, (n, 2)."""
        if index == len(self.courses) * self.setpoints.shape[1]:
            self._select(positions)
        return self.courses[-1]

    def update_drift(self, trajectories: Trajectories) -> FloatArray:
        """Return the drift correction of simulated trajectories."""
        n, samples, _ = self.setpoints.shape
        positions = trajectories.states[:, :, 9:11].reshape(n, samples, -1, 2).swapaxes(1, 2)
        tracks = positions[:, :, ::TRACK_STRIDE] - positions[:, :, :1]
        drift = zip(tracks - np.array(self.tracks)[:, None], self.courses, strict=True)
        return np.array([_rotate(deviation, -course) for deviation, course in drift])

    def _select(self, positions: FloatArray) -> None:
        """Append the course of least cost that keeps the margin, else that of the most margin."""
        number, best = len(self.courses), 0
        tracks, final_courses = self._dead_reckon(self.setpoints[number, ::TRACK_STRIDE])
        if self.area is not None:
            bands = np.array([self.area.north, self.area.east])
            widths = np.ptp(bands, axis=1)
            drift = [_rotate(self.drift_correction[number], course) for course in COURSES]
            offset = np.abs(positions[:, None] + tracks[:, None] + drift - bands.mean(axis=1))
            margin = (0.5 * widths - offset).min(axis=(2, 3))
            margin = np.quantile(margin, EXCLUDED_SHARE, axis=1) / widths.min()
            # A segment that ends in a corner leaves no course for the next.
            end = np.quantile(offset[:, :, -1].max(axis=2), 1.0 - EXCLUDED_SHARE, axis=1)
            turn = np.abs(np.angle(np.exp(1j * (COURSES - self.final_course))))
            cost = TURN_WEIGHT * turn + end / widths.min()
            best = int(np.argmin(np.where(margin > AREA_MARGIN, cost, 10.0 - margin)))
        self.courses.append(float(COURSES[best]))
        self.tracks.append(tracks[best])
        self.final_course = float(final_courses[best])

    def _dead_reckon(self, setpoints: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return tracks on each course, shape (courses, m, 2), and the final courses."""
        course = np.full(len(COURSES), self.final_course) if self.courses else COURSES
        step, track = self.period * TRACK_STRIDE, [np.zeros((len(COURSES), 2))]
        for speed, heading in setpoints[:, :2].tolist():
            course = limit_course_rate(course, COURSES, step)
            forward = np.column_stack([np.cos(course + heading), np.sin(course + heading)])
            track.append(track[-1] + speed * step * forward)
        return np.stack(track[:-1], axis=1), course


class WaypointGuidance:
    """Line-of-sight guidance of n vehicles along straight legs of constant speed.

    ``paths`` (n, m, 4) are north, east, depth [m], and the speed of the leg to each waypoint [m/s];
    ``radius`` is both lookahead distance and radius of acceptance [m].
    """

    def __init__(self, paths: FloatArray, radius: float) -> None:
        self.paths, self.radius = paths, radius
        self.legs = np.ones(len(paths), dtype=np.int64)

    def __call__(self, states: FloatArray) -> FloatArray:
        """Return setpoints of speed, heading and depth, shape (n, 3)."""
        start, end, along, across, length = self._leg_coordinates(states)
        accepted = (length - along < self.radius) & (self.legs < self.paths.shape[1] - 1)
        if accepted.any():
            self.legs = self.legs + accepted
            start, end, along, across, length = self._leg_coordinates(states)
        leg = end - start
        heading = np.arctan2(leg[:, 1], leg[:, 0]) - np.arctan(across / self.radius)
        depth = start[:, 2] + np.clip(along / length, 0.0, 1.0) * leg[:, 2]
        return np.column_stack([end[:, 3], heading, depth])

    def _leg_coordinates(self, states: FloatArray) -> tuple[FloatArray, ...]:
        """Return both ends of each leg, along-track and cross-track distance, and its length."""
        index = np.arange(len(self.paths))
        start, end = self.paths[index, self.legs - 1], self.paths[index, self.legs]
        leg, position = (end - start)[:, :2], states[:, 9:11] - start[:, :2]
        length = np.linalg.norm(leg, axis=1)
        along = np.sum(leg * position, axis=1) / length
        across = (leg[:, 0] * position[:, 1] - leg[:, 1] * position[:, 0]) / length
        return start, end, along, across, length


def follow_tracks(
    simulator: ClosedLoopSimulator, planned: Trajectories, radius: float, seed: int | None = None
) -> tuple[Trajectories, list[FloatArray]]:
    """Simulate the ensemble along waypoints on each planned track; also return the waypoints."""
    n, n_tracks = simulator.n_members, planned.states.shape[1]
    waypoints = [_waypoints(planned.select([index]), radius) for index in range(n_tracks)]
    longest = max(map(len, waypoints))
    paths = np.array([_extend(path[:, 1:], longest) for path in waypoints])
    guidance = WaypointGuidance(np.repeat(paths, n, axis=0), radius)
    setpoints = np.repeat(planned.setpoints, n, axis=1)
    overlays = np.zeros((*setpoints.shape[:2], planned.commands.shape[2]))
    return simulator.simulate((setpoints, overlays), seed, guidance=guidance), waypoints


def _waypoints(track: Trajectories, radius: float) -> FloatArray:
    """Return times, positions and speeds of waypoints on the track of a vehicle, shape (m, 5).

    A leg takes ``LEG_DURATION``, or longer until it is twice the radius of acceptance.
    """
    stride = max(round(LEG_DURATION / track.period), 1)
    states, speeds = track.states[:, 0], track.setpoints[:, 0, 0]
    indices = [0]
    for index in [*range(stride, len(states), stride), len(states) - 1]:
        leg = states[index, 9:11] - states[indices[-1], 9:11]
        if np.hypot(*leg) > 2.0 * radius:
            indices.append(index)
    if len(indices) == 1:
        raise ProblemError(
            f"the dive has less than two waypoints {2.0 * radius:.2g} m apart: plan with mode "
            "'setpoints', or increase `speed`."
        )
    legs = zip([0, *indices[:-1]], indices, strict=True)
    speed = [speeds[start : end + 1].mean() for start, end in legs]
    return np.column_stack([track.period * np.array(indices), states[indices, 9:12], speed])


def _extend(path: FloatArray, n: int) -> FloatArray:
    """Return a path of n waypoints, with the last leg repeated."""
    steps = np.arange(1, n - len(path) + 1)[:, None] * (path[-1, :2] - path[-2, :2])
    depth_and_speed = np.repeat(path[-1:, 2:], len(steps), axis=0)
    return np.vstack([path, np.column_stack([path[-1, :2] + steps, depth_and_speed])])


def _rotate(track: FloatArray, course: float) -> FloatArray:
    rotation = np.array([[np.cos(course), np.sin(course)], [-np.sin(course), np.cos(course)]])
    return np.asarray(track @ rotation)
