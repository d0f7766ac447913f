"""The campaign of section V-B, sailed: four training runs, two validation runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError, demand, no_such
from hydrodamp.progress import count_items
from hydrodamp.simulation.campaign.autopilot import (
    PUBLISHED_AUTOPILOT,
    TEST_RUNS,
    TRAINING_RUNS,
    Autopilot,
    Memory,
    Run,
)
from hydrodamp.simulation.campaign.conditions import WHITE_NOISE, Conditions
from hydrodamp.simulation.campaign.motion import (
    DEPTH,
    EULER,
    MEASURED,
    N_STATES,
    VELOCITY,
    Motion,
)
from hydrodamp.simulation.campaign.truth import (
    Truth,
    crossflow_truth,
    fin_position,
    sname_truth,
    true_damping,
)
from hydrodamp.vehicle.file import fleet
from hydrodamp.vehicle.vehicle import Vehicle

STARTING_DEPTH = 10.0
"""Depth at which every run starts [m]."""


class Voyage(NamedTuple):
    """What happened and what was measured, arrays of shape (n_samples, n_runs, ...)."""

    states: FloatArray
    accelerations: FloatArray
    measured: FloatArray
    commands: FloatArray


TRUTHS = ("sname", "crossflow")
"""The truths to choose from."""

DURATION = 200.0
"""Length of each run of the campaign [s]."""

PAUSE = 60.0
"""Time from the end of a run to the start of the next [s]."""


@dataclass(frozen=True)
class Campaign:
    """The logs of the re-enacted campaign, and the vehicle they belong to.

    Attributes
    ----------
    train, test : Log
        As measured, noise and all; a segment a run. Accelerations are not recorded.
    exact_train, exact_test : Log
        The same motion without errors of the sensors, with exact accelerations.
    vehicle : Vehicle
        All that an estimator is told of the vehicle.
    truth : str
        ``"sname"`` or ``"crossflow"``.
    note : str
        What the truth is, in a sentence.
    """

    train: Log
    test: Log
    exact_train: Log
    exact_test: Log
    vehicle: Vehicle
    truth: str
    note: str


@dataclass(frozen=True)
class CampaignSetup:
    """What sails where: a vehicle with rudder, elevator and propeller, its water and its runs."""

    vehicle: Vehicle
    truth: Truth
    autopilot: Autopilot = PUBLISHED_AUTOPILOT
    training_runs: tuple[Run, ...] = TRAINING_RUNS
    test_runs: tuple[Run, ...] = TEST_RUNS

    @classmethod
    def of(cls, truth: str) -> CampaignSetup:
        """Return the plan of the paper on one of the truths."""
        vehicle, known = fleet["vt690"], true_damping()
        if truth == "sname":
            return cls(vehicle, sname_truth(known))
        return cls(vehicle, crossflow_truth(known, fin_position(vehicle)))

    def simulate(
        self, seeds: Sequence[int], duration: float, conditions: Conditions
    ) -> tuple[Campaign, ...]:
        """Return the campaign of each seed, all vehicles sailing side by side."""
        runs, period = self.training_runs + self.test_runs, self.autopilot.period
        size = len(runs), round(duration / period) + 1, period
        voyage = self._voyage(
            runs * len(seeds),
            np.hstack([conditions.sample_sensor_errors(seed, *size) for seed in seeds]),
            np.hstack([conditions.sample_disturbances(seed, *size) for seed in seeds]),
        )
        places = [slice(k * len(runs), (k + 1) * len(runs)) for k in range(len(seeds))]
        return tuple(self._campaign(Voyage(*(one[:, own] for one in voyage))) for own in places)

    def _voyage(self, runs: Sequence[Run], errors: FloatArray, pushes: FloatArray) -> Voyage:
        period, n = self.autopilot.period, len(runs)
        motion = Motion.of(self.vehicle, self.truth, np.array([run.rpm for run in runs]))
        time = np.arange(len(errors), dtype=np.float64) * period
        heading = np.radians(np.transpose([run.heading.values(time) for run in runs]))
        depth = STARTING_DEPTH + np.transpose([run.depth.values(time) for run in runs])
        state, memory, samples = np.zeros((n, N_STATES)), Memory.blank(n), []
        state[:, 0], state[:, DEPTH] = motion.steady_surge, STARTING_DEPTH
        driven = zip(errors, pushes, heading, depth, strict=True)
        for error, push, course, level in count_items(driven, "sailing the campaign", len(errors)):
            measured, pushed = state[:, MEASURED] + error, replace(motion, push=push)
            commands, memory = self.autopilot.steer(measured, course, level, memory)
            state = pushed.receive(state, commands)
            samples.append((state, pushed.acceleration(state), measured, commands))
            state = pushed.advance(state, commands, period)
        return Voyage(*map(np.array, zip(*samples, strict=True)))

    def _campaign(self, voyage: Voyage) -> Campaign:
        parts: dict[str, Any] = {}
        n = len(self.training_runs)
        for name, runs, place in (
            ("train", self.training_runs, slice(n)),
            ("test", self.test_runs, slice(n, None)),
        ):
            own = Voyage(*(array[:, place] for array in voyage))
            exact = replace(
                self._log(runs, own, own.states), acceleration=frozen(stack_runs(own.accelerations))
            )
            parts |= {name: self._log(runs, own, own.measured), f"exact_{name}": exact}
        return Campaign(**parts, vehicle=self.vehicle, truth=self.truth.name, note=self.truth.note)

    def _log(self, runs: Sequence[Run], voyage: Voyage, states: FloatArray) -> Log:
        n = len(states)
        time = np.arange(n) * self.autopilot.period
        rudder, elevator = stack_runs(voyage.commands).T
        return Log.from_arrays(
            np.concatenate([(time[-1] + PAUSE) * k + time for k in range(len(runs))]),
            stack_runs(states[:, :, VELOCITY]),
            attitude=stack_runs(states[:, :, EULER]),
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
    conditions: Conditions = WHITE_NOISE,
) -> Campaign:
    """Return the logs of the paper's campaign, sailed by a simulated VT 690.

    Training runs are depth steps at 2600 rpm and yaw steps at 1800, 2133 and
    2600 rpm; test runs are depth steps at 2133 rpm and yaw steps at 2350 rpm.

    Parameters
    ----------
    seed : int, optional
        Seed of the noise, 0 or more.
    truth : str, optional
        ``"sname"`` for the published hydrodynamics, ``"crossflow"`` for a truth
        unlike any of the paper's models.
    duration : float, optional
        Length of each run, 1 or more [s].
    conditions : Conditions, optional
        Errors of the sensors; published white noise by default.

    Returns
    -------
    campaign : Campaign
        The same for the same arguments.

    Raises
    ------
    MethodError
        If an argument is out of range or the truth unknown.

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


def stack_runs(columns: FloatArray) -> FloatArray:
    """Return arrays of shape (n_samples, n_runs, k) as rows, run by run."""
    return columns.swapaxes(0, 1).reshape(-1, columns.shape[-1])
