"""``hydrodamp identify``: one model by one method, to a damping file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

import hydrodamp as hd
from hydrodamp.cli import options, resolve
from hydrodamp.cli.data_split import train_alone
from hydrodamp.cli.output import emit, fail, note, show
from hydrodamp.cli.report import beside, illustrate_fit
from hydrodamp.progress import count_items

_MODEL = (
    "A model by name, a YAML file of one, or FILE:NAME; `sparse` selects one from the log. "
    "[required]"
)


def identify(
    vehicle: options.VehicleName = "",
    model: Annotated[str, typer.Option(metavar="M", help=_MODEL, show_default=False)] = "",
    logs: options.Logs = None,
    method: Annotated[
        str, typer.Option(metavar="KEY", help=f"How: {options.KEYS}.")
    ] = options.DEFAULT_METHOD,
    train: options.Train = None,
    mapping: options.MappingFile = None,
    free_gains: options.FreeGains = False,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a damping file, pictures and a report beside it."),
    ] = None,
    force: options.Force = False,
    json: options.Json = False,
) -> None:
    """Identify one model, say how far to trust it, and write its damping file."""
    from hydrodamp.cli.comparison_run import check_training, fit_all
    from hydrodamp.cli.provenance import check_out_file, record
    from hydrodamp.files import save_json
    from hydrodamp.report.documents import fit_document
    from hydrodamp.report.files import PICTURES
    from hydrodamp.report.fit_tables import fit_table
    from hydrodamp.results import check_results, remove_results

    inputs = (*(logs or ()), *(train or ()), vehicle, resolve.file_of(model), mapping)
    if out is not None:
        figures, page = beside(out)
        for path in (out, page):
            check_out_file(path, inputs, force)
        check_results(figures, PICTURES, force)
    craft, named = resolve.choose_vehicle(vehicle), resolve.choose_model(model)
    way, said = hd.find_method(method), record(inputs)
    log = train_alone(logs or (), train or (), mapping)
    check_training(craft, log, resolve.asked(model, craft, log, named))
    chosen = resolve.for_log(model, craft, log, named, free_gains)
    (fit,) = fit_all(hd.prepare(craft, log, chosen), chosen, (way,))
    is_asked = fit.status.usable and not json
    grades, words, shown = trust(craft, log, fit) if is_asked else (None, [], [])
    if out is not None and fit.status.usable:
        page.unlink(missing_ok=True)
        remove_results(figures, PICTURES)
        save_json(fit_document(fit), out)
        note(f"written to {out}")
    if json:
        emit(fit_document(fit))
    else:
        show(fit_table(replace(fit, remarks=()), grades), *shown)
    if not fit.status.usable:
        fail(" ".join((fit.status.value, *fit.remarks)))
    if out is not None:
        illustrate_fit(replace(fit, remarks=(*fit.remarks, *words)), craft, log, said, out)
    elif shown:
        note("With `--out FILE`: the damping file, and a report of the search, axes and residuals.")
    if grades is not None:
        from hydrodamp.experiment_design.plan import expected_gain

        if told := expected_gain(hd.prepare(craft, log, fit.model), fit, grades):
            note(told)


def trust(
    vehicle: hd.Vehicle, log: hd.Log, fit: hd.Fit
) -> tuple[hd.Identifiability | None, list[str], list[str]]:
    """Return grades, what is answered to questions of trust, and those answers for the screen."""
    problem, model = hd.prepare(vehicle, log, fit.model), fit.model
    questions: dict[str, Callable[[], object]] = {
        "what the log determines": lambda: hd.grade_fit(problem, fit),
        "the residuals": lambda: "\n".join(hd.diagnose(problem, fit.damping)),
        # By a quick method, whatever the fit is by.
        "a wrong vehicle": lambda: hd.vehicle_sensitivity(vehicle, log, log, model, hd.WeakForm()),
    }
    answers: list[object] = []
    unanswered: list[str] = []
    for what, ask in count_items(questions.items(), "asking", len(questions)):
        try:
            answers.append(ask())
        except hd.HydrodampError as error:
            unanswered.append(f"Not answered, {what}: {error}")
            answers.append(unanswered[-1])
    grades, said = answers[0], [text for text in map(str, answers) if text]
    shown = dict.fromkeys((*unanswered, said[-1]))  # axes and residuals are for the report
    return grades if isinstance(grades, hd.Identifiability) else None, said, [*shown]
