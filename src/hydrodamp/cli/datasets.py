"""``hydrodamp datasets``: public logs by name."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

import hydrodamp as hd
from hydrodamp.cli import options
from hydrodamp.cli.output import emit, note, print_results
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
    from hydrodamp.ingest.datasets import look

    if name is None:
        _list(json)
        return
    dataset = hd.find_dataset(name)
    target = folder or Path("datasets", name)
    present = look(dataset, target)
    note(f"{dataset.title}\n{dataset.note}\nSource: {dataset.page}")
    note(f"Licence: {dataset.licence}\nCite: {dataset.citation}")
    here = hd.fetch(dataset, target) if yes else present
    if len(here.lacking) == len(dataset.files):
        raise FileError(
            f"{target}: holds none of the {len(dataset.files)} files of '{name}', such as"
            f" {dataset.files[0].name}. They come from {dataset.page}; --yes accepts the licence"
            " and downloads those that have an address."
        )
    downloaded = [file for file in present.lacking if file not in here.lacking]
    if json:
        document = {"dataset": name, "mapping": dataset.mapping, "downloaded": downloaded}
        emit(asdict(here) | document | {"folder": str(target)})
        return
    for names, state in (
        (downloaded, "downloaded"),
        (here.verified, "with the checksum that hydrodamp knows"),
        (here.unchecked, "taken as they are: no checksum is known"),
        (here.lacking, "not there"),
    ):
        if names:
            note(f"{len(names)} of {len(dataset.files)} files {state}")
    note(f"Read with: --mapping {dataset.mapping}")
    typer.echo(str(target))


def _list(json: bool) -> None:
    from hydrodamp.ingest.datasets import datasets as known
    from hydrodamp.report.table import Table

    listed = tuple(known().values())
    if json:
        emit({"datasets": [asdict(dataset) for dataset in listed]})
        return
    rows = tuple(
        (dataset.name, str(len(dataset.files)), dataset.mapping, dataset.title)
        for dataset in listed
    )
    notes = ("Fetch one: hydrodamp datasets NAME. None is part of hydrodamp; mind the licences.",)
    header = ("name", "files", "mapping", "title")
    print_results(Table.of_words("Public logs", header, "lrll", rows, notes))
