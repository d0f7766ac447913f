"""``hydrodamp datasets``: public logs by name."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hydrodamp.cli import options
from hydrodamp.cli.output import emit, note, results
from hydrodamp.errors import FileError

if TYPE_CHECKING:
    from hydrodamp.ingest.datasets.fetching import Fetched
    from hydrodamp.ingest.datasets.registry import Dataset
    from hydrodamp.report.grid import Grid


def datasets(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="Which to fetch; all are listed if none.")
    ] = None,
    folder: Annotated[
        str | None,
        typer.Option(
            "--folder",
            metavar="DIR",
            help="Where its files lie, or shall lie. [default: datasets/NAME]",
        ),
    ] = None,
    yes: Annotated[
        bool, typer.Option("--yes", help="Accept the licence and download without asking.")
    ] = False,
    json: options.Json = False,
) -> None:
    """List public logs, or fetch one: licence first, each file checked."""
    from hydrodamp.ingest.datasets.fetching import fetch, look
    from hydrodamp.ingest.datasets.registry import find_dataset

    if name is None:
        _list(json)
        return
    dataset = find_dataset(name)
    place = Path(folder) if folder else Path("datasets", name)
    here = look(dataset, place)
    _introduce(dataset)
    wanted = [file for file in dataset.files if file.name in here.lacking and file.url]
    if wanted and _accepted(len(wanted), yes):
        here = fetch(dataset, place)
    if len(here.lacking) == len(dataset.files):
        raise FileError(
            f"{place}: holds none of the {len(dataset.files)} files of '{name}', such as"
            f" {dataset.files[0].name}. They come from {dataset.page}"
        )
    emit(_fetched_document(here)) if json else _tell(here)


def _list(json: bool) -> None:
    from hydrodamp.ingest.datasets.registry import datasets as known
    from hydrodamp.report.grid import show

    listed = tuple(known().values())
    if json:
        emit({"datasets": [_document(dataset) for dataset in listed]})
    else:
        show(results(), _grid(listed))


def _grid(listed: tuple[Dataset, ...]) -> Grid:
    from hydrodamp.report.grid import Grid

    rows = tuple((one.name, str(len(one.files)), one.mapping, one.title) for one in listed)
    notes = ("Fetch one: hydrodamp datasets NAME. None is part of hydrodamp; mind the licences.",)
    header = ("name", "files", "mapping", "title")
    return Grid.of_words("Public logs", header, "lrll", rows, notes)


def _introduce(dataset: Dataset) -> None:
    """Say what it is and what one may do with it, before anything is downloaded."""
    for line in (
        dataset.title,
        dataset.note,
        f"Source: {dataset.page}",
        f"Licence: {dataset.licence}",
        f"Cite: {dataset.citation}",
    ):
        note(line)


def _accepted(number: int, yes: bool) -> bool:
    """Ask whether to download under the licence; no answer is none."""
    if yes:
        return True
    try:
        return typer.confirm(f"Download {_files(number)} under this licence?", err=True)
    except typer.Abort:
        note("\nNot asked for: say --yes to download without a question.")
        return False


def _tell(here: Fetched) -> None:
    for names, said in (
        (here.downloaded, "downloaded"),
        (here.verified, "as hydrodamp knows them, by checksum"),
        (here.locked, "as they were when first downloaded, by the checksum recorded then"),
        (here.unchecked, "taken as they are: no checksum is known"),
        (here.lacking, "not there"),
    ):
        if names:
            note(f"{_files(len(names))} {said}")
    if here.recorded:
        note(f"first download of {', '.join(here.recorded)}: checksums recorded, none to compare")
    note(f"Read with: --mapping {here.dataset.mapping}")
    typer.echo(str(here.folder))


def _files(number: int) -> str:
    return "1 file" if number == 1 else f"{number} files"


def _document(dataset: Dataset) -> dict[str, object]:
    return {
        "name": dataset.name,
        "title": dataset.title,
        "note": dataset.note,
        "page": dataset.page,
        "licence": dataset.licence,
        "citation": dataset.citation,
        "mapping": dataset.mapping,
        "files": {
            file.name: {"url": file.url or None, "sha256": file.sha256 or None}
            for file in dataset.files
        },
    }


def _fetched_document(here: Fetched) -> dict[str, object]:
    return {
        "dataset": here.dataset.name,
        "folder": str(here.folder),
        "mapping": here.dataset.mapping,
        "verified": here.verified,
        "locked": here.locked,
        "unchecked": here.unchecked,
        "lacking": here.lacking,
        "downloaded": here.downloaded,
        "recorded": here.recorded,
    }
