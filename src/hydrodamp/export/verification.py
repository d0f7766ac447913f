"""What drives a written model: a log's commands, open loop, its attitude integrated too."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.log import Log
from hydrodamp.errors import ProblemError
from hydrodamp.export.plant import ExportedPlant, States
from hydrodamp.identification.dissipativity import sample_box
from hydrodamp.progress import count_items
from hydrodamp.simulation.closed_loop import rk4_step
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.simulation.replay import DIVERGENCE_LIMIT, Trajectory, replay

LONGEST_STEP = 0.05
"""No Runge-Kutta step is longer [s]: as in replays."""

Rates = Callable[[States], FloatArray]

_SLACK = 1e-6  # clocks round: as in replay.c
_LEVEL = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class VerificationRun:
    """A craft and the log that drives it."""

    craft: ExportedPlant
    problem: Problem
    states: States
    attitude: FloatArray  # (n, 4), of which each segment takes its first

    @classmethod
    def of(cls, craft: ExportedPlant, log: Log) -> VerificationRun:
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

    def target(self, engine: Engine) -> Trajectory:
        """Return what an engine gives, each segment from its start until it diverges."""
        log, given = self.log, self.states
        velocity, ended = np.full((log.n, 6), np.nan), []
        for part in log.segments:
            velocity[part.start] = given.velocity[part.start]
            engine.set_state(self.attitude[part.start], given.velocity[part.start])
            label = f"running what was written in {engine.name}"
            between = count_items(range(part.start, part.stop - 1), label, part.stop - part.start)
            for after, *step in (each for k in between for each in self._steps(k, engine.longest)):
                velocity[after] = engine.advance(*step)
                if not np.all(np.abs(velocity[after]) <= DIVERGENCE_LIMIT):
                    velocity[after] = np.nan
                    ended.append((part.name, float(log.time[after] - log.time[part.start])))
                    break
        return Trajectory(log, velocity, tuple(ended), "simulated", self.craft.vehicle.axes)

    def _steps(self, k: int, longest: float) -> Iterator[tuple[Any, ...]]:
        """Yield the steps to the next sample: that, length, inputs, the wrench at both ends."""
        given, time = self.states, self.log.time
        length = float(time[k + 1] - time[k])
        steps = max(1, math.ceil(length / longest * (1.0 - _SLACK)))
        rise = (given.wrench[k + 1] - given.wrench[k]) / steps
        for index in range(steps):
            first = given.wrench[k] + index * rise
            yield k + 1, length / steps, given.inputs[k], first, first + rise


def scattered(craft: ExportedPlant) -> States:
    """Return states all over the craft's box, upright and not, without commands."""
    velocity = sample_box(craft.box.restrict(craft.vehicle.free))
    n, random = len(velocity), np.random.default_rng(0)
    directions = random.normal(size=(n, 3))
    return States(
        velocity,
        directions / np.linalg.norm(directions, axis=1, keepdims=True),
        np.tile([*[0.0] * len(craft.commands), *[1.0] * craft.needs_speed], (n, 1)),
        np.zeros((n, 6)),
    )


def upright(down: FloatArray) -> FloatArray:
    """Return quaternions, shape (n, 4), of which the world's down direction is as given.

    Their length is the root of the direction's: between two samples neither is one.
    """
    length = np.linalg.norm(down, axis=1)
    x, y, z = down.T / length
    half = np.sqrt((1.0 + np.abs(z)) / 2.0)
    across, along, none = y / (2.0 * half), x / (2.0 * half), np.zeros(len(z))
    upwards = np.column_stack([half, across, -along, none])
    downwards = np.column_stack([across, half, none, along])
    unit = np.where(z[:, None] < 0.0, downwards, upwards)
    return np.asarray(unit * np.sqrt(length)[:, None])


class Engine:
    """What was written, read back and ready to run: its accelerations, in steps as replay.c's."""

    step = "Runge-Kutta, at most {:g} s"

    def __init__(
        self, name: str, rates: Rates, longest: float = LONGEST_STEP, not_run: str = ""
    ) -> None:
        self.name, self.rates, self.longest, self.not_run = name, rates, longest, not_run
        self._state = np.zeros(10)

    def set_state(self, attitude: FloatArray, velocity: FloatArray) -> None:
        """Set the state, of a quaternion from body to world and a velocity."""
        self._state = np.concatenate([velocity, attitude])

    def advance(
        self, h: float, inputs: FloatArray, first: FloatArray, last: FloatArray
    ) -> FloatArray:
        """Take a step [s] with the wrench at both its ends, and return the velocity after it."""
        state = rk4_step(
            lambda state, fraction: self._slope(
                state, inputs, (1.0 - fraction) * first + fraction * last
            ),
            self._state,
            h,
        )
        state[6:] /= np.linalg.norm(state[6:])
        self._state = state
        return state[:6]

    def _slope(self, state: FloatArray, inputs: FloatArray, wrench: FloatArray) -> FloatArray:
        *_, p, q, r, w, x, y, z = state.tolist()
        down = np.array([2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z])
        turning = -x * p - y * q - z * r, w * p - z * q + y * r, z * p + w * q - x * r
        rolling = np.array([*turning, -y * p + x * q + w * r])
        at = States(*(each[None] for each in (state[:6], down, inputs, wrench)))
        return np.concatenate([self.rates(at)[0], 0.5 * rolling])


class Simulator(Engine):
    """One vehicle in a simulator that takes steps of its own; all in hydrodamp's frame."""

    step = "steps of {:g} s"

    def __init__(self, name: str, longest: float) -> None:
        super().__init__(name, self._each, longest)

    def _each(self, at: States) -> FloatArray:
        found = []
        for attitude, velocity, inputs, wrench in zip(
            upright(at.down), at.velocity, at.inputs, at.wrench, strict=True
        ):
            self.set_state(attitude, velocity)
            self.push(inputs, wrench)
            found.append(self.acceleration())
        return np.array(found)

    def advance(
        self, h: float, inputs: FloatArray, first: FloatArray, last: FloatArray
    ) -> FloatArray:
        """Take a step [s] with the mean of the wrench, and return the velocity after it."""
        self.push(inputs, 0.5 * (first + last))
        return self.move(h)

    @abstractmethod
    def push(self, inputs: FloatArray, wrench: FloatArray) -> None:
        """Set what drives it until the next time."""

    @abstractmethod
    def acceleration(self) -> FloatArray:
        """Return the acceleration where it is."""

    @abstractmethod
    def move(self, h: float) -> FloatArray:
        """Take a step [s], and return the velocity after it."""
