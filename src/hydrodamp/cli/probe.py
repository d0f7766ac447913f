"""``hydrodamp probe``: what is in a log, and is it fit for the job."""

from __future__ import annotations

import warnings
from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from hydrodamp.cli import options
from hydrodamp.cli.output import emit, note, results

if TYPE_CHECKING:
    from hydrodamp.data.recording import Recording
    from hydrodamp.ingest.probing.judged import Judged
    from hydrodamp.ingest.probing.probe import Probe
    from hydrodamp.vehicle.vehicle import Vehicle

_LOOKED = 0.3
"""What share of the time it takes to look at a recording; the rest makes and judges a log."""


def probe(
    logs: Annotated[
        list[str],
        typer.Argument(
            metavar="LOG", help="Logs: files or folders of any format, one after another."
        ),
    ],
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
    from hydrodamp.files import save_text
    from hydrodamp.report.probe_tables import probe_document, probe_grids
    from hydrodamp.report.screen import show

    craft = None if vehicle is None else _vehicle(vehicle)
    if draft is not None:
        check_new_file(draft, force)
    recordings = _recordings(logs)
    found, judged = _judged(recordings, mapping, craft)
    if draft is not None:
        save_text(found.draft.text, draft)
        note(f"wrote {draft}")
    if json:
        emit(probe_document(found, judged))
    else:
        show(results(), *probe_grids(found, judged))


def _vehicle(name: str) -> Vehicle:
    """Return the vehicle without its warnings: the verdict says them."""
    from hydrodamp.errors import HydrodampWarning
    from hydrodamp.vehicle.fleet import find_vehicle

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", HydrodampWarning)
        return find_vehicle(name)


def _recordings(logs: list[str]) -> list[Recording]:
    from hydrodamp.cli.reading import reading
    from hydrodamp.ingest.read import read_recordings

    paths = tuple(dict.fromkeys(logs))
    with reading(paths):
        return read_recordings(paths)


def _judged(
    recordings: list[Recording], mapping: str | None, craft: Vehicle | None
) -> tuple[Probe, Judged]:
    """Look at the first recording, make a log of all, and judge it."""
    from hydrodamp.advance import within
    from hydrodamp.cli.progress import followed
    from hydrodamp.ingest.probing.judged import judge
    from hydrodamp.ingest.probing.probe import probe as look
    from hydrodamp.simulation.fitness import needs_of

    messages = sum(recording.n for recording in recordings)
    with followed("looking through it", messages):
        with within(0.0, _LOOKED):
            found = look(recordings[0])
        with within(_LOOKED, 1.0):
            needs = None if craft is None else partial(needs_of, craft)
            return found, judge(found, recordings, mapping, needs)
