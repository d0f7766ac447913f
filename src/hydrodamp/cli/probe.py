"""``hydrodamp probe``: inspect a log and check that it suits identification."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import hydrodamp as hd
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
    from hydrodamp.ingest.inspection.probe import joined, judge
    from hydrodamp.report.probe_tables import probe_document, probe_tables

    requirements = None if vehicle is None else partial(_requirements, hd.find_vehicle(vehicle))
    if draft is not None:
        from hydrodamp.results import check_new_file

        check_new_file(draft, force)
    recordings = [hd.read_recording(path, mapping) for path in dict.fromkeys(logs)]
    if message := joined(recordings):
        note(message)
    with progress("inspecting"):
        result = hd.probe(*recordings)
        judged = judge(result, recordings, mapping, requirements)
    if draft is not None:
        save_text(result.draft.text, draft)
        note(f"written to {draft}")
    if json:
        emit(probe_document(result, judged))
    else:
        print_results(*probe_tables(result, judged))
        if judged.verdict is not None and judged.verdict.moves_too_little:
            note("`hydrodamp plan` designs a dive with sufficient excitation.")


def _requirements(vehicle: hd.Vehicle, log: hd.Log) -> Requirements:
    """Return the requirements of a vehicle, and axes whose wrench contradicts the motion."""
    from hydrodamp.simulation.checks import needs_of, nothing_drives
    from hydrodamp.validation.actuator_check import doubts

    requirements, model = needs_of(vehicle, log), hd.catalog["fossen"]
    if requirements.missing or nothing_drives(vehicle, log):
        return requirements
    return replace(requirements, suspicions=tuple(doubts(hd.prepare(vehicle, log, model), [model])))
