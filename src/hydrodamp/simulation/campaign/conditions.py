"""Conditions of the campaign of section V-B: noise, autopilot, runs and true hydrodynamics.

The truth is the published coefficients, or strip theory for the crossflow: with strips at x_k and
crossflow velocities v + x_k r and w - x_k q, the drag of strip k is
-d_k |v + x_k r| (v + x_k r), and likewise for heave; its moments are about the origin.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.models.catalog import published
from hydrodamp.models.damping import Damping
from hydrodamp.simulation.closed_loop import FIN_LIMIT, Autopilot, Loop, Pid
from hydrodamp.vehicle.vehicle import Vehicle

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


def heading_run(rpm: float, first_step: int) -> Run:
    """Return a run with steps of heading, from one of the sequence on."""
    heading = StepSequence.starting_at(HEADING_STEPS, HEADING_HOLDS, first_step)
    return Run(f"yaw-{rpm:.0f}", rpm, heading=heading)


def depth_run(rpm: float, first_step: int) -> Run:
    """Return a run with steps of depth, from one of the sequence on."""
    depth = StepSequence.starting_at(DEPTH_STEPS, DEPTH_HOLDS, first_step)
    return Run(f"depth-{rpm:.0f}", rpm, depth=depth)


TRAINING_RUNS = (
    *(depth_run(2600.0, 0), heading_run(1800.0, 0)),
    *(heading_run(2133.0, 2), heading_run(2600.0, 4)),
)
"""The estimation runs of section V-B, in its order."""

TEST_RUNS = (depth_run(2133.0, 3), heading_run(2350.0, 5))
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

DRIFT_FACTOR = 0.178
"""Ratio of a fin's inflow angle to the drift angle; published for the rudder."""

FIN_LAG = 0.05
"""Time constant of the fins of the crossflow truth [s]; assumed."""

CROSSFLOW_DRAG = (
    *("Y_v|v|", "Y_r|r|", "N_v|v|", "N_r|r|"),
    *("Z_w|w|", "Z_q|q|", "M_w|w|", "M_q|q|"),
)
"""Coefficients that the strips replace."""

SNAME_NOTE = (
    "The published hydrodynamics of the VT 690 (SNAME T&R Bulletin 1-45, 2022; heave and "
    "pitch from the same laboratory's own simulation): Prestero's terms plus K_up, none of "
    "the eight models to the letter, but nearest to Prestero's."
)

CROSSFLOW_NOTE = (
    "The published hydrodynamics of the VT 690 with crossflow drag strip by strip in "
    "place of v|v| r|r| w|w| q|q|, fins that meet the drift, and fin lag: unlike any "
    "of the paper's models."
)


@dataclass(frozen=True)
class Truth:
    """Hydrodynamics from which logs are simulated; fin lag is a time constant [s]."""

    name: str
    note: str
    damping: Damping
    strips: Strips | None = None
    drift_factor: float = 0.0
    fin_lag: float = 0.0

    def effective_fins(self, velocity: FloatArray, fins: FloatArray) -> FloatArray:
        """Return the fin angles relative to the inflow."""
        if self.drift_factor == 0.0:
            return fins
        drift = np.arctan2(-velocity[:, 1:3], velocity[:, :1])
        return fins - self.drift_factor * drift


def sname_truth(damping: Damping) -> Truth:
    """Return the published hydrodynamics."""
    return Truth("sname", SNAME_NOTE, damping)


def crossflow_truth(damping: Damping, fin_x: float) -> Truth:
    """Return hydrodynamics with crossflow strips, inflow angle and lag of the fins."""
    known = damping.as_dict()
    remaining = {label: value for label, value in known.items() if label not in CROSSFLOW_DRAG}
    totals = (-known["Y_v|v|"], -known["Z_w|w|"])
    moments = (-known["N_v|v|"], known["M_w|w|"])
    return Truth(
        "crossflow",
        CROSSFLOW_NOTE,
        Damping.from_dict(None, remaining),
        Strips.calibrated(totals, moments, fin_x),
        DRIFT_FACTOR,
        FIN_LAG,
    )


HULL_LENGTH = 2.194
"""Length of the hull ``L``, centred on the origin [m]."""

N_STRIPS = 40
"""Number of strips of equal length."""


@dataclass(frozen=True)
class Strips:
    """Lever arms (6, n) from velocity to crossflow, and drag coefficients (n,) of the strips."""

    arms: FloatArray
    drag: FloatArray

    @classmethod
    def calibrated(
        cls, totals: tuple[float, float], moments: tuple[float, float], fin_x: float
    ) -> Strips:
        """Return strips of a uniform hull and tail fins that sum to total drag and moments."""
        edges = np.linspace(-HULL_LENGTH / 2, HULL_LENGTH / 2, N_STRIPS + 1)
        x = np.append((edges[:-1] + edges[1:]) / 2, fin_x)
        fin_drag = np.array(moments) / fin_x
        strip_drag = (np.array(totals) - fin_drag) / N_STRIPS
        drag = np.column_stack((np.repeat(strip_drag[:, np.newaxis], N_STRIPS, axis=1), fin_drag))
        return cls(frozen(_arms(x)), frozen(drag.ravel()))

    def wrench(self, velocity: FloatArray) -> FloatArray:
        """Return the drag of all strips about the origin, shape (n, 6)."""
        crossflow = velocity @ self.arms
        return (-self.drag * crossflow * np.abs(crossflow)) @ self.arms.T


def _arms(x: FloatArray) -> FloatArray:
    zero, unit = np.zeros_like(x), np.ones_like(x)
    sway = np.array((zero, unit, zero, zero, zero, x))
    heave = np.array((zero, zero, unit, zero, -x, zero))
    return np.hstack((sway, heave))


HORIZONTAL = "vt690-sname2022"
"""The published set of the axes X Y K N."""

VERTICAL = "vt690-field"
"""The published set of the axes Z M."""


@cache
def true_damping() -> Damping:
    """Return the hydrodynamics of the campaign's vehicle."""
    horizontal, vertical = published[HORIZONTAL], published[VERTICAL]
    values = {
        label: (vertical if label[0] in "ZM" else horizontal)[label]
        for label in horizontal.model.labels
    }
    return Damping.from_dict(
        horizontal.model, values, source=f"{HORIZONTAL} on X Y K N, {VERTICAL} on Z M"
    )


def fin_position(vehicle: Vehicle) -> float:
    """Return the longitudinal position of the rudders, positive forward [m]."""
    rudder = next(item for item in vehicle.actuators if "rudder" in item.commands)
    wrench = rudder.regressor_terms()[0][1]
    return float(wrench[5] / wrench[1])
