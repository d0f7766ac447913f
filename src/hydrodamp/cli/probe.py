"""``hydrodamp probe``: what is in a log, and is it fit for the job."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import hydrodamp as hd
from hydrodamp.cli import options
from hydrodamp.cli.output import emit, note, print_results
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
    from hydrodamp.ingest.inspection.probe import describe_join, inspect
    from hydrodamp.report.probe_tables import probe_document, probe_tables

    needs = None if vehicle is None else partial(_needs, hd.find_vehicle(vehicle))
    if draft is not None:
        from hydrodamp.results import check_new_file

        check_new_file(draft, force)
    recordings = [hd.read_recording(path, mapping) for path in dict.fromkeys(logs)]
    if message := describe_join(recordings):
        note(message)
    with progress("looking through it"):
        result = hd.probe(*recordings)
        judged = inspect(result, recordings, mapping, needs)
    if draft is not None:
        save_text(result.draft.text, draft)
        note(f"wrote {draft}")
    if json:
        emit(probe_document(result, judged))
    else:
        print_results(*probe_tables(result, judged))
        if judged.report is not None and judged.report.is_poorly_excited:
            note("`hydrodamp plan --vehicle V --model M --duration 600` says what to sail instead.")


def _needs(vehicle: hd.Vehicle, log: hd.Log) -> Requirements:
    """Return what a vehicle needs of a log, and which wrench of its the motion contradicts."""
    from hydrodamp.simulation.checks import log_requirements, missing_actuation
    from hydrodamp.validation.actuator_check import check_gains

    needs, model = log_requirements(vehicle, log), hd.catalog["fossen"]
    if needs.missing or missing_actuation(vehicle, log):
        return needs
    return replace(needs, suspicions=tuple(check_gains(hd.prepare(vehicle, log, model), [model])))
