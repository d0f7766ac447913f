"""``hydrodamp identify``: one model by one method, to a damping file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hydrodamp.cli import options
from hydrodamp.cli.output import WORK_FAILED, WRONG_INPUT, emit, fail, note, results

if TYPE_CHECKING:
    from hydrodamp.data.log import Log
    from hydrodamp.identification.fit import Fit
    from hydrodamp.identification.grades import Identifiability
    from hydrodamp.vehicle.vehicle import Vehicle


def _one_model(context: typer.Context, model: str) -> str:
    """Refuse a call without a model, or with several."""
    if not model and not context.resilient_parsing:  # as a shell does that completes words
        fail(
            "`--model` is missing: name one of `hydrodamp models`, a YAML file of your own, or "
            "`sparse`, which is selected from the log.",
            WRONG_INPUT,
        )
    if "," in model:
        fail(
            f"`--model {model}`: identify takes one model; `hydrodamp compare --models` takes "
            "several.",
            WRONG_INPUT,
        )
    return model


def identify(
    vehicle: options.VehicleName,
    model: Annotated[
        str,
        typer.Option(
            "--model",
            metavar="M",
            help="A model by name, a YAML file of one, or FILE:NAME. [required]",
            default_factory=str,
            callback=_one_model,
            show_default=False,
        ),
    ],
    logs: options.Logs = None,
    method: Annotated[
        str, typer.Option("--method", metavar="KEY", help=f"How: {options.KEYS}.")
    ] = options.DEFAULT_METHOD,
    train: options.Train = None,
    mapping: options.MappingFile = None,
    out: Annotated[
        str | None,
        typer.Option(
            "--out",
            metavar="FILE",
            help="Write a damping file, and beside it pictures and a report.",
        ),
    ] = None,
    json: options.Json = False,
) -> None:
    """Identify one model, say how far to trust it, and write its damping file."""
    from hydrodamp.cli.choose import SPARSE, choose_model, file_of, with_sparse
    from hydrodamp.cli.parts import train_alone
    from hydrodamp.cli.report import Beside
    from hydrodamp.cli.targets import record
    from hydrodamp.cli.work import check_training, fit_all
    from hydrodamp.files import save_json
    from hydrodamp.identification.methods import find_method
    from hydrodamp.report.documents import fit_document
    from hydrodamp.report.fit_tables import fit_grid
    from hydrodamp.report.grid import show
    from hydrodamp.simulation.problem import prepare
    from hydrodamp.vehicle.fleet import find_vehicle

    inputs = (*(logs or ()), *(train or ()), vehicle, file_of(model), mapping)
    beside = None if out is None else Beside(Path(out))
    if beside is not None:
        beside.check(inputs)
    craft, way = find_vehicle(vehicle), find_method(method)
    named = () if model == SPARSE else (choose_model(model),)
    said = record(inputs)
    log = train_alone(logs or (), train or (), mapping)
    (chosen,) = named or with_sparse(craft, log, ())
    check_training(craft, log, (chosen,))
    fits: dict[tuple[str, str], Fit] = {}
    fit_all(prepare(craft, log, chosen), (chosen,), (way,), fits)
    (fit,) = fits.values()
    grades, words = (None, ()) if json or not fit.status.usable else trust(craft, log, fit)
    if json:
        emit(fit_document(fit))
    else:
        show(results(), fit_grid(fit, grades))
        for part in words:
            results().print(f"\n{part}", markup=False, highlight=False)
    if not fit.status.usable:
        fail(" ".join((fit.status.value, *fit.remarks)), WORK_FAILED)
    if beside is not None:
        instead = ", in place of an earlier one" if beside.damping.exists() else ""
        beside.remove_earlier()
        save_json(fit_document(fit), beside.damping)
        note(f"written to {beside.damping}{instead}")
        beside.illustrate(fit, words, craft, log, said)


def trust(vehicle: Vehicle, log: Log, fit: Fit) -> tuple[Identifiability | None, tuple[str, ...]]:
    """Return grades, and what residuals and a wrong vehicle say, in words."""
    from hydrodamp.errors import HydrodampError
    from hydrodamp.identification.grades import graded
    from hydrodamp.identification.methods import find_method
    from hydrodamp.identification.residuals import diagnose
    from hydrodamp.progress import counted
    from hydrodamp.simulation.problem import prepare
    from hydrodamp.validation.vehicle_doubt import vehicle_doubt

    problem, model = prepare(vehicle, log, fit.model), fit.model
    grades: list[Identifiability] = []
    quick = find_method("weak")

    def determined() -> str:
        grades.append(graded(problem, fit))
        return grades[0].summary

    def wrong_vehicle() -> str:
        doubt = str(vehicle_doubt(vehicle, log, log, model, quick))
        if fit.method != quick.key:
            doubt += f"\n  All of this by {quick.key}, for speed; the fit above is by {fit.method}."
        return doubt

    questions: dict[str, Callable[[], str]] = {
        "what the log determines": determined,
        "the residuals": lambda: "\n".join(diagnose(problem, model, fit.damping).remarks),
        "what a wrong vehicle does": wrong_vehicle,
    }
    words = []
    for what, ask in counted(questions.items(), "asking", len(questions)):
        try:
            words.append(ask())
        except HydrodampError as error:
            words.append(f"Not answered, {what}: {error}")
    return next(iter(grades), None), tuple(filter(None, words))
