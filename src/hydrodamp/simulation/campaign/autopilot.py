"""The published autopilot of the VT 690, three PID loops at 10 Hz, and the runs it steers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray

COMMAND_PERIOD = 0.1
"""Time between two commands, held in between [s]."""

INTEGRAL_LIMIT = float(np.radians(5.0))
"""Largest part of the integral in the output of a loop [rad]."""

FIN_LIMIT = float(np.radians(20.0))
"""Largest output of a loop [rad]."""


@dataclass(frozen=True)
class Pid:
    """One loop, for any number of vehicles side by side."""

    proportional: float
    integral: float
    derivative: float
    limit: float = FIN_LIMIT

    def step(
        self, error: FloatArray, rate: FloatArray, total: FloatArray, period: float = COMMAND_PERIOD
    ) -> tuple[FloatArray, FloatArray]:
        """Return the output and the integral of the error after this sample."""
        grown = total + error * period
        term = self.integral * grown
        most = INTEGRAL_LIMIT / FIN_LIMIT * self.limit
        held = np.clip(term, -most, most)
        wanted = self.proportional * error + held - self.derivative * rate
        output = np.clip(wanted, -self.limit, self.limit)
        free = (term == held) & (wanted == output)
        return output, np.where(free, grown, total)


DEPTH_LOOP = Pid(-0.07, -0.001, 0.095)
"""From the error of depth [m] to the pitch wanted [rad]."""

PITCH_LOOP = Pid(4.5, 0.2, 7.0)
"""From the error of pitch [rad] to the elevator [rad]."""

YAW_LOOP = Pid(3.0, 0.005, 3.0)
"""From the error of heading [rad] to the opposite of the rudder [rad]."""

DEPTH_MEMORY = 5.0
"""Time over which the depth rate is taken [s]."""


@dataclass(frozen=True)
class Memory:
    """What the autopilot keeps from one sample to the next."""

    totals: FloatArray
    depths: FloatArray

    @classmethod
    def blank(cls, n_vehicles: int) -> Memory:
        """Return the memory before the first sample."""
        return cls(np.zeros((3, n_vehicles)), np.empty((0, n_vehicles)))


@dataclass(frozen=True)
class Autopilot:
    """Three loops and the time between two commands [s]; the published ones by default."""

    depth: Pid = DEPTH_LOOP
    pitch: Pid = PITCH_LOOP
    yaw: Pid = YAW_LOOP
    period: float = COMMAND_PERIOD

    def steer(
        self, measured: FloatArray, heading: FloatArray, depth: FloatArray, memory: Memory
    ) -> tuple[FloatArray, Memory]:
        """Return the fin commands for one sample."""
        (q, r), (pitch, yaw), sunk = measured[:, 4:6].T, measured[:, 7:9].T, measured[:, 9]
        remembered = round(DEPTH_MEMORY / self.period) + 1
        depths = np.concatenate((memory.depths, sunk[np.newaxis]))[-remembered:]
        rate = (depths[-1] - depths[0]) / (max(len(depths) - 1, 1) * self.period)
        totals, every = memory.totals, self.period
        wanted, sinking = self.depth.step(depth - sunk, rate, totals[0], every)
        elevator, pitching = self.pitch.step(wanted - pitch, q, totals[1], every)
        starboard, turning = self.yaw.step(heading - yaw, r, totals[2], every)
        totals = np.array((sinking, pitching, turning))
        return np.array((-starboard, elevator)).T, Memory(totals, depths)


PUBLISHED_AUTOPILOT = Autopilot()
"""The autopilot of the VT 690."""

FIRST_STEP = 5.0
"""Time of the first step of every run [s]."""

HEADING_STEPS = (60.0, -90.0, 120.0, -100.0, 70.0, -120.0, 90.0, -60.0, 100.0, -70.0)
"""Changes of the heading wanted [deg]; they add up to zero."""

DEPTH_STEPS = (3.0, -4.0, 5.0, -4.0, 3.5, -5.0, 4.5, -3.0)
"""Changes of the depth wanted [m]; they add up to zero."""

HEADING_HOLDS = (25.0, 20.0, 22.0, 24.0, 21.0, 23.0, 25.0)
"""Time from a heading step to the next [s]."""

DEPTH_HOLDS = (16.0, 14.0, 17.0, 15.0, 18.0, 14.0, 16.0)
"""Time from a depth step to the next [s]."""


@dataclass(frozen=True)
class StepSequence:
    """A staircase of reference values that starts from zero and repeats."""

    changes: tuple[float, ...]
    holds: tuple[float, ...]
    first: float = FIRST_STEP

    def values(self, time: FloatArray) -> FloatArray:
        """Return the reference at the times given."""
        count = 2 + int(np.max(time) / min(self.holds))
        starts = self.first + np.cumsum([0.0, *np.resize(self.holds, count - 1)])
        levels = np.concatenate(([0.0], np.cumsum(np.resize(self.changes, count))))
        return levels[np.searchsorted(starts, time, side="right")]


STEADY = StepSequence((0.0,), HEADING_HOLDS)
"""No step at all: hold what there is."""


@dataclass(frozen=True)
class Run:
    """One run: a propeller speed, and what the autopilot is asked for."""

    name: str
    rpm: float
    heading: StepSequence = STEADY
    depth: StepSequence = STEADY


def _steps(changes: tuple[float, ...], holds: tuple[float, ...], place: int) -> StepSequence:
    """Return a staircase that begins at one of its steps."""
    return StepSequence(changes[place:] + changes[:place], holds[place:] + holds[:place])


TRAINING_RUNS = (
    Run("depth-2600", 2600.0, depth=_steps(DEPTH_STEPS, DEPTH_HOLDS, 0)),
    Run("yaw-1800", 1800.0, heading=_steps(HEADING_STEPS, HEADING_HOLDS, 0)),
    Run("yaw-2133", 2133.0, heading=_steps(HEADING_STEPS, HEADING_HOLDS, 2)),
    Run("yaw-2600", 2600.0, heading=_steps(HEADING_STEPS, HEADING_HOLDS, 4)),
)
"""The estimation runs of section V-B, in its order."""

TEST_RUNS = (
    Run("depth-2133", 2133.0, depth=_steps(DEPTH_STEPS, DEPTH_HOLDS, 3)),
    Run("yaw-2350", 2350.0, heading=_steps(HEADING_STEPS, HEADING_HOLDS, 5)),
)
"""The validation runs of section V-B, in its order."""
