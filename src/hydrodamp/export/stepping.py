"""Engines that take steps of their own: a log's commands, divided into these."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.export.craft import States
from hydrodamp.export.drive import Drive
from hydrodamp.export.frames import upright
from hydrodamp.export.target import Engine
from hydrodamp.progress import progress
from hydrodamp.simulation.replay import LIMIT

_SLACK = 1e-6  # clocks round: as in replay.c


class Simulator(Protocol):
    """One vehicle in a simulator; all in hydrodamp's frame."""

    def place(self, attitude: FloatArray, velocity: FloatArray) -> None:
        """Set the state, of a quaternion from body to world and a velocity."""

    def rate(self, inputs: FloatArray, wrench: FloatArray) -> FloatArray:
        """Return the acceleration there."""

    def advance(self, length: float, inputs: FloatArray, wrench: FloatArray) -> FloatArray:
        """Take one step [s], and return the velocity after it."""


def stepped(simulator: Simulator, name: str, step: float) -> Engine:
    """Return the engine of a simulator, in steps of at most so many seconds."""

    def rates(at: States) -> FloatArray:
        found = []
        for attitude, velocity, inputs, wrench in zip(
            upright(at.down), at.velocity, at.inputs, at.wrench, strict=True
        ):
            simulator.place(attitude, velocity)
            found.append(simulator.rate(inputs, wrench))
        return np.array(found)

    def replay(drive: Drive) -> FloatArray:
        log, given = drive.log, drive.states
        velocity = np.full((log.n, 6), np.nan)
        with progress(f"running what was written in {name}", log.n) as tick:
            for part in log.segments:
                now = velocity[part.start] = given.velocity[part.start]
                simulator.place(drive.attitude[part.start], now)
                for k in range(part.start, part.stop - 1):
                    now = after(drive, k)
                    if not np.all(np.abs(now) <= LIMIT):
                        break
                    velocity[k + 1] = now
                    tick()
        return velocity

    def after(drive: Drive, k: int) -> FloatArray:
        """Return the velocity at the sample after ``k``, or where it went beyond the limit."""
        given, time = drive.states, drive.log.time
        length = float(time[k + 1] - time[k])
        steps = math.ceil(length / step - _SLACK)
        for share in ((np.arange(steps) + 0.5) / steps).tolist():
            wrench = (1.0 - share) * given.wrench[k] + share * given.wrench[k + 1]
            velocity = simulator.advance(length / steps, given.inputs[k], wrench)
            if not np.all(np.abs(velocity) <= LIMIT):
                break
        return velocity

    return Engine(name, f"steps of {step:g} s", rates, replay)
