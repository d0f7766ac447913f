"""Open-loop replay (section V) and its RMS error: equation 24, also by prediction horizon."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, frozen
from hydrodamp.basis.term import AXES, VELOCITY_OF
from hydrodamp.data.log import Log
from hydrodamp.errors import demand
from hydrodamp.kernels import core
from hydrodamp.models.damping import Damping, warn_if_foreign
from hydrodamp.simulation.problem import Problem, prepare, vehicle_stamp
from hydrodamp.status import Status
from hydrodamp.vehicle.vehicle import Vehicle

RateUnit = Literal["deg", "rad"]
AttitudeSource = Literal["measured", "simulated"]
DIVERGENCE_LIMIT = 50.0
"""m/s or rad/s; a replay has diverged where a velocity component exceeds it."""


_LEVEL = (1.0, 0.0, 0.0, 0.0)
"""Quaternion of a planar vehicle, whose log may lack the attitude."""


@dataclass(frozen=True)
class Trajectory:
    """A simulated replay of a log.

    Attributes
    ----------
    log : Log
        The log that was replayed, with its clock and segments.
    velocity : ndarray, shape (n, 6)
        Simulated velocity, linear [m/s] and angular [rad/s], body frame; NaN
        from where a segment diverged.
    diverged : tuple of (str, float)
        Segment and time since the segment's start [s] of every divergence.
    attitude : str
        ``"measured"`` or ``"simulated"``.
    axes : tuple of str
        The free axes of the vehicle; the velocities of the others are zero.
    """

    log: Log
    velocity: FloatArray
    diverged: tuple[tuple[str, float], ...]
    attitude: AttitudeSource
    axes: tuple[str, ...] = AXES

    def __post_init__(self) -> None:
        """Copy and freeze the velocity."""
        object.__setattr__(self, "velocity", frozen(self.velocity))

    @property
    def status(self) -> Status:
        """``OK`` or ``DIVERGED``."""
        return Status.DIVERGED if self.diverged else Status.OK


def simulate(
    vehicle: Vehicle,
    damping: Damping,
    log: Log,
    *,
    attitude: AttitudeSource = "measured",
    max_step: float = 0.05,
) -> Trajectory:
    """Replay a log open loop from the first sample of each segment.

    Parameters
    ----------
    vehicle : Vehicle
        Mass, restoring forces and actuators.
    damping : Damping
        The model with its coefficients.
    log : Log
        Gives the initial velocities, the actuation and the attitude.
    attitude : {"measured", "simulated"}
        Whether gravity and buoyancy use the recorded attitude
        (assumption 1a of the paper) or an integrated one.
    max_step : float
        Longest Runge-Kutta step [s].

    Returns
    -------
    trajectory : Trajectory
        A segment that becomes non-finite or exceeds 50 in any component has
        diverged; that is a status, not an exception.

    Raises
    ------
    ProblemError
        If the log lacks what the vehicle or a term needs.

    Warns
    -----
    ForeignVehicleWarning
        If the coefficients belong to a vehicle of another mass matrix, weight or buoyancy.
    """
    problem = prepare(vehicle, log, damping.model)
    warn_if_foreign(damping, vehicle_stamp(vehicle))
    return replay(problem, damping, attitude, max_step)


def replay(
    problem: Problem,
    damping: Damping,
    attitude: AttitudeSource = "measured",
    max_step: float = 0.05,
    spans: IntArray | None = None,
) -> Trajectory:
    """Replay segments or ``spans``; where two spans share a sample, the later one determines it."""
    demand(1e-5 <= max_step <= 0.05, "max_step", "between 1e-5 and 0.05 s", max_step)
    is_valid = attitude in ("measured", "simulated")
    demand(is_valid, "attitude", "'measured' or 'simulated'", attitude)
    log, recorded = problem.log, problem.log.attitude
    start = np.tile(_LEVEL, (log.n, 1)) if recorded is None else recorded
    velocity, diverged_at, _ = core.replay(
        problem.equations.plant,
        problem.matrix(damping),
        problem.inputs,
        problem.segments if spans is None else spans,
        attitude=start if attitude == "simulated" else None,
        max_step=max_step,
        limit=DIVERGENCE_LIMIT,
    )
    diverged = []
    for index in np.sort(diverged_at[diverged_at >= 0]).tolist():
        segment = next(each for each in log.segments if index < each.stop)
        diverged.append((segment.name, float(log.time[index] - log.time[segment.start])))
    return Trajectory(log, velocity, tuple(diverged), attitude, problem.vehicle.axes)


@dataclass(frozen=True)
class Score:
    """Error of a replay relative to the log.

    Attributes
    ----------
    rms : float or None
        Equation 24 over all samples and free axes, linear velocity in m/s and
        rates in ``rate_unit``/s; None where a segment diverged.
    rms_by_axis : dict of str to float or None
        RMS of each free velocity, u v w [m/s], p q r [``rate_unit``/s].
    fit_by_axis : dict of str to float or None
        ``100 (1 - rmse / std)`` of each free velocity [%]; None where the log
        does not vary.
    rate_unit : {"deg", "rad"}
        Unit of the rates; the paper does not state its own.
    diverged : tuple of (str, float)
        Segment and time [s] of every divergence.
    rms_by_segment : dict of str to float or None
        Equation 24 over each segment alone; None where it diverged.
    """

    rms: float | None
    rms_by_axis: dict[str, float | None]
    fit_by_axis: dict[str, float | None]
    rate_unit: RateUnit
    diverged: tuple[tuple[str, float], ...]
    rms_by_segment: dict[str, float | None] = field(default_factory=dict)

    @property
    def status(self) -> Status:
        """``OK`` or ``DIVERGED``."""
        return Status.DIVERGED if self.diverged else Status.OK

    @property
    def divergence_text(self) -> str:
        """Segments and times of divergence, as text; empty for none."""
        locations = (f"segment {name} after {time:.3g} s" for name, time in self.diverged)
        return ", ".join(locations)


def score(trajectory: Trajectory, rate_unit: RateUnit = "deg") -> Score:
    """Compute the error of a replay.

    Parameters
    ----------
    trajectory : Trajectory
        The replay.
    rate_unit : {"deg", "rad"}
        Unit of the rates in equation 24 and in their RMS.

    Returns
    -------
    score : Score
        Equation 24 and its parts.

    Raises
    ------
    MethodError
        If the unit is neither.
    """
    demand(rate_unit in ("deg", "rad"), "rate_unit", "'deg' or 'rad'", rate_unit)
    replayed, measured = free_velocities(trajectory, rate_unit)
    error = replayed - measured
    names = [VELOCITY_OF[axis] for axis in trajectory.axes]
    diverged = {name for name, _ in trajectory.diverged}
    by_segment = {
        segment.name: None
        if segment.name in diverged
        else float(np.sqrt(np.mean(error[segment.start : segment.stop] ** 2)))
        for segment in trajectory.log.segments
    }
    if trajectory.diverged:
        empty = no_score(trajectory.axes, rate_unit, trajectory.diverged)
        return replace(empty, rms_by_segment=by_segment)
    by_axis = np.sqrt(np.mean(error**2, axis=0))
    deviation = measured.std(axis=0)
    return Score(
        rms=float(np.sqrt(np.mean(error**2))),
        rms_by_axis=dict(zip(names, by_axis.tolist(), strict=True)),
        fit_by_axis={
            name: 100.0 * (1.0 - float(rmse / std)) if std > 0.0 else None
            for name, rmse, std in zip(names, by_axis, deviation, strict=True)
        },
        rate_unit=rate_unit,
        diverged=(),
        rms_by_segment=by_segment,
    )


def free_velocities(trajectory: Trajectory, rate_unit: RateUnit) -> tuple[FloatArray, FloatArray]:
    """Return the replayed and the measured velocities of the free axes in units of equation 24."""
    free = [AXES.index(axis) for axis in trajectory.axes]
    unit = np.array([1.0] * 3 + [np.degrees(1.0) if rate_unit == "deg" else 1.0] * 3)[free]
    return trajectory.velocity[:, free] * unit, trajectory.log.velocity[:, free] * unit


def no_score(
    axes: tuple[str, ...], rate_unit: RateUnit, diverged: tuple[tuple[str, float], ...] = ()
) -> Score:
    """Return the score of a replay that diverged or does not exist."""
    errors: dict[str, float | None] = dict.fromkeys(VELOCITY_OF[axis] for axis in axes)
    return Score(None, errors, errors, rate_unit, diverged)


Horizon = float | Literal["step", "run"]
HORIZONS: tuple[Horizon, ...] = ("step", 1.0, 10.0, "run")
"""One step, 1 s, 10 s, and each segment as a whole."""

_CLOCK_TOLERANCE = 1e-6  # share of a horizon, for rounding of the clock


@dataclass(frozen=True)
class HorizonScore:
    """Error of replays restarted after every horizon.

    Attributes
    ----------
    horizon : float, "step" or "run"
        Seconds between restarts; every sample, or none within a segment.
    score : Score
        Equation 24 and its parts over all samples. Every sample except the first of
        a segment is a prediction, so horizons are comparable. Divergences have the
        segment and the time since its start [s].
    n_windows : int
        Number of replays.
    n_diverged : int
        Number of diverged replays.
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
        """The horizon as text."""
        names = {"step": "one step", "run": "whole run"}
        return names.get(str(self.horizon)) or f"{self.horizon:g} s"


