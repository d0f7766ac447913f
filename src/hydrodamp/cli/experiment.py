"""What commands that fit share: checks before the work, then the fits."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING

from hydrodamp.errors import HydrodampError, HydrodampWarning, ProblemError

if TYPE_CHECKING:
    from hydrodamp.data.log import Log
    from hydrodamp.identification.fit import Fit, Method
    from hydrodamp.models.model import DampingModel
    from hydrodamp.validation.comparison import Comparison
    from hydrodamp.vehicle.vehicle import Vehicle

Key = tuple[str, str]
"""Model and method of a fit."""


def check_before(vehicle: Vehicle, log: Log, models: Sequence[DampingModel]) -> None:
    """Refuse a log that cannot serve, or has a column that nothing uses; say what looks wrong."""
    from hydrodamp.conditioning.suspicions import suspicions
    from hydrodamp.simulation.fitness import check_columns_used, check_log

    free = tuple(model.restricted_to(vehicle.axes) for model in models)
    faults: list[HydrodampError] = []
    for check, asked in ((check_log, free), (check_columns_used, models)):
        try:
            check(vehicle, log, asked)
        except HydrodampError as error:
            faults.append(error)
    if len(faults) == 1:
        raise faults[0]
    if faults:
        raise ProblemError("\n".join(map(str, faults)))
    for one in suspicions(log):
        if one.channel not in log.command_names:  # the vehicle says what its commands are
            warnings.warn(f"{log.source or 'log'}: {one}", HydrodampWarning, stacklevel=2)


def check_attitude(attitude: str, log: Log) -> None:
    """Refuse a simulated attitude that nothing starts from."""
    if attitude == "simulated" and log.attitude is None:
        raise ProblemError(
            f"{log.source or 'log'}: a simulated attitude starts from a recorded one, and the log "
            "has none: leave out `--attitude simulated`, or record roll pitch yaw."
        )


def check_samples(vehicle: Vehicle, log: Log, models: Sequence[DampingModel]) -> None:
    """Refuse a log with fewer samples than the largest axis of every model."""
    needed = [max(map(len, model.restricted_to(vehicle.axes).terms), default=0) for model in models]
    if log.n < min(needed):
        raise ProblemError(
            f"{log.source or 'log'}: {log.n} samples are fewer than the largest axis of every "
            f"model asked for; the smallest needs {min(needed)}. Give a longer log."
        )


def fit_all(
    vehicle: Vehicle,
    train: Log,
    models: Sequence[DampingModel],
    methods: Sequence[Method],
    keep: Callable[[Fit], None] | None = None,
    earlier: Mapping[Key, Fit] = MappingProxyType({}),
) -> tuple[Fit, ...]:
    """Identify every model by every method, with a bar a method: their rates differ much."""
    from hydrodamp.cli.progress import progress
    from hydrodamp.identification.methods import identify_all
    from hydrodamp.simulation.problem import prepare

    fits = dict(earlier)
    problem = prepare(vehicle, train, models)
    for place, method in enumerate(methods, start=1):
        missing = [model for model in models if (model.key, method.key) not in fits]
        which = f" ({place} of {len(methods)})" if len(methods) > 1 else ""
        before = len(models) - len(missing)
        with progress(f"identifying by {method.key}{which}", len(models), before) as step:

            def kept(fit: Fit, step: Callable[..., None] = step) -> None:
                fits[key_of(fit)] = fit
                if keep is not None:
                    keep(fit)
                step()

            if missing:
                identify_all(problem, missing, method, kept)
    return tuple(fits[model.key, method.key] for method in methods for model in models)


def key_of(fit: Fit) -> Key:
    """Return what a fit is asked for by."""
    return fit.model.key, fit.method


def nothing_scored(comparison: Comparison) -> str:
    """Return the sentence for a comparison without any score, empty if there is one."""
    if any(row.rms is not None for row in comparison.rows):
        return ""
    outcomes = dict.fromkeys(row.status.word for row in comparison.rows)
    return (
        f"no row has an RMS error ({', '.join(outcomes)}): check units, axes and signs first "
        "(`hydrodamp probe`), then try models with fewer terms, another method, or a log with "
        "richer manoeuvres."
    )
