"""The published autopilot of the VT 690: three PID loops at 10 Hz."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray

PERIOD = 0.1
"""Time between two commands, held in between [s]."""


@dataclass(frozen=True)
class Pid:
    """One loop, for any number of vehicles side by side."""

    proportional: float
    integral: float
    derivative: float
    integral_limit: float = float(np.radians(5.0))
    output_limit: float = float(np.radians(20.0))

    def step(
        self, error: FloatArray, rate: FloatArray, total: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the output and the integral of the error after this sample."""
        grown = total + error * PERIOD
        term = self.integral * grown
        held = np.clip(term, -self.integral_limit, self.integral_limit)
        wanted = self.proportional * error + held - self.derivative * rate
        output = np.clip(wanted, -self.output_limit, self.output_limit)
        free = (term == held) & (wanted == output)
        return output, np.where(free, grown, total)


DEPTH_LOOP = Pid(-0.07, -0.001, 0.095)
"""From the error of depth [m] to the pitch wanted [rad]."""

PITCH_LOOP = Pid(4.5, 0.2, 7.0)
"""From the error of pitch [rad] to the elevator [rad]."""

YAW_LOOP = Pid(3.0, 0.005, 3.0)
"""From the error of heading [rad] to the opposite of the rudder [rad]."""

N_DEPTHS = 51
"""How many depths the depth rate is taken from: 50 differences, 5 s."""


@dataclass(frozen=True)
class Memory:
    """What the autopilot keeps from one sample to the next."""

    totals: FloatArray
    depths: FloatArray

    @classmethod
    def blank(cls, n_vehicles: int) -> Memory:
        """Return the memory before the first sample."""
        return cls(np.zeros((3, n_vehicles)), np.empty((0, n_vehicles)))

    @property
    def depth_rate(self) -> FloatArray:
        """Mean rate of the depths remembered, shape (n,) [m/s]."""
        spans = max(len(self.depths) - 1, 1)
        rate: FloatArray = (self.depths[-1] - self.depths[0]) / (spans * PERIOD)
        return rate


def steer(
    measured: FloatArray, heading: FloatArray, depth: FloatArray, memory: Memory
) -> tuple[FloatArray, Memory]:
    """Return the fin commands for one sample."""
    (q, r), (pitch, yaw), sunk = measured[:, 4:6].T, measured[:, 7:9].T, measured[:, 9]
    depths = np.concatenate((memory.depths, sunk[np.newaxis]))[-N_DEPTHS:]
    rate = Memory(memory.totals, depths).depth_rate
    wanted, sinking = DEPTH_LOOP.step(depth - sunk, rate, memory.totals[0])
    elevator, pitching = PITCH_LOOP.step(wanted - pitch, q, memory.totals[1])
    starboard, turning = YAW_LOOP.step(heading - yaw, r, memory.totals[2])
    totals = np.array((sinking, pitching, turning))
    return np.array((-starboard, elevator)).T, Memory(totals, depths)
