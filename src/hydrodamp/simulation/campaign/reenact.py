"""Simulation of the campaign of section V-B: four training runs and two validation runs.

Vehicles with rudder, elevator and propeller follow equation 1 with the true hydrodynamics; fins
reach their command at once or with a first-order lag: T delta_dot = delta_c - delta.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError, demand, no_such
from hydrodamp.progress import count_items
from hydrodamp.simulation import closed_loop as dynamics
from hydrodamp.simulation.campaign import conditions as paper
from hydrodamp.vehicle.actuators import Fin, Propeller
from hydrodamp.vehicle.file import fleet
from hydrodamp.vehicle.vehicle import Vehicle

MAX_STEP = 0.02
"""Longest step of the Runge-Kutta integration [s]."""

FINS = slice(dynamics.N_STATES, dynamics.N_STATES + 2)
"""Columns of a state that are the angles of rudder and elevator [rad]."""

INITIAL_DEPTH = 10.0
"""Depth at which every run starts [m]."""

TRUTHS = ("sname", "crossflow")
"""Names of the hydrodynamics to choose from."""

DURATION = 200.0
"""Duration of each run of the campaign [s]."""

PAUSE = 60.0
"""Time from the end of a run to the start of the next [s]."""


class Motion:
    """Motion of vehicles at propeller speeds ``rpm``, shape (n,), with the true hydrodynamics."""

    def __init__(self, vehicle: Vehicle, truth: paper.Truth, rpm: FloatArray) -> None:
        damping = truth.damping
        self.truth, self.rpm = truth, rpm
        self.equation = dynamics.EquationOfMotion.of(vehicle, damping.model, [damping.coefficients])
        actuators = vehicle.actuators
        self.propeller = next(item for item in actuators if isinstance(item, Propeller))
        fins = {item.command: item.channel for item in actuators if isinstance(item, Fin)}
        commands = {**dict.fromkeys(fins, 0.0 * rpm), self.propeller.command: rpm}
        self.channels, _ = self.equation.inputs(commands, len(rpm))
        channels = self.equation.table.channels
        self.fin_columns = [channels.index(fins[name]) for name in ("rudder", "elevator")]

    @cached_property
    def steady_surge(self) -> FloatArray:
        """Surge speed of each vehicle on a straight level course, shape (n,) [m/s]."""
        thrust = self.propeller.thrust * self.rpm * np.abs(self.rpm)
        return np.asarray(np.sqrt(-thrust / self.truth.damping["X_u|u|"]))

    def acceleration(self, state: FloatArray, disturbance: FloatArray | float = 0.0) -> FloatArray:
        """Return the acceleration under a disturbance wrench, shape (n, 6)."""
        velocity, channels = state[:, dynamics.VELOCITY], self.channels.copy()
        channels[:, self.fin_columns] = self.truth.effective_fins(velocity, state[:, FINS])
        if self.truth.strips is not None:
            disturbance = disturbance + self.truth.strips.wrench(velocity)
        speed = np.zeros(len(state))
        return self.equation.acceleration(state, channels, speed, disturbance)

    def receive(self, state: FloatArray, commands: FloatArray) -> FloatArray:
        """Return the state at the time of new commands: fins without lag reach them at once."""
        following = state.copy()
        if not self.truth.fin_lag:
            following[:, FINS] = commands
        return following

    def advance(
        self,
        state: FloatArray,
        commands: FloatArray,
        duration: float,
        disturbance: FloatArray | float = 0.0,
    ) -> FloatArray:
        """Return the state after a duration [s] of held commands and disturbance."""
        lag = self.truth.fin_lag

        def rate(state: FloatArray, _: float) -> FloatArray:
            fin_rate = (commands - state[:, FINS]) / lag if lag else np.zeros_like(commands)
            acceleration = self.acceleration(state, disturbance)
            return np.hstack([dynamics.motion_rates(acceleration, state), fin_rate])

        return dynamics.integrate(rate, state, duration, MAX_STEP)


class _Record(NamedTuple):
    """Time series of all runs, arrays of shape (n_samples, n_runs, ...)."""

    states: FloatArray
    accelerations: FloatArray
    measured: FloatArray
    commands: FloatArray

    def select(self, runs: slice) -> _Record:
        return _Record(*(array[:, runs] for array in self))


@dataclass(frozen=True)
class Campaign:
    """Logs of the simulated campaign, and the vehicle.

    Attributes
    ----------
    train, test : Log
        As measured, with noise; one segment per run. Accelerations are not recorded.
    exact_train, exact_test : Log
        The same motion without sensor noise, with exact accelerations.
    vehicle : Vehicle
        What an estimator knows of the vehicle.
    truth : str
        ``"sname"`` or ``"crossflow"``.
    note : str
        Description of the true hydrodynamics.
    """

    train: Log
    test: Log
    exact_train: Log
    exact_test: Log
    vehicle: Vehicle
    truth: str
    note: str


@dataclass(frozen=True, eq=False)
class CampaignSetup:
    """A vehicle with rudder, elevator and propeller, its true hydrodynamics, and its runs."""

    vehicle: Vehicle
    truth: paper.Truth
    autopilot: dynamics.Autopilot = paper.PUBLISHED_AUTOPILOT
    training_runs: tuple[paper.Run, ...] = paper.TRAINING_RUNS
    test_runs: tuple[paper.Run, ...] = paper.TEST_RUNS
    period: float = paper.COMMAND_PERIOD

    @classmethod
    def of(cls, truth: str) -> CampaignSetup:
        """Return the campaign of the paper with one of the truths."""
        vehicle, damping = fleet["vt690"], paper.true_damping()
        if truth == "sname":
            return cls(vehicle, paper.sname_truth(damping))
        return cls(vehicle, paper.crossflow_truth(damping, paper.fin_position(vehicle)))

    def simulate(
        self, seeds: Sequence[int], duration: float, conditions: paper.Conditions
    ) -> tuple[Campaign, ...]:
        """Return the campaign of each seed; all are simulated as one batch."""
        runs = self.training_runs + self.test_runs
        size = len(runs), round(duration / self.period) + 1, self.period
        record = self._simulate_runs(
            runs * len(seeds),
            np.hstack([conditions.sample_sensor_errors(seed, *size) for seed in seeds]),
            np.hstack([conditions.sample_disturbances(seed, *size) for seed in seeds]),
        )
        starts = range(0, len(runs) * len(seeds), len(runs))
        return tuple(self._campaign(record.select(slice(k, k + len(runs)))) for k in starts)

    def _simulate_runs(
        self, runs: Sequence[paper.Run], errors: FloatArray, disturbances: FloatArray
    ) -> _Record:
        n = len(runs)
        motion = Motion(self.vehicle, self.truth, np.array([run.rpm for run in runs]))
        time = np.arange(len(errors), dtype=np.float64) * self.period
        setpoints = np.zeros((len(time), n, 3))
        setpoints[:, :, 1] = np.radians(np.transpose([run.heading.values(time) for run in runs]))
        setpoints[:, :, 2] = INITIAL_DEPTH + np.transpose([run.depth.values(time) for run in runs])
        state = np.zeros((n, FINS.stop))
        state[:, 0], state[:, dynamics.DEPTH] = motion.steady_surge, INITIAL_DEPTH

        def advance(index: int, state: FloatArray, commands: FloatArray) -> FloatArray:
            received = motion.receive(state, commands)
            return motion.advance(received, commands, self.period, disturbances[index])

        states, measured, commands = dynamics.simulate_closed_loop(
            self.autopilot,
            state,
            count_items(errors, "simulating runs", len(errors)),
            np.zeros((len(time), n, 2)),
            lambda index, _: setpoints[index],
            advance,
            self.period,
        )
        received = map(motion.receive, states, commands)
        accelerations = np.array([*map(motion.acceleration, received, disturbances)])
        return _Record(states, accelerations, measured, commands)

    def _campaign(self, record: _Record) -> Campaign:
        logs: dict[str, Any] = {}
        n = len(self.training_runs)
        for name, runs, selected in (
            ("train", self.training_runs, record.select(slice(n))),
            ("test", self.test_runs, record.select(slice(n, None))),
        ):
            acceleration = frozen(dynamics.stack_runs(selected.accelerations))
            exact = self._log(runs, selected, selected.states)
            logs[name] = self._log(runs, selected, selected.measured)
            logs[f"exact_{name}"] = replace(exact, acceleration=acceleration)
        return Campaign(**logs, vehicle=self.vehicle, truth=self.truth.name, note=self.truth.note)

    def _log(self, runs: Sequence[paper.Run], record: _Record, states: FloatArray) -> Log:
        n = len(states)
        time = np.arange(n) * self.period
        rudder, elevator = dynamics.stack_runs(record.commands).T
        return Log.from_arrays(
            np.concatenate([(time[-1] + PAUSE) * k + time for k in range(len(runs))]),
            dynamics.stack_runs(states[:, :, dynamics.VELOCITY]),
            attitude=dynamics.stack_runs(states[:, :, dynamics.EULER]),
            commands={
                "rudder": rudder,
                "elevator": elevator,
                "rpm": np.repeat([run.rpm for run in runs], n),
            },
            segment=[run.name for run in runs for _ in range(n)],
            source="re-enacted campaign",
        )


def reenact(
    seed: int = 0,
    truth: str = "sname",
    duration: float = DURATION,
    conditions: paper.Conditions = paper.WHITE_NOISE,
) -> Campaign:
    """Simulate the paper's campaign with a VT 690.

    Training runs are depth steps at 2600 rpm and yaw steps at 1800, 2133 and
    2600 rpm; test runs are depth steps at 2133 rpm and yaw steps at 2350 rpm.

    Parameters
    ----------
    seed : int, optional
        Seed of the noise, 0 or more.
    truth : str, optional
        ``"sname"`` for the published hydrodynamics, ``"crossflow"`` for hydrodynamics that
        none of the paper's models contains.
    duration : float, optional
        Duration of each run, 1 or more [s].
    conditions : Conditions, optional
        Sensor noise; published white noise by default.

    Returns
    -------
    campaign : Campaign
        The same for the same arguments.

    Raises
    ------
    MethodError
        If an argument is out of range or the truth is unknown.

    Examples
    --------
    >>> campaign = reenact(seed=1, duration=2.0)
    >>> [segment.name for segment in campaign.train.segments]
    ['depth-2600', 'yaw-1800', 'yaw-2133', 'yaw-2600']
    >>> campaign.test.command_names
    ('rudder', 'elevator', 'rpm')
    """
    if truth not in TRUTHS:
        raise MethodError(no_such("truth", truth, TRUTHS))
    demand(seed >= 0, "seed", "0 or more", seed)
    demand(1.0 <= duration < np.inf, "duration", "1 s or more", duration)
    return CampaignSetup.of(truth).simulate((seed,), duration, conditions)[0]
