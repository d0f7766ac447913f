"""Commands ``probe`` and ``convert``: inspect a log, and convert it to the canonical form."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import hydrodamp as hd
from hydrodamp.cli.inputs import list_models, read_logs
from hydrodamp.cli.output import (
    check_out_log,
    collected_warnings,
    note,
    print_output,
    warn_quality_issues,
)
from hydrodamp.files import save_text
from hydrodamp.progress import progress
from hydrodamp.results import check_new_file

if TYPE_CHECKING:
    from hydrodamp.report.table import Table


def convert(
    logs: list[str],
    out: Path,
    mapping: str | None = None,
    force: bool = False,
    json: bool = False,
) -> None:
    """Convert a log to the canonical form: one clock, SI units, steps of the mapping applied."""
    check_out_log(out, force)
    log = read_logs(logs, mapping)
    warn_quality_issues(log)
    if names := ", ".join(each.name for each in log.measurements):
        note(f"the canonical form has one clock: the sensors {names} are not part of it.")
    hd.write_log(log, out)
    note(f"written to {out}")
    print_output(json, log_document(log) | {"paths": {"log": str(out)}}, str(log))


def log_document(log: hd.Log) -> dict[str, object]:
    """Return samples, duration, segments and commands of a log, and the warnings."""
    return {
        "format": "hydrodamp-log",
        "version": 1,
        "samples": log.n,
        "duration": log.duration,
        "segments": [segment.name for segment in log.segments],
        "commands": list(log.command_names),
        "warnings": [*collected_warnings().get("warnings", "").splitlines(), *log.notes],
    }


def probe(
    logs: list[str],
    vehicle: str | None = None,
    mapping: str | None = None,
    model: str | None = None,
    draft: Path | None = None,
    force: bool = False,
    json: bool = False,
) -> None:
    """Inspect a log: columns, units, frames, data quality, and fitness for identification."""
    from hydrodamp.identification.log_requirements import find_requirements
    from hydrodamp.ingest.inspection.draft_files import add_steps
    from hydrodamp.ingest.inspection.probe import describe_join, inspect
    from hydrodamp.ingest.read import read_recordings
    from hydrodamp.report.probe_tables import probe_document, probe_tables

    requirements = None if vehicle is None else partial(find_requirements, hd.find_vehicle(vehicle))
    if draft is not None:
        check_new_file(draft, force)
    recordings = read_recordings(dict.fromkeys(logs), mapping)
    if message := describe_join(recordings):
        note(message)
    with progress("inspecting"):
        result = hd.probe(*recordings)
        judged = inspect(result, recordings, mapping, requirements)
        text = add_steps(result.draft.text, judged.report)
        has_steps = text != result.draft.text
        result = replace(result, draft=replace(result.draft, text=text))
        if has_steps and judged.is_drafted and mapping is None:
            judged = inspect(result, recordings, needs=requirements)  # as cleaned by these steps
    if draft is not None:
        save_text(result.draft.text, draft)
        note(f"written to {draft}; check every line, then use `--mapping {draft}`")
    tables = [*probe_tables(result, judged), *_sensor_tables(vehicle, model, judged.log)]
    print_output(json, probe_document(result, judged), *tables)
    if not json and judged.report is not None and judged.report.is_poorly_excited:
        note("`hydrodamp plan` designs a dive with sufficient excitation.")


def _sensor_tables(vehicle: str | None, model: str | None, log: hd.Log | None) -> Iterator[Table]:
    """Yield the sensors of a log and, of a model, the standard errors that they allow."""
    from hydrodamp.conditioning.sensor_log import rebuild_velocities
    from hydrodamp.report.sensor_tables import sensor_table, sensor_tables

    if log is None or not log.measurements:
        return
    if vehicle is None or model is None:
        yield sensor_table(rebuild_velocities(log, log.velocity_names))
        note("`--vehicle V --model M` predicts the standard errors that these sensors allow.")
        return
    craft, models = hd.find_vehicle(vehicle), list_models(model).with_terms()
    yield from sensor_tables(hd.prepare(craft, log, models), models[0])
