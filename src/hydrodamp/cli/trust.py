"""What ``identify`` says beside its numbers: grades, residuals, and a wrong vehicle."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hydrodamp.data.log import Log
    from hydrodamp.identification.fit import Fit
    from hydrodamp.vehicle.vehicle import Vehicle


def trust(vehicle: Vehicle, log: Log, fit: Fit) -> tuple[str, ...]:
    """Say how far a fit is to be trusted.

    Parameters
    ----------
    vehicle : Vehicle
        Everything known.
    log : Log
        What it was identified from.
    fit : Fit
        With numbers.

    Returns
    -------
    words : tuple of str
        What the log determines, what the residuals say, and how far the coefficients
        move where the vehicle's numbers are wrong by a tenth. Part of it is left out
        where the log is too short for it, with a sentence.
    """
    from hydrodamp.cli.progress import stages
    from hydrodamp.errors import HydrodampError
    from hydrodamp.identification.regression.weak import WeakForm
    from hydrodamp.identification.trust.diagnostics import diagnose
    from hydrodamp.identification.trust.identifiability import identifiability
    from hydrodamp.simulation.problem import prepare
    from hydrodamp.validation.vehicle_error import vehicle_doubt

    problem, model = prepare(vehicle, log, fit.model), fit.model
    asked: dict[str, Callable[[], str]] = {
        "what the log determines": lambda: str(identifiability(problem, model)),
        "the residuals": lambda: "\n".join(diagnose(problem, model, fit.damping).remarks),
        "what a wrong vehicle does": lambda: str(
            vehicle_doubt(vehicle, log, log, model, WeakForm())
        ),
    }
    words = []
    with stages("asking") as reach:
        for place, (what, ask) in enumerate(asked.items()):
            reach(what, place, len(asked))
            try:
                words.append(ask())
            except HydrodampError as error:
                words.append(f"Not said: {error}")
    return tuple(part for part in words if part)
