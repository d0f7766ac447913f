"""Scores at several horizons: replays that restart from the measured state."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from hydrodamp import kernels
from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError
from hydrodamp.models.damping import Damping, warn_if_foreign
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.simulation.replay import LIMIT, AttitudeSource, Trajectory, initial_attitude
from hydrodamp.simulation.score import RateUnit, Score, score
from hydrodamp.simulation.stamp import stamp
from hydrodamp.vehicle.vehicle import Vehicle

Horizon = float | Literal["step", "run"]
HORIZONS: tuple[Horizon, ...] = ("step", 1.0, 10.0, "run")
"""One step, 1 s, 10 s, and each segment as a whole."""

MAX_STEP = 0.05
"""Longest Runge-Kutta step [s], that of a replay."""

_SLACK = 1e-6
"""Share of a horizon by which a clock may round."""


@dataclass(frozen=True)
class HorizonScore:
    """How far replays of one horizon are from the log.

    Attributes
    ----------
    horizon : float, "step" or "run"
        Seconds between restarts; every sample, or none within a segment.
    score : Score
        Equation 24 and its parts over all samples. Every sample but the first of
        a segment is a prediction, so horizons compare. Of a divergence it has the
        segment and the time since that segment's start [s].
    n_windows : int
        How many replays.
    n_diverged : int
        How many of them diverged.
    """

    horizon: Horizon
    score: Score
    n_windows: int
    n_diverged: int

    @property
    def diverged_share(self) -> float:
        """Share of the windows that diverged, 0 to 1."""
        return self.n_diverged / self.n_windows

    @property
    def name(self) -> str:
        """The horizon in words."""
        names = {"step": "one step", "run": "whole run"}
        return names.get(str(self.horizon)) or f"{self.horizon:g} s"


@dataclass(frozen=True)
class HorizonScores:
    """Scores of one damping at several horizons.

    Attributes
    ----------
    scores : tuple of HorizonScore
        In the order asked for.
    """

    scores: tuple[HorizonScore, ...]

    def __getitem__(self, horizon: Horizon) -> HorizonScore:
        """Return the score of a horizon."""
        for found in self.scores:
            if found.horizon == horizon:
                return found
        known = ", ".join(repr(found.horizon) for found in self.scores)
        raise MethodError(f"no score at the horizon {horizon!r}; there are {known}.")

    def __str__(self) -> str:
        """Return a line a horizon."""
        velocities = tuple(self.scores[0].score.rms_by_axis) if self.scores else ()
        head = f"{'horizon':<10}{'RMS':>9}" + "".join(f"{name:>9}" for name in velocities)
        return "\n".join([f"{head}  diverged", *map(_line, self.scores)])


def horizon_scores(
    vehicle: Vehicle,
    damping: Damping,
    log: Log,
    horizons: Iterable[Horizon] = HORIZONS,
    *,
    attitude: AttitudeSource = "measured",
    rate_unit: RateUnit = "deg",
) -> HorizonScores:
    """Replay a log with restarts every so many seconds, and score each horizon.

    Parameters
    ----------
    vehicle : Vehicle
        Mass, restoring forces and actuators.
    damping : Damping
        The model with its numbers.
    log : Log
        Gives the states to start from, the actuation and the attitude.
    horizons : iterable of float, "step" or "run"
        Seconds between restarts; ``"step"`` restarts at every sample, ``"run"``
        at the first sample of each segment only.
    attitude : {"measured", "simulated"}
        As in a replay; a simulated one restarts from the recorded one too.
    rate_unit : {"deg", "rad"}
        Unit of angular rates in equation 24.

    Returns
    -------
    scores : HorizonScores
        One a horizon.

    Raises
    ------
    MethodError
        If a horizon is neither a positive number of seconds nor one of the two words.
    ProblemError
        If the log lacks what the vehicle or a term needs.

    Warns
    -----
    ForeignVehicleWarning
        If the coefficients belong to a vehicle of another mass matrix, weight or buoyancy.

    Examples
    --------
    >>> from hydrodamp.models.published import published
    >>> from hydrodamp.simulation.campaign.reenact import reenact
    >>> campaign = reenact(duration=5.0)
    >>> damping = published["vt690-sname2022"]
    >>> scores = horizon_scores(campaign.vehicle, damping, campaign.test, ["step", 1.0, "run"])
    >>> [found.n_windows for found in scores.scores]
    [100, 10, 2]
    """
    problem = prepare(vehicle, log, damping.model)
    warn_if_foreign(damping, stamp(vehicle))
    return scores_with_restarts(problem, damping, horizons, attitude, rate_unit)


def scores_with_restarts(
    problem: Problem,
    damping: Damping,
    horizons: Iterable[Horizon] = HORIZONS,
    attitude: AttitudeSource = "measured",
    rate_unit: RateUnit = "deg",
) -> HorizonScores:
    """Score a prepared problem at several horizons; see :func:`horizon_scores`."""
    asked = [_checked(horizon) for horizon in horizons]
    matrix = problem.matrix(damping)
    return HorizonScores(
        tuple(_scored(problem, matrix, horizon, attitude, rate_unit) for horizon in asked)
    )


def windows(problem: Problem, horizon: Horizon) -> IntArray:
    """Return the stretches that are replayed, each from its own measured state."""
    time = problem.inputs.time
    return np.concatenate(
        [_cut(time, start, stop, horizon) for start, stop in problem.segments.tolist()]
    )


def _cut(time: FloatArray, start: int, stop: int, horizon: Horizon) -> IntArray:
    """Return the windows of one segment; none begins at its last sample."""
    begins = start + _restarts(time[start : stop - 1], horizon)
    return np.column_stack([begins, np.append(begins[1:] + 1, stop)])


def _restarts(time: FloatArray, horizon: Horizon) -> IntArray:
    if horizon == "run":
        return np.zeros(1, dtype=np.int64)
    if isinstance(horizon, str):
        return np.arange(len(time))
    number = np.floor((time - time[0]) / horizon + _SLACK)
    return np.flatnonzero(np.diff(number, prepend=-1.0) > 0.0)


def _scored(
    problem: Problem,
    matrix: FloatArray,
    horizon: Horizon,
    attitude: AttitudeSource,
    rate_unit: RateUnit,
) -> HorizonScore:
    # The last window first: where one ends the next begins, and the end, which is a
    # prediction, is to stay.
    spans = windows(problem, horizon)[::-1]
    velocity, diverged_at = kernels.replay(
        problem.columns.plant,
        matrix,
        problem.inputs,
        spans,
        initial_attitude(problem.log, attitude),
        max_step=MAX_STEP,
        limit=LIMIT,
    )
    lost = np.sort(diverged_at[diverged_at >= 0])
    diverged = tuple(_place(problem.log, index) for index in lost.tolist())
    trajectory = Trajectory(problem.log, velocity, diverged, attitude, problem.vehicle.axes)
    return HorizonScore(horizon, score(trajectory, rate_unit=rate_unit), len(spans), len(lost))


def _place(log: Log, index: int) -> tuple[str, float]:
    """Return the segment of a sample and the time since the segment's start."""
    segment = next(part for part in log.segments if index < part.stop)
    return segment.name, float(log.time[index] - log.time[segment.start])


def _checked(horizon: Horizon) -> Horizon:
    words = isinstance(horizon, str) and horizon in ("step", "run")
    if words or (not isinstance(horizon, str) and 0.0 < horizon < np.inf):
        return horizon
    raise MethodError(
        f"a horizon must be a positive number of seconds, 'step' or 'run'; got {horizon!r}"
    )


def _line(found: HorizonScore) -> str:
    errors = (found.score.rms, *found.score.rms_by_axis.values())
    cells = ("–" if error is None else format(error, ".4g") for error in errors)
    share = f"{found.n_diverged} of {found.n_windows}"
    return f"{found.name:<10}" + "".join(f"{cell:>9}" for cell in cells) + f"  {share}"
