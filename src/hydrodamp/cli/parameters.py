"""Parameters that ``identify`` and ``compare`` estimate with the damping."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

import hydrodamp as hd
from hydrodamp.cli import inputs
from hydrodamp.cli.output import note
from hydrodamp.errors import no_such

#: Name in ``--estimate`` of the gains of the actuators, and of no parameter at all.
GAINS, NONE = "gains", "none"


def list_parameters(option: str | None, vehicle: hd.Vehicle) -> tuple[str, ...]:
    """Return the names that ``--estimate`` has, by default those of the vehicle file."""
    if option is None:
        return tuple(name.replace("_", "-") for name in vehicle.estimate)
    names = tuple(inputs.split_names(option))
    if NONE in names and len(names) > 1:
        raise hd.MethodError(f"`--estimate {option}`: name parameters, or `{NONE}` alone")
    return tuple(name for name in names if name != NONE)


def estimate_response(
    vehicle: hd.Vehicle, log: hd.Log, models: Sequence[hd.DampingModel], names: Sequence[str]
) -> hd.CommandResponse | None:
    """Return the estimated response of the commands, None where no name requests it."""
    from hydrodamp.identification.command_response import PARAMETERS
    from hydrodamp.identification.parameters import VEHICLE_PARAMETERS

    known = (*PARAMETERS, *VEHICLE_PARAMETERS, GAINS)
    if unknown := [name for name in names if name not in known]:
        raise hd.MethodError(no_such("parameter", unknown[0], known))
    commands = [name for name in names if name in PARAMETERS]
    if not commands:
        return None
    with warnings.catch_warnings():  # the problem of the shifted log gives them again
        warnings.simplefilter("ignore", hd.HydrodampWarning)
        problem = hd.prepare(vehicle, log, models)
    response = hd.estimate_command_response(problem, models[0], commands)
    note(f"{response}.")
    if response.is_significant:
        note(f"For other commands, write `steps: [{response.mapping_steps}]` in the mapping.")
    return response


def set_options(
    methods: Sequence[hd.Method], names: Sequence[str], option: str | None, flag: str
) -> tuple[hd.Method, ...]:
    """Return the methods with the parameters that they estimate."""
    from hydrodamp.identification.parameters import VEHICLE_PARAMETERS

    of_vehicle = tuple(name for name in names if name in VEHICLE_PARAMETERS)
    is_minimised = any(isinstance(each, hd.OutputError) for each in methods)
    if of_vehicle and not is_minimised:
        keys = " ".join(f"`{each.key}`" for each in methods)
        raise hd.MethodError(
            f"{keys} does not estimate {' '.join(of_vehicle)}: use `{flag} recommended` or "
            f"`oe`, or `--estimate {NONE}` to keep the values of the vehicle file"
        )
    free = None if option is not None and not names else of_vehicle
    return tuple(
        replace(each, estimate=free) if isinstance(each, hd.OutputError) else each
        for each in methods
    )


def note_stopped(method: hd.Method, fits: Sequence[hd.Fit]) -> None:
    """Name the setting for more iterations where a fit has stopped before it converged."""
    stopped = [fit.model.key for fit in fits if fit.status is hd.Status.STOPPED]
    if stopped and isinstance(method, hd.OutputError):
        note(
            f"`{method.key}` has not converged on {', '.join(stopped)}: in Python, "
            f"`max_iterations={2 * method.max_iterations}` of the method allows twice as many "
            "iterations; where these change nothing, no step lowers the objective."
        )
