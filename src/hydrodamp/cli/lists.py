"""Command ``list``: the names that options accept, what each stands for, and public logs."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

import typer

import hydrodamp as hd
from hydrodamp.cli.inputs import read_named_models
from hydrodamp.cli.output import emit, note, print_output
from hydrodamp.errors import FileError, MethodError, no_such

KINDS = ("models", "methods", "vehicles", "presets", "targets", "datasets")
_MAX_WIDTH = 76  # characters of a description


def list(
    kind: str | None = None,
    name: str | None = None,
    out: Path | None = None,
    yes: bool = False,
    json: bool = False,
) -> None:
    """List the names that options accept, explain a name, or download a public log."""
    if kind is not None and kind not in KINDS:
        raise MethodError(no_such("kind of names", kind, KINDS))
    if (out or yes) and (kind != "datasets" or name is None):
        raise MethodError("`--out` and `--yes` download a dataset: give `datasets NAME`.")
    if kind is None:
        numbers = {each: str(len(_descriptions(each))) for each in KINDS}
        _print_names("kinds", numbers, "names", json)
    elif kind == "models":
        _show_models(name, json)
    elif kind == "datasets":
        _list_datasets(json) if name is None else _download(name, out, yes, json)
    elif name is None:
        _print_names(kind, _descriptions(kind), "description", json)
    else:
        text = _explain(kind, name)
        print_output(json, {"name": name, "text": text}, text)


def all_names() -> tuple[str, ...]:
    """Return the names of all kinds."""
    return tuple(dict.fromkeys(name for kind in KINDS for name in _descriptions(kind)))


def _descriptions(kind: str) -> dict[str, str]:
    """Return a line for each name of a kind."""
    from hydrodamp.ingest.datasets import datasets
    from hydrodamp.ingest.mapping.log_mapping import describe_preset, presets
    from hydrodamp.report.fit_tables import LOG_MODELS

    if kind == "models":
        of_log = {document["model"]: document["title"] for document in LOG_MODELS}
        return {key: model.title for key, model in hd.catalog.items()} | of_log
    if kind == "methods":
        return {key: _docstring(hd.find_method(key)).splitlines()[0] for key in hd.METHODS}
    if kind == "vehicles":
        return {key: vehicle.source for key, vehicle in hd.fleet.items()}
    if kind == "presets":
        return {key: describe_preset(key) for key in presets()}
    if kind == "targets":
        from hydrodamp.export.export import TARGETS

        return {key: hd.find_target(key).description for key in TARGETS}
    return {key: dataset.title for key, dataset in datasets().items()}


def _explain(kind: str, name: str) -> str:
    """Return the settings of a method or target, or the file of a vehicle or preset."""
    from hydrodamp.ingest.mapping.log_mapping import preset_text
    from hydrodamp.vehicle.file import fleet_text

    if kind == "methods":
        return _docstring(hd.find_method(name))
    if kind == "targets":
        return _docstring(hd.find_target(name))
    return fleet_text(name) if kind == "vehicles" else preset_text(name)


def _docstring(value: object) -> str:
    return inspect.getdoc(type(value)) or ""


def _print_names(key: str, names: Mapping[str, str], header: str, json: bool) -> None:
    """Print names with a text each."""
    from hydrodamp.report.table import Table

    rows = [(name, text[:_MAX_WIDTH]) for name, text in names.items()]
    print_output(json, {key: dict(names)}, Table.of_words("", ("name", header), "ll", rows))


def _show_models(name: str | None, json: bool) -> None:
    from hydrodamp.report.fit_tables import LOG_MODELS, model_document, model_table

    for document in LOG_MODELS:
        if name == document["model"]:
            print_output(json, document, document["note"])
            return
    models = (*(read_named_models(name) if name else hd.catalog.values()),)
    documents = [model_document(model) for model in models]
    of_log = [] if name else LOG_MODELS
    if len(documents) == 1:
        print_output(json, documents[0], str(models[0]))
    else:
        further = {"made_from_a_log": of_log} if of_log else {}
        command = f"hydrodamp list models {f'{name}:NAME' if name else 'NAME'}"
        table = model_table([*documents, *of_log], command)
        print_output(json, {"models": documents} | further, table)


def _download(name: str, out: Path | None, yes: bool, json: bool) -> None:
    """Verify the files of a public log, and download those that are missing."""
    from hydrodamp.ingest.datasets import check_folder, fetch, find_dataset

    dataset = find_dataset(name)
    target = out or Path("datasets", name)
    present = check_folder(dataset, target)
    note(f"{dataset.title}\n{dataset.note}\nSource: {dataset.page}")
    note(f"Licence: {dataset.licence}\nCite: {dataset.citation}")
    files = fetch(dataset, target) if yes else present
    if len(files.lacking) == len(dataset.files):
        remedy = "No address of a file is known: put your own into the folder."
        if any(file.url for file in dataset.files):
            remedy = "Use --yes to accept the licence and download the files that have a URL."
        raise FileError(
            f"{target}: none of the {len(dataset.files)} files of '{name}' is present, such as"
            f" {dataset.files[0].name}. Source: {dataset.page}. {remedy}"
        )
    downloaded = [file for file in present.lacking if file not in files.lacking]
    if json:
        document = {"dataset": name, "mapping": dataset.mapping, "downloaded": downloaded}
        emit(asdict(files) | document | {"folder": str(target)})
        return
    states = {
        "downloaded": downloaded,
        "verified by checksum": files.verified,
        "not verified: no checksum is known": files.unchecked,
        "missing": files.lacking,
    }
    for state, names in states.items():
        if names:
            note(f"{len(names)} of {len(dataset.files)} files {state}")
    note(f"Read with: --mapping {dataset.mapping}")
    typer.echo(str(target))


def _list_datasets(json: bool) -> None:
    from hydrodamp.ingest.datasets import datasets
    from hydrodamp.report.table import Table

    available = datasets().values()
    rows = [(each.name, str(len(each.files)), each.mapping, each.title) for each in available]
    notes = ("Download: hydrodamp list datasets NAME --yes. Check the licence of each dataset.",)
    header = ("name", "files", "mapping", "title")
    table = Table.of_words("Public logs", header, "lrll", rows, notes)
    print_output(json, {"datasets": [asdict(each) for each in available]}, table)
