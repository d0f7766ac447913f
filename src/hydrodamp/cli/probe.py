"""``hydrodamp probe``: what is in a log, and is it fit for the job."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import hydrodamp as hd
from hydrodamp.basis.atoms import VELOCITY_OF
from hydrodamp.cli import options
from hydrodamp.cli.output import emit, note, show
from hydrodamp.progress import progress

if TYPE_CHECKING:
    from hydrodamp.ingest.inspection.quality_report import Requirements


def probe(
    logs: options.SomeLogs,
    vehicle: Annotated[
        str | None,
        typer.Option(metavar="V", help=f"Judge the log for it: {options.FLEET}, or a YAML file."),
    ] = None,
    mapping: options.MappingFile = None,
    draft: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Save the draft of a mapping file.")
    ] = None,
    force: options.Force = False,
    json: options.Json = False,
) -> None:
    """Look through a log: what is in it, what is missing, is it fit for the job."""
    from hydrodamp.files import save_text
    from hydrodamp.ingest.inspection.probe import joined, judge
    from hydrodamp.report.probe_tables import probe_document, probe_tables

    needs = None if vehicle is None else partial(_needs, hd.find_vehicle(vehicle))
    if draft is not None:
        from hydrodamp.results import check_new_file

        check_new_file(draft, force)
    recordings = [hd.read_recording(path, mapping) for path in dict.fromkeys(logs)]
    if told := joined(recordings):
        note(told)
    with progress("looking through it"):
        found = hd.probe(*recordings)
        judged = judge(found, recordings, mapping, needs)
    if draft is not None:
        save_text(found.draft.text, draft)
        note(f"wrote {draft}")
    if json:
        emit(probe_document(found, judged))
    else:
        show(*probe_tables(found, judged))
        if judged.verdict is not None and judged.verdict.moves_too_little:
            note("`hydrodamp plan --vehicle V --model M --duration 600` says what to sail instead.")


def _needs(vehicle: hd.Vehicle, log: hd.Log) -> Requirements:
    """Return what a vehicle needs of a log, and which wrench of its the motion contradicts."""
    from hydrodamp.ingest.inspection.quality_report import Requirements
    from hydrodamp.simulation.checks import (
        estimate_length,
        missing_actuation,
        missing_data,
        unused_commands,
    )
    from hydrodamp.validation.actuator_check import check_gains

    no_actuation = missing_actuation(vehicle, log)
    # Terms of a model may still use the commands of a vehicle without actuators.
    by_terms = no_actuation if log.command_names and not vehicle.commands else ""
    needs = Requirements(
        velocities=tuple(VELOCITY_OF[axis] for axis in vehicle.axes),
        missing=tuple(fault for fault in missing_data(vehicle, log, ()) if fault != by_terms),
        reservations=(*unused_commands(vehicle, log, ()), *filter(None, [by_terms])),
        length=estimate_length(vehicle),
    )
    if needs.missing or no_actuation:
        return needs
    model = hd.catalog["fossen"]
    return replace(needs, suspicions=tuple(check_gains(hd.prepare(vehicle, log, model), [model])))
