"""``hydrodamp datasets``: public logs by name."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

import hydrodamp as hd
from hydrodamp.cli import options
from hydrodamp.cli.output import emit, note, show
from hydrodamp.errors import FileError


def datasets(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="Which to fetch; all are listed if none.")
    ] = None,
    folder: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Where its files are kept. [default: datasets/NAME]"),
    ] = None,
    yes: Annotated[
        bool, typer.Option("--yes", help="Accept the licence, and download what is not there.")
    ] = False,
    json: options.Json = False,
) -> None:
    """List public logs, or fetch one: licence first, each file checked."""
    from hydrodamp.ingest.datasets import check_folder

    if name is None:
        _list(json)
        return
    dataset = hd.find_dataset(name)
    place = folder or Path("datasets", name)
    before = check_folder(dataset, place)
    note(f"{dataset.title}\n{dataset.note}\nSource: {dataset.page}")
    note(f"Licence: {dataset.licence}\nCite: {dataset.citation}")
    here = hd.fetch(dataset, place) if yes else before
    if len(here.lacking) == len(dataset.files):
        raise FileError(
            f"{place}: holds none of the {len(dataset.files)} files of '{name}', such as"
            f" {dataset.files[0].name}. They come from {dataset.page}; --yes accepts the licence"
            " and downloads those that have an address."
        )
    downloaded = [file for file in before.lacking if file not in here.lacking]
    if json:
        document = {"dataset": name, "mapping": dataset.mapping, "downloaded": downloaded}
        emit(asdict(here) | document | {"folder": str(place)})
        return
    for names, said in (
        (downloaded, "downloaded"),
        (here.verified, "with the checksum that hydrodamp knows"),
        (here.unchecked, "taken as they are: no checksum is known"),
        (here.lacking, "not there"),
    ):
        if names:
            note(f"{len(names)} of {len(dataset.files)} files {said}")
    note(f"Read with: --mapping {dataset.mapping}")
    typer.echo(str(place))


def _list(json: bool) -> None:
    from hydrodamp.ingest.datasets import datasets as known
    from hydrodamp.report.table import Table

    listed = tuple(known().values())
    if json:
        emit({"datasets": [asdict(one) for one in listed]})
        return
    rows = tuple((one.name, str(len(one.files)), one.mapping, one.title) for one in listed)
    notes = ("Fetch one: hydrodamp datasets NAME. None is part of hydrodamp; mind the licences.",)
    header = ("name", "files", "mapping", "title")
    show(Table.of_words("Public logs", header, "lrll", rows, notes))
