"""Manoeuvres, the course of each segment within the area, and line-of-sight waypoint following.

Manoeuvres are interleaved orthogonal multisines with phases of low crest factor (Schroeder 1970),
steps, doublets and zigzags. Line of sight: heading = bearing of the leg - atan(cross-track error /
lookahead distance), and the next leg within a radius of acceptance. T. I. Fossen, Handbook of
Marine Craft Hydrodynamics and Motion Control (2011), section 10.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from scipy.optimize import minimize

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.errors import ProblemError
from hydrodamp.experiment_design.autopilot_design import DesignedAutopilot
from hydrodamp.experiment_design.closed_loop import (
    ClosedLoopSimulator,
    Trajectories,
    limit_course_rate,
)
from hydrodamp.experiment_design.envelope import Area, Envelope

SHAPES = ("multisine", "steps", "doublets", "zigzag")
"""Shapes of excitation signals."""

MAX_HEADING = float(np.radians(75.0))
"""Largest heading setpoint relative to the course [rad]: less than half a turn between sides."""

DEPTH_AMPLITUDE, MAX_DEPTH = 0.6, 0.48
"""Depth of strength 1, and largest depth from the middle, as shares of the depth band."""

FREQUENCIES, HOLDS = (0.08, 0.5), (20.0, 3.0)
"""Highest multisine frequency [Hz] and time between steps [s], at tempo 0 and 1."""

SETPOINT_FREQUENCY_RATIO = 0.3
"""Highest frequency of setpoints over that of commands: the closed loop is slower."""

N_SETPOINTS = 3
"""Inputs that are setpoints (speed, heading, depth); overlays of commands follow."""

MAX_HARMONICS, MAX_PHASE_ITERATIONS = 16, 60
"""Harmonics of a multisine, and iterations of the minimisation of its peak."""


@dataclass(frozen=True)
class Manoeuvre:
    """Excitation of one segment of a dive.

    Attributes
    ----------
    shape : str
        One of ``SHAPES``.
    level : float
        Mean speed, from 0 to 1 of the speed band.
    tempo : float
        From 0 (slow) to 1 (fast).
    strengths : tuple of float
        Amplitudes of speed, heading, depth and each overlay, from -1 to 1 of their limits.
    """

    shape: str
    level: float
    tempo: float
    strengths: tuple[float, ...]

    @classmethod
    def from_design_vector(cls, vector: FloatArray) -> Manoeuvre:
        """Return the manoeuvre of a vector in [0, 1]: shape, level, tempo, strengths."""
        shape = SHAPES[min(int(vector[0] * len(SHAPES)), len(SHAPES) - 1)]
        strengths = tuple((2.0 * vector[3:] - 1.0).tolist())
        return cls(shape, float(vector[1]), float(vector[2]), strengths)

    @property
    def design_vector(self) -> FloatArray:
        """The manoeuvre as a vector in [0, 1]."""
        shape = (SHAPES.index(self.shape) + 0.5) / len(SHAPES)
        return np.array([shape, self.level, self.tempo, *(0.5 + 0.5 * np.array(self.strengths))])

    def attenuate(self, factor: float) -> Manoeuvre:
        """Return the manoeuvre with all strengths multiplied by a factor."""
        return replace(self, strengths=tuple(factor * value for value in self.strengths))

    def slow_down(self, factor: float) -> Manoeuvre:
        """Return the manoeuvre at a lower speed that varies less."""
        strengths = (factor * self.strengths[0], *self.strengths[1:])
        level = max(self.level - (1.0 - factor) * 0.5, 0.0)
        return replace(self, level=level, strengths=strengths)

    def setpoints(
        self, autopilot: DesignedAutopilot, envelope: Envelope, n: int
    ) -> tuple[FloatArray, FloatArray]:
        """Return setpoints relative to course and mid-depth, (n, 3), and overlays, (n, k)."""
        signals = _unit_signals(self.shape, self.tempo, len(self.strengths), n, envelope.period)
        signals = signals * np.array(self.strengths)
        low, high = envelope.speed
        setpoints = np.empty((n, N_SETPOINTS))
        setpoints[:, 0] = np.clip(low + (high - low) * (self.level + signals[:, 0]), low, high)
        setpoints[:, 1] = MAX_HEADING * signals[:, 1]
        depth = np.clip(DEPTH_AMPLITUDE * signals[:, 2], -MAX_DEPTH, MAX_DEPTH)
        setpoints[:, 2] = (envelope.max_depth - envelope.depth[0]) * depth
        overlays, indices = np.zeros((n, len(autopilot.names))), autopilot.overlays
        lowest, highest = autopilot.lowest[indices], autopilot.highest[indices]
        amplitude = np.where(signals[:, N_SETPOINTS:] < 0.0, -lowest, highest)
        overlays[:, indices] = signals[:, N_SETPOINTS:] * np.maximum(amplitude, 0.0)
        return setpoints, overlays


@cache
def _unit_signals(shape: str, tempo: float, n_inputs: int, n: int, period: float) -> FloatArray:
    """Return a signal of peak 1 for each input, shape (n, n_inputs)."""
    time = np.asarray(period * np.arange(n), dtype=np.float64)
    if shape == "multisine":
        highest = FREQUENCIES[0] * (FREQUENCIES[1] / FREQUENCIES[0]) ** tempo
        return frozen(_multisines(highest, n_inputs, time, n * period))
    hold = HOLDS[0] * (HOLDS[1] / HOLDS[0]) ** tempo
    signals = np.zeros((n, n_inputs))
    for index in range(n_inputs):
        # Inputs start one after the other so that they are not correlated.
        phase = time / hold - index / n_inputs
        count = np.floor(phase).astype(int)
        if shape == "steps":
            signal = np.array([1.0, 0.0, -1.0, -0.5, 0.5, 0.0])[count % 6]
        elif shape == "zigzag":
            signal = np.where(np.floor(phase / (1.0 + index % 3)).astype(int) % 2, -1.0, 1.0)
        else:
            active = (count - index) % max(n_inputs, 3) == 0
            signal = np.where(active, np.where(phase % 1.0 < 0.5, 1.0, -1.0), 0.0)
        signals[:, index] = np.where(phase < 0.0, 0.0, signal)
    return frozen(signals)


def _multisines(highest: float, n_inputs: int, time: FloatArray, duration: float) -> FloatArray:
    """Return multisines up to a frequency [Hz] with no common harmonic and with low peaks."""
    signals = np.zeros((len(time), n_inputs))
    for index in range(n_inputs):
        top = highest * (SETPOINT_FREQUENCY_RATIO if index < N_SETPOINTS else 1.0)
        last = max(int(top * duration), index + 1, 1)
        harmonics = np.arange(1 + index, last + 1, n_inputs)
        spaced = np.linspace(0, len(harmonics) - 1, MAX_HARMONICS).astype(int)
        harmonics = harmonics[np.unique(spaced)]
        angles = 2.0 * np.pi * np.outer(time / duration, harmonics)
        signal = np.sin(angles + low_peak_phases(tuple(harmonics.tolist()))).sum(axis=1)
        signals[:, index] = signal / max(np.abs(signal).max(), 1e-9)
    return signals


@cache
def low_peak_phases(harmonics: tuple[int, ...]) -> FloatArray:
    """Return the phases that minimise the 8-norm of the sum of these harmonics.

    The start is of M. R. Schroeder (1970), doi:10.1109/TIT.1970.1054411.
    """
    number = np.array(harmonics, dtype=np.float64)
    k = np.arange(1, len(number) + 1)
    start = -np.pi * k * (k - 1) / len(number)
    grid = np.linspace(0.0, 2.0 * np.pi, 16 * int(number.max()) + 1)[:-1]
    angles = np.outer(grid, number)

    def log_norm(phases: FloatArray) -> tuple[float, FloatArray]:
        signal = np.sin(angles + phases).sum(axis=1)
        power = np.mean(signal**8)
        gradient = 8.0 * np.mean(signal[:, None] ** 7 * np.cos(angles + phases), axis=0)
        return float(np.log(power)), gradient / power

    result = minimize(log_norm, start, jac=True, options={"maxiter": MAX_PHASE_ITERATIONS})
    return frozen(result.x)


def join_setpoints(
    manoeuvres: Sequence[Manoeuvre], autopilot: DesignedAutopilot, envelope: Envelope, n: int
) -> tuple[FloatArray, FloatArray]:
    """Return setpoints and overlays of consecutive manoeuvres of n samples each."""
    pairs = [manoeuvre.setpoints(autopilot, envelope, n) for manoeuvre in manoeuvres]
    setpoints, overlays = (np.concatenate(arrays) for arrays in zip(*pairs, strict=True))
    setpoints[:, 2] += envelope.mid_depth
    return setpoints, overlays


def candidate_manoeuvres(n_overlays: int) -> list[Manoeuvre]:
    """Return initial candidates: each shape at three speeds, on setpoints and on commands."""
    candidates = []
    for number, shape in enumerate(SHAPES):
        for index, level in enumerate((0.9, 0.5, 0.1)):
            tempo = (0.3, 0.5, 0.7)[(index + number) % 3]
            by_setpoints = (0.0, 0.5, 0.4, *([0.1] * n_overlays))
            by_overlays = (0.1, 0.2, 0.2, *([0.8, -0.8] * n_overlays)[:n_overlays])
            candidates.append(Manoeuvre(shape, level, tempo, by_setpoints))
            if index != 1:
                candidates.append(Manoeuvre(shape, level, tempo, by_overlays))
    return candidates


def baseline_manoeuvres(n_overlays: int, hovers: bool) -> list[Manoeuvre]:
    """Return a conventional campaign: steps of heading and depth in turn at three speeds.

    Of a vehicle that hovers: doublets of one command after another.
    """
    if hovers:
        strengths = (0.0, 0.0, 0.0, *([1.0] * n_overlays))
        return [Manoeuvre("doublets", 0.5, tempo, strengths) for tempo in (0.2, 0.5, 0.8)]
    directions = [(0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    levels, no_overlays = (0.9, 0.5, 0.1), (0.0,) * n_overlays
    return [
        Manoeuvre("steps", levels[k % 3], 0.1, (*directions[k % 2], *no_overlays)) for k in range(6)
    ]


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
    n_tracks = planned.states.shape[1]
    waypoints = [_waypoints(planned.select([index]), radius) for index in range(n_tracks)]
    longest = max(map(len, waypoints))
    paths = np.array([_extend(path[:, 1:], longest) for path in waypoints])
    guidance = WaypointGuidance(np.repeat(paths, simulator.n_members, axis=0), radius)
    excitation = planned.setpoints, np.zeros_like(planned.commands)
    return simulator.simulate(excitation, seed, guidance=guidance), waypoints


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
    step = (path[-1] - path[-2]) * [1.0, 1.0, 0.0, 0.0]
    return np.vstack([path, path[-1] + np.arange(1, n - len(path) + 1)[:, None] * step])


def _rotate(track: FloatArray, course: float) -> FloatArray:
    rotation = np.array([[np.cos(course), np.sin(course)], [-np.sin(course), np.cos(course)]])
    return np.asarray(track @ rotation)
