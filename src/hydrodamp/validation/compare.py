"""Replay every fit on held-out data and score it, on all cores."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from hydrodamp.basis.axes import AXES, VELOCITY_OF
from hydrodamp.data.log import Log
from hydrodamp.identification.fit import Fit
from hydrodamp.models.damping import warn_if_foreign
from hydrodamp.simulation.parallel import each
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.simulation.replay import AttitudeSource, replay
from hydrodamp.simulation.score import RateUnit, Score, score
from hydrodamp.simulation.stamp import stamp
from hydrodamp.validation.comparison import Comparison, Row
from hydrodamp.vehicle.vehicle import Vehicle


def compare(
    fits: Iterable[Fit],
    vehicle: Vehicle,
    test: Log,
    *,
    attitude: AttitudeSource = "measured",
    rate_unit: RateUnit = "deg",
    done: Callable[[Row], None] | None = None,
) -> Comparison:
    """Replay fits open loop on a log they have not seen.

    Parameters
    ----------
    fits : iterable of Fit
        What to compare.
    vehicle : Vehicle
        The vehicle of the log.
    test : Log
        Held-out data; each segment restarts from its first sample.
    attitude : {"measured", "simulated"}
        Which attitude gravity and buoyancy act along.
    rate_unit : {"deg", "rad"}
        Unit of angular rates in equation 24.
    done : callable, optional
        Called with each row after its replay, to keep it or for a progress bar.

    Returns
    -------
    comparison : Comparison
        A row a fit, in order; a diverged replay is a row with a status.

    Raises
    ------
    ProblemError
        If the log lacks what the vehicle or a term needs.

    Warns
    -----
    ForeignVehicleWarning
        If coefficients belong to a vehicle of another mass matrix, weight or buoyancy.
    """
    asked = tuple(fits)
    problem = prepare(vehicle, test, [fit.model for fit in asked])
    for fit in asked:
        warn_if_foreign(fit.damping, stamp(vehicle))
    rows = each(_row, [(problem, fit, attitude, rate_unit) for fit in asked], done)
    return Comparison(
        rows=rows,
        rate_unit=rate_unit,
        attitude=attitude,
        provenance=origin(asked, vehicle, test),
    )


def origin(fits: Sequence[Fit], vehicle: Vehicle, test: Log) -> dict[str, str]:
    """Return what a comparison was made from, in words."""
    train = fits[0].provenance if fits else {}
    return {
        "vehicle": vehicle.name,
        "train": train.get("log", ""),
        "train_segments": train.get("segments", ""),
        "test": test.source or "in memory",
        "test_segments": " ".join(segment.name for segment in test.segments),
    }


def _row(problem: Problem, fit: Fit, attitude: AttitudeSource, rate_unit: RateUnit) -> Row:
    axes = problem.vehicle.axes
    if not fit.status.usable:
        return Row(fit, _no_score(axes, rate_unit))
    trajectory = replay(problem, fit.damping, attitude)
    return Row(fit, score(trajectory, axes, rate_unit), trajectory)


def _no_score(axes: tuple[str, ...], rate_unit: RateUnit) -> Score:
    nothing: dict[str, float | None] = dict.fromkeys(VELOCITY_OF[a] for a in AXES if a in axes)
    return Score(None, nothing, dict(nothing), rate_unit, ())
