"""``hydrodamp datasets``: list and download public logs."""

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
    name: Annotated[str | None, options.argument("datasets-name")] = None,
    out: Annotated[Path | None, options.option("datasets-out")] = None,
    yes: Annotated[bool, options.option("datasets-yes")] = False,
    json: options.Json = False,
) -> None:
    """List public logs, or download one with checksums verified."""
    from hydrodamp.ingest.datasets import check_folder

    if name is None:
        _list(json)
        return
    dataset = hd.find_dataset(name)
    target = out or Path("datasets", name)
    present = check_folder(dataset, target)
    note(f"{dataset.title}\n{dataset.note}\nSource: {dataset.page}")
    note(f"Licence: {dataset.licence}\nCite: {dataset.citation}")
    files = hd.fetch(dataset, target) if yes else present
    if len(files.lacking) == len(dataset.files):
        raise FileError(
            f"{target}: none of the {len(dataset.files)} files of '{name}' is present, such as"
            f" {dataset.files[0].name}. Source: {dataset.page}. Use --yes to accept the licence and"
            " download the files that have a URL."
        )
    downloaded = [file for file in present.lacking if file not in files.lacking]
    if json:
        document = {"dataset": name, "mapping": dataset.mapping, "downloaded": downloaded}
        emit(asdict(files) | document | {"folder": str(target)})
        return
    for names, state in (
        (downloaded, "downloaded"),
        (files.verified, "verified by checksum"),
        (files.unchecked, "not verified: no checksum is known"),
        (files.lacking, "missing"),
    ):
        if names:
            note(f"{len(names)} of {len(dataset.files)} files {state}")
    note(f"Read with: --mapping {dataset.mapping}")
    typer.echo(str(target))


def _list(json: bool) -> None:
    from hydrodamp.ingest.datasets import datasets as known_datasets
    from hydrodamp.report.table import Table

    available = tuple(known_datasets().values())
    if json:
        emit({"datasets": [asdict(dataset) for dataset in available]})
        return
    rows = tuple(
        (dataset.name, str(len(dataset.files)), dataset.mapping, dataset.title)
        for dataset in available
    )
    notes = ("Download: hydrodamp datasets NAME --yes. Check the licence of each dataset.",)
    header = ("name", "files", "mapping", "title")
    print_results(Table.of_words("Public logs", header, "lrll", rows, notes))
