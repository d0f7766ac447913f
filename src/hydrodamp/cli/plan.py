"""``hydrodamp plan``: design the excitation of the next dive and predict its accuracy."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import hydrodamp as hd
from hydrodamp.cli.inputs import find_model, read_damping_and_vehicle
from hydrodamp.cli.output import note, print_output
from hydrodamp.errors import ProblemError
from hydrodamp.results import check_results


def plan(
    duration: float,
    out: Path,
    vehicle: str = "",
    model: str = "",
    damping: str | None = None,
    envelope: str | None = None,
    mode: Literal["waypoints", "setpoints", "overlays"] | None = None,
    force: bool = False,
    verbose: bool = False,
    json: bool = False,
) -> None:
    """Plan the next dive for identification, and predict the accuracy of the coefficients."""
    from hydrodamp.experiment_design.envelope import read_envelope
    from hydrodamp.experiment_design.result import plan_document
    from hydrodamp.report.plan_report import RESULTS, prediction_table, segment_table, write_plan

    check_results(out, RESULTS, force)
    prior: hd.Damping | None = None
    fit: hd.Fit | None = None
    if damping is not None:
        prior, fit, craft = read_damping_and_vehicle(damping, vehicle)
        damping_model = prior.model
    elif vehicle and model:
        craft = hd.find_vehicle(vehicle)
    else:
        raise ProblemError(
            "`--vehicle` or `--model` is missing: give both, or a fit with `--damping`, whose "
            "vehicle and model are the defaults."
        )
    if model:
        (damping_model,) = find_model(model).with_terms()
    dive_plan = hd.plan(
        craft,
        damping_model,
        duration,
        damping=prior,
        envelope=None if envelope is None else read_envelope(envelope),
        mode=mode,
        fit=fit,
    )
    missing = write_plan(dive_plan, out)
    tables = segment_table(dive_plan), *((prediction_table(dive_plan),) if verbose else ())
    paths = {"paths": {"folder": str(out), "plan": str(out / "plan.csv")}}
    verdict = str(dive_plan)
    document = plan_document(dive_plan) | {"verdict": verdict} | paths
    print_output(json, document, f"Verdict: {verdict}", *tables)
    for message in missing:
        note(message)
    note(f"written to {out}: execute plan.csv, then run `hydrodamp identify` on its log.")
