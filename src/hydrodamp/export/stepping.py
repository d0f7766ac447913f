"""Engines that take steps of their own: a log's commands, divided into these."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.export.craft import States
from hydrodamp.export.drive import Drive, sail
from hydrodamp.export.frames import upright
from hydrodamp.export.target import Engine


class Simulator(Protocol):
    """One vehicle in a simulator; all in hydrodamp's frame."""

    def place(self, attitude: FloatArray, velocity: FloatArray) -> None:
        """Set the state, of a quaternion from body to world and a velocity."""

    def rate(self, inputs: FloatArray, wrench: FloatArray) -> FloatArray:
        """Return the acceleration there."""

    def advance(self, length: float, inputs: FloatArray, wrench: FloatArray) -> FloatArray:
        """Take one step [s], and return the velocity after it."""


def stepped(simulator: Simulator, name: str, step: float, kind: str = "") -> Engine:
    """Return the engine of a simulator, in steps of at most so many seconds and of a kind."""

    def rates(at: States) -> FloatArray:
        found = []
        for attitude, velocity, inputs, wrench in zip(
            upright(at.down), at.velocity, at.inputs, at.wrench, strict=True
        ):
            simulator.place(attitude, velocity)
            found.append(simulator.rate(inputs, wrench))
        return np.array(found)

    def advance(
        length: float, inputs: FloatArray, first: FloatArray, last: FloatArray
    ) -> FloatArray:
        return simulator.advance(length, inputs, 0.5 * (first + last))

    def replay(drive: Drive) -> FloatArray:
        return sail(drive, f" in {name}", step, simulator.place, advance)

    return Engine(name, f"{kind}steps of {step:g} s", rates, replay)
