"""``hydrodamp identify``: one model by one method, to a damping file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hydrodamp.cli import options
from hydrodamp.cli.beside import Beside
from hydrodamp.cli.guard import WORK_FAILED, WRONG_INPUT
from hydrodamp.cli.output import emit, fail, note, results

if TYPE_CHECKING:
    from hydrodamp.cli.trust import Trust
    from hydrodamp.identification.fit import Fit


def _named(context: typer.Context, model: str) -> str:
    """Refuse a call without a model in a sentence that says where there are some."""
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
            callback=_named,
            show_default=False,
        ),
    ],
    logs: options.Logs = None,
    method: Annotated[
        str, typer.Option("--method", metavar="KEY", help=f"How: {options.METHODS}.")
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
    from dataclasses import replace

    from hydrodamp.cli.choose import SPARSE, choose_model, file_of, with_sparse
    from hydrodamp.cli.experiment import check_before, check_samples, fit_all
    from hydrodamp.cli.record import record
    from hydrodamp.cli.report import offer_of_fit
    from hydrodamp.cli.select import train_alone
    from hydrodamp.cli.trust import Trust, trust
    from hydrodamp.identification.methods import find_method
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
    check_before(craft, log, (chosen,))
    check_samples(craft, log, (chosen,))
    (fit,) = fit_all(craft, log, (chosen,), (way,))
    found = trust(craft, log, fit) if fit.status.usable and not json else Trust()
    deliver(fit, beside, json, found)
    if beside is not None:
        told = replace(fit, remarks=(*fit.remarks, *found.words))
        offer_of_fit(told, craft, log, said, beside)


def deliver(fit: Fit, beside: Beside | None, json: bool, trust: Trust) -> None:
    """Print and write a fit; end with status 1 if it has no numbers."""
    from hydrodamp.files import save_json
    from hydrodamp.report.document import fit_document
    from hydrodamp.report.fit_grid import fit_grid
    from hydrodamp.report.screen import show

    document = fit_document(fit)
    if json:
        emit(document)
    else:
        show(results(), fit_grid(fit, trust.grades))
        for part in trust.words:
            results().print(f"\n{part}", markup=False, highlight=False)
    if not fit.status.usable:
        fail(" ".join((fit.status.value, *fit.remarks)), WORK_FAILED)
    if beside is not None:
        instead = ", in place of an earlier one" if beside.damping.exists() else ""
        for path in beside.earlier():
            path.unlink(missing_ok=True)
        save_json(document, beside.damping)
        note(f"written to {beside.damping}{instead}")
