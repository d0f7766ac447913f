"""``hydrodamp probe``: inspect a log and check that it suits identification."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import hydrodamp as hd
from hydrodamp.basis.term import VELOCITY_OF
from hydrodamp.cli import options
from hydrodamp.cli.output import emit, note, print_results
from hydrodamp.progress import progress

if TYPE_CHECKING:
    from hydrodamp.ingest.inspection.quality_report import Requirements


def probe(
    logs: options.SomeLogs,
    vehicle: Annotated[str | None, options.option("probe-vehicle")] = None,
    mapping: options.MappingFile = None,
    draft: Annotated[Path | None, options.option("probe-draft")] = None,
    force: options.Force = False,
    json: options.Json = False,
) -> None:
    """Inspect a log: columns, units, frames, data quality, and fitness for identification."""
    from hydrodamp.files import save_text
    from hydrodamp.ingest.inspection.probe import describe_join, inspect
    from hydrodamp.report.probe_tables import probe_document, probe_tables

    requirements = None if vehicle is None else partial(_requirements, hd.find_vehicle(vehicle))
    if draft is not None:
        from hydrodamp.results import check_new_file

        check_new_file(draft, force)
    recordings = [hd.read_recording(path, mapping) for path in dict.fromkeys(logs)]
    if message := describe_join(recordings):
        note(message)
    with progress("inspecting"):
        result = hd.probe(*recordings)
        judged = inspect(result, recordings, mapping, requirements)
    if draft is not None:
        save_text(result.draft.text, draft)
        note(f"written to {draft}")
    if json:
        emit(probe_document(result, judged))
    else:
        print_results(*probe_tables(result, judged))
        if judged.report is not None and judged.report.is_poorly_excited:
            note("`hydrodamp plan` designs a dive with sufficient excitation.")


def _requirements(vehicle: hd.Vehicle, log: hd.Log) -> Requirements:
    """Return the requirements of a vehicle, with axes whose wrench contradicts the motion."""
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
    requirements = Requirements(
        velocities=tuple(VELOCITY_OF[axis] for axis in vehicle.axes),
        missing=tuple(fault for fault in missing_data(vehicle, log, ()) if fault != by_terms),
        reservations=(*unused_commands(vehicle, log, ()), *filter(None, [by_terms])),
        length=estimate_length(vehicle),
    )
    if requirements.missing or no_actuation:
        return requirements
    model = hd.catalog["fossen"]
    return replace(
        requirements, suspicions=tuple(check_gains(hd.prepare(vehicle, log, model), [model]))
    )
