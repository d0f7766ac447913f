"""What drives a written model: a log's commands, open loop, its attitude integrated too."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.log import Log
from hydrodamp.errors import ProblemError
from hydrodamp.export.craft import Craft, States
from hydrodamp.identification.power import spread
from hydrodamp.progress import progress
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.simulation.replay import LIMIT, Trajectory, replay

#: Of one state: velocity, down, inputs and wrench; its acceleration.
Rate = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]

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


def integrate(rate: Rate, drive: Drive) -> FloatArray:
    """Integrate a rate over the log as replay.c does; NaN from where a segment diverged."""
    log, given = drive.log, drive.states
    velocity = np.full((log.n, 6), np.nan)
    with progress("running what was written", log.n) as step:
        for part in log.segments:
            state = np.concatenate([given.velocity[part.start], drive.attitude[part.start]])
            velocity[part.start] = state[:6]
            for k in range(part.start, part.stop - 1):
                state = _between(rate, drive, k, state)
                if not np.all(np.abs(state[:6]) <= LIMIT):
                    break
                velocity[k + 1] = state[:6]
                step()
    return velocity


def _between(rate: Rate, drive: Drive, k: int, state: FloatArray) -> FloatArray:
    """Return the state at the sample after ``k``."""
    given, time = drive.states, drive.log.time
    length = float(time[k + 1] - time[k])
    steps = max(1, math.ceil(length / LONGEST_STEP * (1.0 - _SLACK)))
    h, wrench, rise = length / steps, given.wrench[k], given.wrench[k + 1] - given.wrench[k]
    held = given.inputs[k]

    def slope(state: FloatArray, share: float) -> FloatArray:
        *_, p, q, r, w, x, y, z = state.tolist()
        south = np.array([2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z])
        turning = -x * p - y * q - z * r, w * p - z * q + y * r, z * p + w * q - x * r
        rolling = np.array([*turning, -y * p + x * q + w * r])
        acceleration = rate(state[:6], south, held, wrench + share * rise)
        return np.concatenate([acceleration, 0.5 * rolling])

    for index in range(steps):
        first = slope(state, index / steps)
        middle = slope(state + 0.5 * h * first, (index + 0.5) / steps)
        again = slope(state + 0.5 * h * middle, (index + 0.5) / steps)
        last = slope(state + h * again, (index + 1.0) / steps)
        state = state + h / 6.0 * (first + 2.0 * middle + 2.0 * again + last)
        state[6:] /= np.linalg.norm(state[6:])
    return state
