"""``hydrodamp plan``: design the excitation of the next dive and predict its accuracy."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

import hydrodamp as hd
from hydrodamp.cli import options, resolve
from hydrodamp.cli.output import emit, note, print_results

_MODEL = "Model to identify: name, YAML file of one model, or FILE:NAME. [required]"
_DAMPING = "Prior estimate: a damping file. [default: published, or estimated from the hull]"
_ENVELOPE = "YAML file of constraints: depth, angles, speed, actuator limits, area."
_GOAL = "Find the shortest dive that reaches this grade (determined, minor, weak) in --duration."
_CRITERION = "Optimality: determinant (D), worst coefficient (minimax), or replay error (I)."
_MODE = "Execution of the plan. [default: setpoints; overlays if the vehicle can hover]"
_FILES = "Folder for the plan: setpoints, waypoints, ROS 2 bag, track, pictures and report."


def plan(
    duration: Annotated[float, typer.Option(metavar="S", help="Duration of the dive [s].")],
    out: Annotated[Path, options.out_option("DIR", _FILES)],
    vehicle: options.VehicleName = "",
    model: Annotated[str, options.model_option(_MODEL)] = "",
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
    seed: Annotated[
        int,
        typer.Option(min=0, metavar="N", help="Seed of the Monte Carlo ensemble and the noise."),
    ] = 0,
    force: options.Force = False,
    json: options.Json = False,
) -> None:
    """Plan the next dive for identification, and predict the accuracy of the coefficients."""
    from hydrodamp.experiment_design.result import plan_document
    from hydrodamp.report.plan_report import RESULTS, prediction_table, segment_table, write_plan
    from hydrodamp.results import check_results

    check_results(out, RESULTS, force)
    vehicle_model = resolve.find_vehicle(vehicle)
    if resolve.selects_terms(model):
        raise hd.ModelError("`--model sparse` needs a log: give a model with terms.")
    (damping_model,) = resolve.find_model(model)
    dive_plan = hd.plan(
        vehicle_model,
        damping_model,
        duration,
        damping=None if damping is None else hd.read_damping(damping),
        envelope=None if envelope is None else hd.read_envelope(envelope),
        goal=goal,
        criterion=criterion,
        mode=mode,
        seed=seed,
    )
    missing = write_plan(dive_plan, out)
    if json:
        emit(plan_document(dive_plan))
    else:
        print_results(segment_table(dive_plan), prediction_table(dive_plan), str(dive_plan))
    for message in missing:
        note(message)
    note(f"written to {out}: execute plan.csv, then run `hydrodamp identify` on its log.")
