"""``hydrodamp plan``: design the excitation of the next dive and predict its accuracy."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import hydrodamp as hd
from hydrodamp.cli import options, resolve
from hydrodamp.cli.output import emit, note, print_results


def plan(
    duration: Annotated[float, options.option("plan-duration")],
    out: Annotated[Path, options.option("plan-out")],
    vehicle: options.VehicleName = "",
    model: Annotated[str, options.option("plan-model")] = "",
    damping: Annotated[str | None, options.option("plan-damping")] = None,
    envelope: Annotated[str | None, options.option("plan-envelope")] = None,
    goal: Annotated[str | None, options.option("plan-goal")] = None,
    criterion: Annotated[
        Literal["determinant", "worst", "replay"], options.option("plan-criterion")
    ] = "determinant",
    mode: Annotated[
        Literal["waypoints", "setpoints", "overlays"] | None, options.option("plan-mode")
    ] = None,
    seed: Annotated[int, options.option("plan-seed")] = 0,
    force: options.Force = False,
    json: options.Json = False,
) -> None:
    """Plan the next dive for identification, and predict the accuracy of the coefficients."""
    from hydrodamp.experiment_design.result import plan_document
    from hydrodamp.report.plan_report import RESULTS, prediction_table, segment_table, write_plan
    from hydrodamp.results import check_results

    check_results(out, RESULTS, force)
    vehicle_model = resolve.find_vehicle(vehicle)
    listed = resolve.find_model(model)
    if listed.selects_terms:
        raise hd.ModelError("`--model sparse` needs a log: give a model with terms.")
    (damping_model,) = listed.models
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
