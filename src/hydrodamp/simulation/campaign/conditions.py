"""Conditions of the campaign of section V-B: sensor noise, published autopilot, and its runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.simulation.autopilot import FIN_LIMIT, Autopilot, Loop, Pid

SENSOR_CHANNELS = ("u", "v", "w", "p", "q", "r", "roll", "pitch", "yaw", "depth")
"""Measured channels, in the order of the noise's last axis."""

SENSOR_VARIANCES = (1.764e-4,) * 3 + (7.615e-7,) * 3 + (5.898e-9,) * 3 + (1e-3,)
"""Noise variance of each channel [(m/s)^2, (rad/s)^2, rad^2, m^2]."""

COMMAND_PERIOD = 0.1
"""Time between two commands, held in between [s]."""

DEPTH_LOOP = Pid(-0.07, -0.001, 0.095)
"""From the depth error [m] to the pitch setpoint [rad]."""

PITCH_LOOP = Pid(4.5, 0.2, 7.0)
"""From the pitch error [rad] to the elevator [rad]."""

YAW_LOOP = Pid(3.0, 0.005, 3.0)
"""From the heading error [rad] to the opposite of the rudder [rad]."""

DEPTH_WINDOW = 5.0
"""Time over which depths are differenced for the depth rate [s]."""


def fin_autopilot(depth: Pid, pitch: Pid, yaw: Pid) -> Autopilot:
    """Return the autopilot of a vehicle with rudder and elevator."""
    limit = np.full(2, FIN_LIMIT)
    return Autopilot(
        *(("rudder", "elevator"), -limit, limit, np.full(2, np.inf)),
        heading=Loop(yaw, 0, -1.0),
        pitch=Loop(pitch, 1, 1.0),
        depth=Loop(depth, 1, 1.0),
        depth_window=DEPTH_WINDOW,
    )


PUBLISHED_AUTOPILOT = fin_autopilot(DEPTH_LOOP, PITCH_LOOP, YAW_LOOP)
"""The autopilot of the VT 690."""

FIRST_STEP = 5.0
"""Time of the first step of every run [s]."""

HEADING_STEPS = (60.0, -90.0, 120.0, -100.0, 70.0, -120.0, 90.0, -60.0, 100.0, -70.0)
"""Changes of the heading setpoint [deg]; their sum is zero."""

DEPTH_STEPS = (3.0, -4.0, 5.0, -4.0, 3.5, -5.0, 4.5, -3.0)
"""Changes of the depth setpoint [m]; their sum is zero."""

HEADING_HOLDS = (25.0, 20.0, 22.0, 24.0, 21.0, 23.0, 25.0)
"""Time from a heading step to the next [s]."""

DEPTH_HOLDS = (16.0, 14.0, 17.0, 15.0, 18.0, 14.0, 16.0)
"""Time from a depth step to the next [s]."""


@dataclass(frozen=True)
class StepSequence:
    """Setpoints that start from zero and change in steps; changes and holds repeat."""

    changes: tuple[float, ...]
    holds: tuple[float, ...]
    first: float = FIRST_STEP

    @classmethod
    def starting_at(
        cls, changes: tuple[float, ...], holds: tuple[float, ...], index: int
    ) -> StepSequence:
        """Return the sequence that begins with one of the changes."""
        return cls(changes[index:] + changes[:index], holds[index:] + holds[:index])

    def values(self, time: FloatArray) -> FloatArray:
        """Return the setpoints at some times [s]."""
        count = 2 + int(np.max(time) / min(self.holds))
        starts = self.first + np.cumsum([0.0, *np.resize(self.holds, count - 1)])
        levels = np.concatenate(([0.0], np.cumsum(np.resize(self.changes, count))))
        return levels[np.searchsorted(starts, time, side="right")]


CONSTANT = StepSequence((0.0,), HEADING_HOLDS)
"""A setpoint that does not change."""


@dataclass(frozen=True)
class Run:
    """A run: a propeller speed [1/min], and setpoints of heading [deg] and depth [m]."""

    name: str
    rpm: float
    heading: StepSequence = CONSTANT
    depth: StepSequence = CONSTANT


def _heading_run(rpm: float, first_step: int) -> Run:
    heading = StepSequence.starting_at(HEADING_STEPS, HEADING_HOLDS, first_step)
    return Run(f"yaw-{rpm:.0f}", rpm, heading=heading)


def _depth_run(rpm: float, first_step: int) -> Run:
    depth = StepSequence.starting_at(DEPTH_STEPS, DEPTH_HOLDS, first_step)
    return Run(f"depth-{rpm:.0f}", rpm, depth=depth)


TRAINING_RUNS = (
    *(_depth_run(2600.0, 0), _heading_run(1800.0, 0)),
    *(_heading_run(2133.0, 2), _heading_run(2600.0, 4)),
)
"""The estimation runs of section V-B, in its order."""

TEST_RUNS = (_depth_run(2133.0, 3), _heading_run(2350.0, 5))
"""The validation runs of section V-B, in its order."""


@dataclass(frozen=True)
class Conditions:
    """White noise of the sensors, and no disturbance wrench.

    Every run has its own random streams, spawned from the seed: a change of the number of runs
    or of their length leaves the first samples of each run unchanged.

    Attributes
    ----------
    scale : float
        Factor on the published standard deviations of the noise; 0 for none.
    """

    scale: float = 1.0

    def sample_sensor_errors(
        self, seed: int, n_runs: int, n_samples: int, period: float = COMMAND_PERIOD
    ) -> FloatArray:
        """Return the error of every sensor in every run.

        Parameters
        ----------
        seed : int
            Seed of the campaign, 0 or more.
        n_runs, n_samples : int
            Number of runs and of samples.
        period : float, optional
            Time from one sample to the next [s].

        Returns
        -------
        errors : ndarray, shape (n_samples, n_runs, 10)
            In the order of ``CHANNELS`` [m/s, rad/s, rad, m].

        Examples
        --------
        >>> WHITE_NOISE.sample_sensor_errors(0, n_runs=6, n_samples=50).shape
        (50, 6, 10)
        """
        return sample_normal(seed, n_runs, n_samples, len(SENSOR_CHANNELS)) * (
            self.scale * np.sqrt(SENSOR_VARIANCES)
        )

    def sample_disturbances(
        self, seed: int, n_runs: int, n_samples: int, period: float = COMMAND_PERIOD
    ) -> FloatArray:
        """Return the disturbance wrench in every run, shape (n_samples, n_runs, 6)."""
        return np.zeros((n_samples, n_runs, 6))


def sample_normal(
    seed: int, n_runs: int, n_samples: int, n_columns: int, *stream: int
) -> FloatArray:
    """Return normal random numbers, a stream for each run, (n_samples, n_runs, n_columns)."""
    keys = [np.random.SeedSequence(seed, spawn_key=(run, *stream)) for run in range(n_runs)]
    samples = [np.random.default_rng(key).standard_normal((n_samples, n_columns)) for key in keys]
    return np.stack(samples, axis=1)


WHITE_NOISE = Conditions()
"""The published noise without disturbances."""
