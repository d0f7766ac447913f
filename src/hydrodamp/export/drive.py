"""What drives a written model: a log's commands, open loop, its attitude integrated too."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.log import Log
from hydrodamp.errors import ProblemError
from hydrodamp.export.craft import Craft, States
from hydrodamp.identification.power import spread
from hydrodamp.progress import counted
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.simulation.replay import LIMIT, Trajectory, replay

#: Of one state: velocity, down, inputs and wrench; its acceleration.
Rate = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]

#: Set a state, of a quaternion from body to world and a velocity; and take one step [s] with some
#: inputs and the wrench at both its ends, to the velocity after it.
Place = Callable[[FloatArray, FloatArray], None]
Advance = Callable[[float, FloatArray, FloatArray, FloatArray], FloatArray]

LONGEST_STEP = 0.05
"""No Runge-Kutta step is longer [s]: as in replays."""

_SLACK = 1e-6  # clocks round: as in replay.c
_LEVEL = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Drive:
    """A craft and the log that drives it."""

    craft: Craft
    problem: Problem
    states: States
    attitude: FloatArray  # (n, 4), of which each segment takes its first

    @classmethod
    def of(cls, craft: Craft, log: Log) -> Drive:
        """Return the drive of a log, or refuse it with what it lacks."""
        if craft.propellers:
            log = replace(log, propulsion_ratio=None)
        problem = prepare(craft.vehicle, log, craft.damping.model)
        if craft.needs_speed and not problem.propulsion_known:
            raise ProblemError(
                f"{log.source or 'log'}: terms with (eta-1) are exported, and nothing says what "
                "u_c is: record `eta`, give a propeller its `speed_slope`, or leave out --log."
            )
        given = problem.inputs
        held = [log.command(name) for name in craft.commands]
        inputs = np.column_stack([*held, given.propulsion[:, : craft.needs_speed]])
        recorded = np.tile(_LEVEL, (log.n, 1)) if log.attitude is None else log.attitude
        states = States(given.velocity, given.down, inputs, given.wrench)
        return cls(craft, problem, states, recorded)

    @property
    def log(self) -> Log:
        """The log."""
        return self.problem.log

    def source(self) -> Trajectory:
        """Return what equation 1 gives, by hydrodamp's own core."""
        return replay(self.problem, self.craft.damping, "simulated")

    def trajectory(self, velocity: FloatArray) -> Trajectory:
        """Return what a target made of the log as a trajectory; beyond the limit it diverged."""
        kept, ended = np.array(velocity), []
        for part in self.log.segments:
            bad = ~np.all(np.abs(kept[part.start : part.stop]) <= LIMIT, axis=1)
            if bad.any():
                first = part.start + int(np.argmax(bad))
                kept[first : part.stop] = np.nan
                ended.append((part.name, float(self.log.time[first] - self.log.time[part.start])))
        return Trajectory(self.log, kept, tuple(ended), "simulated", self.craft.vehicle.axes)


def scattered(craft: Craft) -> States:
    """Return states all over the craft's box, upright and not, without commands."""
    velocity = spread(craft.box.restricted(craft.vehicle.free))
    n, random = len(velocity), np.random.default_rng(0)
    directions = random.normal(size=(n, 3))
    return States(
        velocity,
        directions / np.linalg.norm(directions, axis=1, keepdims=True),
        np.tile([*[0.0] * len(craft.commands), *[1.0] * craft.needs_speed], (n, 1)),
        np.zeros((n, 6)),
    )


def sail(drive: Drive, by: str, longest: float, place: Place, advance: Advance) -> FloatArray:
    """Return the velocities of what advances from its place at the start of each segment.

    No step is longer than so many seconds; NaN from where a segment diverged.
    """
    log, given = drive.log, drive.states
    velocity = np.full((log.n, 6), np.nan)
    for part in log.segments:
        velocity[part.start] = given.velocity[part.start]
        place(drive.attitude[part.start], given.velocity[part.start])
        label = f"running what was written{by}"
        between = counted(range(part.start, part.stop - 1), label, part.stop - part.start)
        for after, *step in (each for k in between for each in _steps(drive, k, longest)):
            velocity[after] = advance(*step)
            if not np.all(np.abs(velocity[after]) <= LIMIT):
                velocity[after] = np.nan
                break
    return velocity


def _steps(drive: Drive, k: int, longest: float) -> Iterator[tuple[Any, ...]]:
    """Yield the steps to the sample after ``k``: that, length, inputs, the wrench at both ends."""
    given, time = drive.states, drive.log.time
    length = float(time[k + 1] - time[k])
    steps = max(1, math.ceil(length / longest * (1.0 - _SLACK)))
    rise = (given.wrench[k + 1] - given.wrench[k]) / steps
    for index in range(steps):
        first = given.wrench[k] + index * rise
        yield k + 1, length / steps, given.inputs[k], first, first + rise


class RungeKutta:
    """Steps as replay.c takes them, of a rate."""

    def __init__(self, rate: Rate) -> None:
        self._rate, self._state = rate, np.zeros(10)

    def place(self, attitude: FloatArray, velocity: FloatArray) -> None:
        """Set the state."""
        self._state = np.concatenate([velocity, attitude])

    def advance(
        self, h: float, inputs: FloatArray, first: FloatArray, last: FloatArray
    ) -> FloatArray:
        """Take one step, and return the velocity after it."""
        middle, state = 0.5 * (first + last), self._state
        a = self._slope(state, inputs, first)
        b = self._slope(state + 0.5 * h * a, inputs, middle)
        c = self._slope(state + 0.5 * h * b, inputs, middle)
        d = self._slope(state + h * c, inputs, last)
        state = state + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        state[6:] /= np.linalg.norm(state[6:])
        self._state = state
        return state[:6]

    def _slope(self, state: FloatArray, inputs: FloatArray, wrench: FloatArray) -> FloatArray:
        *_, p, q, r, w, x, y, z = state.tolist()
        down = np.array([2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z])
        turning = -x * p - y * q - z * r, w * p - z * q + y * r, z * p + w * q - x * r
        rolling = np.array([*turning, -y * p + x * q + w * r])
        return np.concatenate([self._rate(state[:6], down, inputs, wrench), 0.5 * rolling])
