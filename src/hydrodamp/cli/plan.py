"""``hydrodamp plan``: the next dive, and what it will determine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

import hydrodamp as hd
from hydrodamp.cli import options, resolve
from hydrodamp.cli.output import emit, note, show

_MODEL = "The model to identify: by name, a YAML file of one, or FILE:NAME. [required]"
_DAMPING = "What is known: a damping file, as identify writes. Else published, or by the hull."
_ENVELOPE = "What the dive may do: depth, angles, speed, limits, area; a YAML file."
_GOAL = "The shortest dive to this grade: determined, minor or weak; --duration is the longest."
_CRITERION = "What is made small: determinant, worst, or the error of a replay."
_MODE = "How it is executed. [default: setpoints; overlays where a vehicle hovers]"
_FILES = "Write the table of orders, waypoints, a bag, the track, pictures and a page."


def plan(
    duration: Annotated[float, typer.Option(metavar="S", help="Length of the dive [s].")],
    out: Annotated[Path, typer.Option(metavar="DIR", help=_FILES)],
    vehicle: options.VehicleName = "",
    model: Annotated[str, typer.Option(metavar="M", help=_MODEL, show_default=False)] = "",
    damping: Annotated[str | None, typer.Option(metavar="JSON", help=_DAMPING)] = None,
    envelope: Annotated[str | None, typer.Option(metavar="FILE", help=_ENVELOPE)] = None,
    goal: Annotated[str | None, typer.Option(metavar="GRADE", help=_GOAL)] = None,
    criterion: Annotated[
        Literal["determinant", "worst", "replay"], typer.Option(help=_CRITERION)
    ] = "determinant",
    mode: Annotated[
        Literal["waypoints", "setpoints", "overlays"] | None,
        typer.Option(help=_MODE, show_default=False),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Of draws and noise.")] = 0,
    force: options.Force = False,
    json: options.Json = False,
) -> None:
    """Plan the next dive: what to steer, where it goes, and what it will determine."""
    from hydrodamp.experiment_design.result import plan_document
    from hydrodamp.report.plan_report import RESULTS, prediction_table, segment_table, write_plan
    from hydrodamp.results import check_results

    check_results(out, RESULTS, force)
    craft = resolve.choose_vehicle(vehicle)
    if resolve.selects(model):
        raise hd.ModelError("`sparse` is selected from a log: name a model with terms.")
    (asked,) = resolve.choose_model(model)
    found = hd.plan(
        craft,
        asked,
        duration,
        damping=None if damping is None else hd.read_damping(damping),
        envelope=None if envelope is None else hd.read_envelope(envelope),
        goal=goal,
        criterion=criterion,
        mode=mode,
        seed=seed,
    )
    missing = write_plan(found, out)
    if json:
        emit(plan_document(found))
    else:
        show(segment_table(found), prediction_table(found), str(found))
    for sentence in missing:
        note(sentence)
    note(f"written to {out}: execute plan.csv, then `hydrodamp identify`.")
