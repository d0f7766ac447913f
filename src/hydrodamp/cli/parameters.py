"""Parameters that ``identify`` and ``compare`` estimate with the damping, and their folds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import hydrodamp as hd
from hydrodamp.cli import inputs
from hydrodamp.cli.output import note
from hydrodamp.errors import MethodError, demand, no_such

if TYPE_CHECKING:
    from hydrodamp.identification.fit import Method
    from hydrodamp.identification.model_request import ModelRequest
    from hydrodamp.validation.workflow import Study

#: Name in ``--estimate`` of the gains of the actuators, and of no parameter at all.
GAINS, NONE = "gains", "none"


def prepare_study(
    vehicle: hd.Vehicle,
    train: hd.Log,
    test: hd.Log,
    request: ModelRequest,
    methods: Sequence[Method],
    estimate: str | None,
    mapping: str | None,
) -> Study:
    """Return the study of a call, and print what was estimated and selected for it."""
    from hydrodamp.identification.command_response import PARAMETERS
    from hydrodamp.identification.parameters import VEHICLE_PARAMETERS
    from hydrodamp.validation import workflow

    names = list_parameters(estimate, vehicle)
    known = (*PARAMETERS, *VEHICLE_PARAMETERS, GAINS)
    if unknown := [name for name in names if name not in known]:
        raise MethodError(no_such("parameter", unknown[0], known))
    study = workflow.prepare_study(
        vehicle,
        train,
        test,
        request,
        set_parameters(methods, names, estimate),
        response=[name for name in names if name in PARAMETERS],
        gains=GAINS in names,
    )
    if (selected := study.selected_model) is not None:
        note(f"sparse: {selected.n_coefficients} coefficients. {selected.note}")
    if (response := study.response) is not None:
        note(f"{response}.")
        if response.is_significant:
            note(f"For other commands, write `steps: [{response.mapping_steps}]` in the mapping.")
    return replace(study, origin=inputs.mapping_provenance(mapping))


def check_horizon(horizon: float, test: hd.Log, folds: int | None) -> None:
    """Refuse windows that are longer than every segment of the test data, or of a fold."""
    import numpy as np

    from hydrodamp.validation.cross_validation import split_holdout

    logs = [test] if folds is None else [held_out for _, held_out in split_holdout(test, folds)]
    spans = (max(float(np.ptp(log.time[a:b])) for a, b in log.bounds) for log in logs)
    longest = min(spans)
    data = "the test data" if folds is None else "each fold"
    bounds = f"positive and at most {longest:.4g} s, the longest segment of {data}"
    demand(0.0 < horizon <= longest, "--horizon", bounds, f"{horizon:g}")


def check_folds(log: hd.Log, folds: int) -> int:
    """Return the number of folds that a log allows, and say where it is below the option's."""
    from hydrodamp.validation.cross_validation import count_folds

    try:
        n_folds = count_folds(log, folds)
    except MethodError as error:
        raise MethodError(f"`--folds {folds}`: {error}") from error
    if n_folds < folds:
        note(f"`--folds {folds}`: the log is long enough for {n_folds} folds, which are used.")
    return n_folds


def list_parameters(option: str | None, vehicle: hd.Vehicle) -> tuple[str, ...]:
    """Return the names that ``--estimate`` has, by default those of the vehicle file."""
    if option is None:
        return tuple(name.replace("_", "-") for name in vehicle.estimate)
    names = tuple(inputs.split_names(option))
    if NONE in names and len(names) > 1:
        raise MethodError(f"`--estimate {option}`: name parameters, or `{NONE}` alone")
    return tuple(name for name in names if name != NONE)


def set_parameters(
    methods: Sequence[Method], names: Sequence[str], option: str | None
) -> tuple[Method, ...]:
    """Return the methods with the parameters that they estimate."""
    from hydrodamp.identification.parameters import VEHICLE_PARAMETERS

    of_vehicle = tuple(name for name in names if name in VEHICLE_PARAMETERS)
    is_minimised = any(isinstance(each, hd.OutputError) for each in methods)
    if of_vehicle and not is_minimised:
        keys = " ".join(f"`{each.key}`" for each in methods)
        raise MethodError(
            f"{keys} does not estimate {' '.join(of_vehicle)}: use the method `recommended` or "
            f"`oe`, or `--estimate {NONE}` to keep the values of the vehicle file"
        )
    free = None if option is not None and not names else of_vehicle
    return tuple(
        replace(each, estimate=free) if isinstance(each, hd.OutputError) else each
        for each in methods
    )


def note_stopped(methods: Sequence[Method], fits: Sequence[hd.Fit]) -> None:
    """Name what may help where a fit has stopped before it converged."""
    for method in methods:
        of_method = [fit for fit in fits if fit.method == method.key]
        stopped = [fit.model.key for fit in of_method if fit.status is hd.Status.STOPPED]
        if stopped and isinstance(method, hd.OutputError):
            note(
                f"`{method.key}` has not converged on {', '.join(stopped)}: name a model of fewer "
                "terms, a log of more excitation, or a method without iterations, such as "
                f"`weak`. In Python, `max_iterations={2 * method.max_iterations}` of the method "
                "allows twice as many; where these change nothing, no step lowers the objective."
            )