def horizon_scores(
    vehicle: Vehicle,
    damping: Damping,
    log: Log,
    horizons: Iterable[Horizon] = HORIZONS,
    *,
    attitude: AttitudeSource = "measured",
    rate_unit: RateUnit = "deg",
) -> tuple[HorizonScore, ...]:
    """Compute the prediction error over several horizons, by replays from measured states.

    Parameters
    ----------
    vehicle : Vehicle
        Mass, restoring forces and actuators.
    damping : Damping
        The model with its coefficients.
    log : Log
        Gives the initial states, the actuation and the attitude.
    horizons : iterable of float, "step" or "run"
        Seconds between restarts; ``"step"`` restarts at every sample, ``"run"``
        at the first sample of each segment only.
    attitude : {"measured", "simulated"}
        As in a replay; a simulated one also restarts from the recorded one.
    rate_unit : {"deg", "rad"}
        Unit of angular rates in equation 24.

    Returns
    -------
    scores : tuple of HorizonScore
        One per horizon, in the order of the argument.

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
    >>> from hydrodamp.models.catalog import published
    >>> from hydrodamp.simulation.campaign.reenact import reenact
    >>> campaign = reenact(duration=5.0)
    >>> damping = published["vt690-sname2022"]
    >>> scores = horizon_scores(campaign.vehicle, damping, campaign.test, ["step", 1.0, "run"])
    >>> [each.n_windows for each in scores]
    [100, 10, 2]
    """
    checked = [check_horizon(horizon) for horizon in horizons]
    problem = prepare(vehicle, log, damping.model)
    warn_if_foreign(damping, vehicle_stamp(vehicle))
    return tuple(horizon_score(problem, damping, each, attitude, rate_unit) for each in checked)


