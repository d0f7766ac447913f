"""``hydrodamp probe``: what is in a log, and is it fit for the job."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Annotated

import typer

from hydrodamp.cli import options
from hydrodamp.cli.output import emit, note, results

if TYPE_CHECKING:
    from hydrodamp.data.recording import Recording
    from hydrodamp.ingest.probing.probe import Probe
    from hydrodamp.report.probed import Probed
    from hydrodamp.vehicle.vehicle import Vehicle

_LOOKED, _MADE = 0.3, 0.3
"""What share of the time it takes to look at a recording; of the rest, to make a log of it."""


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
    from hydrodamp.report.probed import probed_document, probed_grids
    from hydrodamp.report.screen import show
    from hydrodamp.saving import save_text

    craft = None if vehicle is None else _vehicle(vehicle)
    if draft is not None:
        check_new_file(draft, force)
    recordings = _recordings(logs)
    found, probed = _probed(recordings, mapping, craft)
    if draft is not None:
        save_text(found.draft.text, draft)
        note(f"wrote {draft}")
    if json:
        emit(probed_document(found, probed))
    else:
        show(results(), *probed_grids(found, probed))


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


def _probed(
    recordings: list[Recording], mapping: str | None, craft: Vehicle | None
) -> tuple[Probe, Probed]:
    """Look at the first recording, make a log of all, and judge it."""
    from hydrodamp.advance import within
    from hydrodamp.cli.progress import followed
    from hydrodamp.ingest.probing.probe import probe as look

    messages = sum(recording.n for recording in recordings)
    with followed("looking through it", messages):
        with within(0.0, _LOOKED):
            found = look(recordings[0])
        with within(_LOOKED, 1.0):
            return found, _judged(found, recordings, mapping, craft)


def _judged(
    found: Probe, recordings: list[Recording], mapping: str | None, craft: Vehicle | None
) -> Probed:
    from hydrodamp.advance import within
    from hydrodamp.ingest.probing.probe import is_canonical
    from hydrodamp.ingest.read import logs_of
    from hydrodamp.report.probed import by_guess, judged

    if mapping is None and not all(map(is_canonical, recordings)):
        return by_guess(found, recordings, craft)
    with within(0.0, _MADE):
        log = logs_of(recordings, mapping)
    with within(_MADE, 1.0):
        return judged(log, "" if mapping is None else f"by the mapping {mapping}", craft)
