"""``hydrodamp probe``: what is in a log, and is it fit for the job."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from hydrodamp.cli import options
from hydrodamp.cli.output import emit, note, results

if TYPE_CHECKING:
    from hydrodamp.data.probing.probe import Probe
    from hydrodamp.data.recording import Recording
    from hydrodamp.report.probed import Probed
    from hydrodamp.vehicle.vehicle import Vehicle


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
    from hydrodamp.vehicle.fleet import find_vehicle

    craft = None if vehicle is None else find_vehicle(vehicle)
    if draft is not None:
        check_new_file(draft, force)
    recordings = _recordings(logs)
    found, probed = _probed(logs, recordings, mapping, craft)
    if draft is not None:
        save_text(found.draft.text, draft)
        note(f"wrote {draft}")
    if json:
        emit(probed_document(found, probed))
    else:
        show(results(), *probed_grids(found, probed))


def _recordings(logs: list[str]) -> list[Recording]:
    from hydrodamp.cli.reading import reading
    from hydrodamp.data.read import read_recording

    paths, found = tuple(dict.fromkeys(logs)), []
    with reading(paths) as done:
        for path in paths:
            found.append(read_recording(path))
            done(path)
    return found


def _probed(
    logs: list[str], recordings: list[Recording], mapping: str | None, craft: Vehicle | None
) -> tuple[Probe, Probed]:
    """Look at the first recording, make a log of all, and judge it."""
    from hydrodamp.cli.progress import progress
    from hydrodamp.cli.select import read
    from hydrodamp.data.probing.probe import is_canonical, probe as look
    from hydrodamp.report.probed import by_guess, judged

    with progress("looking through it"):
        found = look(recordings[0])
    if mapping is not None:
        log, way = read(logs, mapping), f"by the mapping {mapping}"
    elif all(map(is_canonical, recordings)):
        log, way = read(logs, None), ""
    else:
        return found, by_guess(found, recordings, craft)
    return found, judged(log, way, craft)
