"""What ``identify`` says beside its numbers: grades, residuals, and a wrong vehicle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hydrodamp.data.log import Log
    from hydrodamp.identification.fit import Fit
    from hydrodamp.identification.trust.identifiability import Identifiability
    from hydrodamp.vehicle.vehicle import Vehicle


@dataclass(frozen=True)
class Trust:
    """How far a fit is to be trusted."""

    grades: Identifiability | None = None
    words: tuple[str, ...] = ()


def trust(vehicle: Vehicle, log: Log, fit: Fit) -> Trust:
    """Say how far a fit is to be trusted."""
    from hydrodamp.cli.progress import stages
    from hydrodamp.errors import HydrodampError
    from hydrodamp.identification.regression.weak import WeakForm
    from hydrodamp.identification.trust.diagnostics import diagnose
    from hydrodamp.identification.trust.grading import graded
    from hydrodamp.simulation.problem import prepare
    from hydrodamp.validation.vehicle_error import vehicle_doubt

    problem, model = prepare(vehicle, log, fit.model), fit.model
    grades: list[Identifiability] = []

    def determined() -> str:
        grades.append(graded(problem, fit))
        return grades[0].summary

    def wrong_vehicle() -> str:
        quick = WeakForm()
        doubt = str(vehicle_doubt(vehicle, log, log, model, quick))
        if fit.method == quick.key:
            return doubt
        return (
            f"{doubt}\n  All of this by {quick.key}, for speed; the fit above is by {fit.method}."
        )

    asked: dict[str, Callable[[], str]] = {
        "what the log determines": determined,
        "the residuals": lambda: "\n".join(diagnose(problem, model, fit.damping).remarks),
        "what a wrong vehicle does": wrong_vehicle,
    }
    words = []
    with stages("asking") as reach:
        for place, (what, ask) in enumerate(asked.items()):
            reach(what, place, len(asked))
            try:
                words.append(ask())
            except HydrodampError as error:
                words.append(f"Not said, {what}: {error}")
    return Trust(next(iter(grades), None), tuple(part for part in words if part))
