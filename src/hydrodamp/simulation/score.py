"""How far a replay is from the log: equation 24 and its parts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES, VELOCITIES
from hydrodamp.errors import MethodError
from hydrodamp.simulation.replay import Trajectory
from hydrodamp.simulation.status import Status

RateUnit = Literal["deg", "rad"]


@dataclass(frozen=True)
class Score:
    """The distance between a replay and the log.

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
    """

    rms: float | None
    rms_by_axis: dict[str, float | None]
    fit_by_axis: dict[str, float | None]
    rate_unit: RateUnit
    diverged: tuple[tuple[str, float], ...]

    @property
    def status(self) -> Status:
        """``OK`` or ``DIVERGED``."""
        return Status.DIVERGED if self.diverged else Status.OK


def rms_error(error: FloatArray) -> float:
    """Return equation 24: the root mean square of all entries."""
    return float(np.sqrt(np.mean(np.square(error))))


def score(
    trajectory: Trajectory, axes: tuple[str, ...] | None = None, rate_unit: RateUnit = "deg"
) -> Score:
    """Compare a replay with its log.

    Parameters
    ----------
    trajectory : Trajectory
        What was simulated.
    axes : tuple of str, optional
        The axes that count; the free ones of the vehicle by default.
    rate_unit : {"deg", "rad"}
        Unit of the rates in the mixed number and in their RMS.

    Returns
    -------
    score : Score
        Equation 24 and its parts.

    Raises
    ------
    MethodError
        If the unit is neither.
    """
    if rate_unit not in ("deg", "rad"):
        raise MethodError(f"`rate_unit` must be 'deg' or 'rad', got {rate_unit!r}")
    free = [AXES.index(axis) for axis in (trajectory.axes if axes is None else axes)]
    unit = np.array([1.0] * 3 + [np.degrees(1.0) if rate_unit == "deg" else 1.0] * 3)[free]
    measured = trajectory.log.velocity[:, free] * unit
    error = trajectory.velocity[:, free] * unit - measured
    names = [VELOCITIES[axis] for axis in free]
    if trajectory.diverged:
        nothing: dict[str, float | None] = dict.fromkeys(names)
        return Score(None, nothing, dict(nothing), rate_unit, trajectory.diverged)
    by_axis = np.sqrt(np.mean(error**2, axis=0))
    spread = measured.std(axis=0)
    return Score(
        rms=rms_error(error),
        rms_by_axis=dict(zip(names, by_axis.tolist(), strict=True)),
        fit_by_axis={
            name: 100.0 * (1.0 - float(rmse / std)) if std > 0.0 else None
            for name, rmse, std in zip(names, by_axis, spread, strict=True)
        },
        rate_unit=rate_unit,
        diverged=(),
    )
