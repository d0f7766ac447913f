"""A motion beside the recorded one: velocities, and a small turn of each attitude."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data import attitude as attitudes
from hydrodamp.kernels.inputs import Inputs
from hydrodamp.simulation.problem import Problem


@dataclass(frozen=True, eq=False)
class Track:
    """What a smoother takes the motion to have been."""

    velocity: FloatArray
    turn: FloatArray

    @classmethod
    def recorded(cls, problem: Problem) -> Track:
        """Return the motion as it was recorded."""
        return cls(problem.inputs.velocity, np.zeros((problem.n_samples, 3)))

    def attitude(self, problem: Problem) -> FloatArray | None:
        """Return the attitude."""
        recorded = problem.log.attitude
        return None if recorded is None else turned(recorded, self.turn)

    def inputs(self, problem: Problem) -> Inputs:
        """Return what drives the plant along this motion."""
        pose = self.attitude(problem)
        down = problem.inputs.down if pose is None else attitudes.down(pose)
        return replace(problem.inputs, velocity=self.velocity, down=down)


def turned(attitude: FloatArray, turn: FloatArray) -> FloatArray:
    """Return attitudes turned about body axes."""
    angle = np.linalg.norm(turn, axis=1, keepdims=True)
    w, v = attitude[:, :1], attitude[:, 1:]
    cosine, half = np.cos(angle / 2), np.sinc(angle / (2 * np.pi)) * turn / 2
    scalar = w * cosine - np.sum(v * half, axis=1, keepdims=True)
    return np.hstack([scalar, w * half + cosine * v + np.cross(v, half)])
