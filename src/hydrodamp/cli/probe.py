"""``hydrodamp probe``: what is in a log, and is it fit for the job."""

from __future__ import annotations

import warnings
from functools import partial
from typing import Annotated

import typer

from hydrodamp.cli import options
from hydrodamp.cli.output import emit, note, results


def probe(
    logs: options.SomeLogs,
    vehicle: Annotated[
        str | None,
        typer.Option(
            "--vehicle",
            metavar="V",
            help=f"Judge the log for this vehicle: one of {options.FLEET}, or a YAML file.",
        ),
    ] = None,
    mapping: options.MappingFile = None,
    draft: Annotated[
        str | None,
        typer.Option("--draft", metavar="FILE", help="Save the draft of a mapping file."),
    ] = None,
    force: options.Force = False,
    json: options.Json = False,
) -> None:
    """Look through a log: what is in it, what is missing, is it fit for the job."""
    from hydrodamp.cli.targets import check_new_file
    from hydrodamp.errors import HydrodampWarning
    from hydrodamp.files import save_text
    from hydrodamp.ingest.probing.probe import judge, probe as look
    from hydrodamp.ingest.read import read_recording
    from hydrodamp.progress import progress
    from hydrodamp.report.grid import show
    from hydrodamp.report.probe_tables import probe_document, probe_grids
    from hydrodamp.simulation.checks import needs_of
    from hydrodamp.vehicle.fleet import find_vehicle

    needs = None
    if vehicle is not None:
        with warnings.catch_warnings():  # the verdict says what is to be said of the vehicle
            warnings.simplefilter("ignore", HydrodampWarning)
            needs = partial(needs_of, find_vehicle(vehicle))
    if draft is not None:
        check_new_file(draft, force)
    recordings = [read_recording(path) for path in dict.fromkeys(logs)]
    with progress("looking through it"):
        found = look(recordings[0])
        judged = judge(found, recordings, mapping, needs)
    if draft is not None:
        save_text(found.draft.text, draft)
        note(f"wrote {draft}")
    if json:
        emit(probe_document(found, judged))
    else:
        show(results(), *probe_grids(found, judged))
