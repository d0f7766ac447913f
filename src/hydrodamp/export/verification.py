"""Verification run: open-loop simulation of an exported model with the commands of a log.

Attitude is integrated too. Engines without an integrator of their own take classical Runge-Kutta
steps of equation 1, as ``replay.c`` does.
"""

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

MAX_STEP = 0.05  # s; of a Runge-Kutta step, as in replay.c
CLOCK_TOLERANCE = 1e-6  # of a step; rounding of time stamps, as in replay.c
LEVEL_ATTITUDE = (1.0, 0.0, 0.0, 0.0)

AccelerationFunction = Callable[[States], FloatArray]


@dataclass(eq=False)
class Engine:
    """What runs exported files: their accelerations, integrated by Runge-Kutta steps."""

    name: str
    accelerations: AccelerationFunction
    max_step: float = MAX_STEP
    not_run: str = ""

    step = "Runge-Kutta, at most {:g} s"
    _state = np.zeros(10)

    def set_state(self, attitude: FloatArray, velocity: FloatArray) -> None:
        """Set the quaternion (4,) from body to world and the velocity (6,)."""
        self._state = np.concatenate([velocity, attitude])

    def advance(
        self, h: float, inputs: FloatArray, first: FloatArray, last: FloatArray
    ) -> FloatArray:
        """Take a step [s] with a wrench linear from first to last; return the velocity after it."""

        def rate(state: FloatArray, fraction: float) -> FloatArray:
            return self._derivative(state, inputs, (1.0 - fraction) * first + fraction * last)

        state = rk4_step(rate, self._state, h)
        state[6:] /= np.linalg.norm(state[6:])
        self._state = state
        return state[:6]

    def _derivative(self, state: FloatArray, inputs: FloatArray, wrench: FloatArray) -> FloatArray:
        *_, p, q, r, w, x, y, z = state.tolist()
        down = np.array([2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z])
        vector_rate = -x * p - y * q - z * r, w * p - z * q + y * r, z * p + w * q - x * r
        quaternion_rate = np.array([*vector_rate, -y * p + x * q + w * r])
        at = States(*(values[None] for values in (state[:6], down, inputs, wrench)))
        return np.concatenate([self.accelerations(at)[0], 0.5 * quaternion_rate])


class Simulator(Engine):
    """An engine with an integrator of its own; states and wrenches in hydrodamp's frame."""

    step = "steps of {:g} s"

    def __init__(self, name: str, max_step: float) -> None:
        super().__init__(name, self._evaluate_states, max_step)

    def _evaluate_states(self, at: States) -> FloatArray:
        result, attitudes = [], attitude_quaternions(at.down)
        states = zip(attitudes, at.velocity, at.inputs, at.wrench, strict=True)
        for attitude, velocity, inputs, wrench in states:
            self.set_state(attitude, velocity)
            self.apply_inputs(inputs, wrench)
            result.append(self.compute_acceleration())
        return np.array(result)

    def advance(
        self, h: float, inputs: FloatArray, first: FloatArray, last: FloatArray
    ) -> FloatArray:
        """Take a step [s] with the mean of the wrench; return the velocity after it."""
        self.apply_inputs(inputs, 0.5 * (first + last))
        return self.take_step(h)

    @abstractmethod
    def apply_inputs(self, inputs: FloatArray, wrench: FloatArray) -> None:
        """Set the inputs of the next step."""

    @abstractmethod
    def compute_acceleration(self) -> FloatArray:
        """Return the acceleration at the present state."""

    @abstractmethod
    def take_step(self, h: float) -> FloatArray:
        """Take a step [s]; return the velocity after it."""


