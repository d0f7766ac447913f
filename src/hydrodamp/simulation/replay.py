"""Open-loop replay: equation 1 driven by the recorded actuation (section V)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from hydrodamp import kernels
from hydrodamp.arrays import FloatArray, IntArray, frozen
from hydrodamp.basis.atoms import AXES
from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError
from hydrodamp.models.damping import Damping, warn_if_foreign
from hydrodamp.simulation.problem import Problem, prepare, stamp
from hydrodamp.simulation.status import Status
from hydrodamp.vehicle.vehicle import Vehicle

AttitudeSource = Literal["measured", "simulated"]
LIMIT = 50.0
"""A velocity component [m/s or rad/s] beyond which a replay has diverged."""


_LEVEL = (1.0, 0.0, 0.0, 0.0)
"""The attitude of a planar vehicle, the only kind whose log may lack one."""


@dataclass(frozen=True)
class Trajectory:
    """What the model says would have happened.

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
        The model with its numbers.
    log : Log
        Gives the initial velocities, the actuation and the attitude.
    attitude : {"measured", "simulated"}
        Whether gravity and buoyancy act along the recorded attitude
        (assumption 1a of the paper) or along one that is integrated too.
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
    warn_if_foreign(damping, stamp(vehicle))
    return replay(problem, damping, attitude, max_step)


def replay(
    problem: Problem,
    damping: Damping,
    attitude: AttitudeSource = "measured",
    max_step: float = 0.05,
    spans: IntArray | None = None,
) -> Trajectory:
    """Replay segments or other stretches; where two share a sample, the one given later stays."""
    if not 1e-5 <= max_step <= 0.05:
        raise MethodError(f"`max_step` must be between 1e-5 and 0.05 s, got {max_step}")
    if attitude not in ("measured", "simulated"):
        raise MethodError(f"`attitude` must be 'measured' or 'simulated', got {attitude!r}")
    log, recorded = problem.log, problem.log.attitude
    start = np.tile(_LEVEL, (log.n, 1)) if recorded is None else recorded
    velocity, diverged_at = kernels.replay(
        problem.columns.plant,
        problem.matrix(damping),
        problem.inputs,
        problem.segments if spans is None else spans,
        start if attitude == "simulated" else None,
        max_step=max_step,
        limit=LIMIT,
    )
    diverged = []
    for index in np.sort(diverged_at[diverged_at >= 0]).tolist():
        segment = next(part for part in log.segments if index < part.stop)
        diverged.append((segment.name, float(log.time[index] - log.time[segment.start])))
    return Trajectory(log, velocity, tuple(diverged), attitude, problem.vehicle.axes)