def horizon_score(
    problem: Problem,
    damping: Damping,
    horizon: Horizon,
    attitude: AttitudeSource,
    rate_unit: RateUnit,
) -> HorizonScore:
    """Return the score of one horizon."""
    # In reverse order: windows share their boundary sample, which must be the prediction at the
    # end of the earlier window.
    spans = window_bounds(problem, horizon)[::-1]
    trajectory = replay(problem, damping, attitude, spans=spans)
    n_diverged = len(trajectory.diverged)
    return HorizonScore(horizon, score(trajectory, rate_unit), len(spans), n_diverged)


def window_bounds(problem: Problem, horizon: Horizon) -> IntArray:
    """Return first and last sample of each window, shape (n_windows, 2)."""
    time, bounds = problem.inputs.time, []
    for start, stop in problem.segments.tolist():
        first = start + _restarts(time[start : stop - 1], horizon)  # none at the last sample
        bounds.append(np.column_stack([first, np.append(first[1:] + 1, stop)]))
    return np.concatenate(bounds)


def _restarts(time: FloatArray, horizon: Horizon) -> IntArray:
    if horizon == "run":
        return np.zeros(1, dtype=np.int64)
    if isinstance(horizon, str):
        return np.arange(len(time))
    number = np.floor((time - time[0]) / horizon + _CLOCK_TOLERANCE)
    return np.flatnonzero(np.diff(number, prepend=-1.0) > 0.0)


def check_horizon(horizon: Horizon) -> Horizon:
    """Return a valid horizon."""
    is_valid = horizon in ("step", "run") if isinstance(horizon, str) else 0.0 < horizon < np.inf
    demand(is_valid, "horizon", "a positive number of seconds, 'step' or 'run'", horizon)
    return horizon