@dataclass(frozen=True, eq=False)
class VerificationRun:
    """A plant and the log whose commands are its inputs."""

    plant: ExportedPlant
    problem: Problem
    states: States
    attitude: FloatArray  # (n, 4); each segment starts at its first

    @classmethod
    def of(cls, plant: ExportedPlant, log: Log) -> VerificationRun:
        """Return the run of a log; refuse a log without the propulsion speed if it is an input."""
        if plant.propellers:
            log = replace(log, propulsion_ratio=None)
        problem = prepare(plant.vehicle, log, plant.damping.model)
        if plant.needs_propulsion_speed and not problem.propulsion_known:
            raise ProblemError(
                f"{log.source or 'log'}: the model has terms with (eta-1), and u_c is unknown: "
                "record `eta`, give a propeller its `speed_slope`, or leave out --log."
            )
        recorded = problem.inputs
        commands = [log.command(name) for name in plant.commands]
        propulsion = recorded.propulsion[:, : plant.needs_propulsion_speed]
        inputs = np.column_stack([*commands, propulsion])
        attitude = np.tile(LEVEL_ATTITUDE, (log.n, 1)) if log.attitude is None else log.attitude
        states = States(recorded.velocity, recorded.down, inputs, recorded.wrench)
        return cls(plant, problem, states, attitude)

    @property
    def log(self) -> Log:
        """The log."""
        return self.problem.log

    def simulate_source(self) -> Trajectory:
        """Return the replay of equation 1 by hydrodamp's core."""
        return replay(self.problem, self.plant.damping, "simulated")

    def simulate_target(self, engine: Engine) -> Trajectory:
        """Return the replay of an engine, each segment from its first sample until it diverges."""
        log, states = self.log, self.states
        velocity, diverged = np.full((log.n, 6), np.nan), []
        for segment in log.segments:
            start, stop = segment.start, segment.stop
            velocity[start] = states.velocity[start]
            engine.set_state(self.attitude[start], states.velocity[start])
            title, indices = f"running the export in {engine.name}", range(start, stop - 1)
            samples = count_items(indices, title, stop - start)
            steps = (step for index in samples for step in self._steps(index, engine.max_step))
            for k, *step in steps:
                velocity[k] = engine.advance(*step)
                if not np.all(np.abs(velocity[k]) <= DIVERGENCE_LIMIT):
                    velocity[k] = np.nan
                    diverged.append((segment.name, float(log.time[k] - log.time[start])))
                    break
        return Trajectory(log, velocity, tuple(diverged), "simulated", self.plant.vehicle.axes)

    def _steps(self, k: int, max_step: float) -> Iterator[tuple[Any, ...]]:
        """Yield steps to the next sample: its index, length, inputs, wrench at start and end."""
        states, time = self.states, self.log.time
        interval = float(time[k + 1] - time[k])
        n = max(1, math.ceil(interval / max_step * (1.0 - CLOCK_TOLERANCE)))
        increment = (states.wrench[k + 1] - states.wrench[k]) / n
        for index in range(n):
            first = states.wrench[k] + index * increment
            yield k + 1, interval / n, states.inputs[k], first, first + increment


def sample_states(plant: ExportedPlant) -> States:
    """Return states that cover the operating box of a plant, of any attitude, without commands."""
    velocity = sample_box(plant.box.restrict(plant.vehicle.free))
    n, random = len(velocity), np.random.default_rng(0)
    directions = random.normal(size=(n, 3))
    return States(
        velocity,
        directions / np.linalg.norm(directions, axis=1, keepdims=True),
        np.tile([*[0.0] * len(plant.commands), *[1.0] * plant.needs_propulsion_speed], (n, 1)),
        np.zeros((n, 6)),
    )


def attitude_quaternions(down: FloatArray) -> FloatArray:
    """Return quaternions (n, 4) of which the down vectors are as given.

    Their squared norm is the norm of the down vector: interpolated vectors are not of unit length.
    """
    norm = np.linalg.norm(down, axis=1)
    x, y, z = down.T / norm
    half = np.sqrt((1.0 + np.abs(z)) / 2.0)
    roll, pitch, zero = y / (2.0 * half), x / (2.0 * half), np.zeros(len(z))
    upright = np.column_stack([half, roll, -pitch, zero])
    inverted = np.column_stack([roll, half, zero, pitch])
    unit = np.where(z[:, None] < 0.0, inverted, upright)
    return np.asarray(unit * np.sqrt(norm)[:, None])
