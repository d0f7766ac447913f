"""Models of your own, read from YAML and written to it."""

from __future__ import annotations

import os
from collections.abc import Mapping

from hydrodamp.errors import ModelError, did_you_mean, list_faults
from hydrodamp.files import load_yaml, mistaken, save_text
from hydrodamp.models.catalog import catalog
from hydrodamp.models.model import DampingModel
from hydrodamp.models.screen import group_axes
from hydrodamp.models.table import read_table

FIELDS = ("name", "title", "source", "note", "extends", "terms")
"""What a model in a file may say; ``name`` and one of ``terms`` and ``extends`` it must."""


def read_models(path: str | os.PathLike[str]) -> tuple[DampingModel, ...]:
    """Return the models of a file.

    Parameters
    ----------
    path : str or path
        YAML: one model, ``{name, title, source, note, extends, terms}``, or a list of
        such under ``models``. ``terms`` maps axes to terms, ``{X: "u u|u|", Y N: "v r"}``;
        ``extends`` names a model of the catalogue or an earlier one of the file.

    Returns
    -------
    models : tuple of DampingModel
        In the order of the file.

    Raises
    ------
    FileError
        If the file cannot be read or is no YAML, with its line.
    ModelError
        Naming every fault of the file, each with its place; or what else it is.
    """
    content = load_yaml(path)
    if other := mistaken(content, str(path), "models"):
        raise ModelError(other)
    faults: list[str] = []
    models: dict[str, DampingModel] = {}
    for place, entry in _entries(content, faults):
        model = _build(place, entry, {**catalog, **models}, faults)
        if model is not None and model.key in models:
            faults.append(f"{place}name: '{model.key}' comes twice.")
        elif model is not None:
            models[model.key] = model
    if faults:
        raise ModelError(list_faults(str(path), faults))
    return tuple(models.values())


def read_model(path: str | os.PathLike[str]) -> DampingModel:
    """Return the one model of a file.

    Parameters
    ----------
    path : str or path
        As in :func:`read_models`.

    Returns
    -------
    model : DampingModel
        The model.

    Raises
    ------
    FileError
        If the file cannot be read or is no YAML, with its line.
    ModelError
        If it has faults or holds several models.
    """
    models = read_models(path)
    if len(models) != 1:
        raise ModelError(
            f"{path}: must hold one model; got {len(models)}. Read them with read_models."
        )
    return models[0]


def write_model(model: DampingModel, path: str | os.PathLike[str]) -> None:
    """Write a model to a file that :func:`read_model` reads back.

    Parameters
    ----------
    model : DampingModel
        Any model.
    path : str or path
        The YAML file; written whole or not at all.

    Raises
    ------
    FileError
        If the file cannot be written.
    """
    import yaml

    terms = {
        " ".join(axes): " ".join(map(str, row)) for row, axes in group_axes(model).items() if row
    }
    content = {"name": model.key, "title": model.title, "source": model.source, "note": model.note}
    kept = {name: text for name, text in content.items() if text}
    document = {**kept, "terms": terms}
    save_text(yaml.safe_dump(document, sort_keys=False, allow_unicode=True, width=88), path)


def _entries(content: object, faults: list[str]) -> list[tuple[str, Mapping[str, object]]]:
    """Return the models of a file's content, each with the place it stands at."""
    if isinstance(content, Mapping) and "models" in content:
        extra = [f"`{key}`" for key in content if key != "models"]
        if extra:
            faults.append(f"beside `models` nothing else may stand; got {', '.join(extra)}.")
        listed = content["models"]
        if not isinstance(listed, list) or not listed:
            faults.append("models: must be a list of models.")
            return []
        numbered = [(f"models[{place}].", entry) for place, entry in enumerate(listed)]
    else:
        numbered = [("", content)]
    found: list[tuple[str, Mapping[str, object]]] = []
    for place, entry in numbered:
        if isinstance(entry, Mapping):
            found.append((place, entry))
        else:
            several = "" if place else "; several models go under `models:`, as a list"
            faults.append(f"{place or 'the file '}must map {', '.join(FIELDS)} to values{several}.")
    return found


def _build(
    place: str,
    entry: Mapping[str, object],
    known: Mapping[str, DampingModel],
    faults: list[str],
) -> DampingModel | None:
    """Return the model of one entry, or None where it has faults."""
    before = len(faults)
    for field in entry:
        if field not in FIELDS:
            near = did_you_mean(str(field), FIELDS)
            faults.append(f"{place}{field}: is unknown; known are {', '.join(FIELDS)}.{near}")
    texts = {field: _text(place, field, entry, faults) for field in FIELDS[:5]}
    if entry.get("name", "") in ("", None):
        faults.append(f"{place}name: is missing.")
    parent = known.get(texts["extends"])
    if texts["extends"] and parent is None:
        near = did_you_mean(texts["extends"], known)
        faults.append(f"{place}extends: there is no model '{texts['extends']}'.{near}")
    table = _table(place, entry, faults, optional=bool(texts["extends"]))
    wrong = read_table(table)[1]
    faults.extend(f"{place}terms: {fault}" for fault in wrong)
    if len(faults) > before:
        return None
    return _assemble(place, texts, table, parent, faults)


def _assemble(
    place: str,
    texts: Mapping[str, str],
    table: Mapping[str, list[str]],
    parent: DampingModel | None,
    faults: list[str],
) -> DampingModel | None:
    key = texts["name"]
    words = {field: texts[field] for field in ("title", "source", "note")}
    try:
        if parent is None:
            return DampingModel.from_table(table, key=key, **words)
        rows = parent.with_terms(table, key=key).terms
        inherited = f"Extends {parent.key}. {parent.source}".strip()
        return DampingModel(
            key, words["title"] or key, rows, words["source"] or inherited, words["note"]
        )
    except ModelError as error:
        faults.append(f"{place}name: {error}")
        return None


def _text(place: str, field: str, entry: Mapping[str, object], faults: list[str]) -> str:
    value = entry.get(field, "")
    if value is None:
        return ""
    if isinstance(value, str | int | float) and not isinstance(value, bool):
        return str(value).strip()
    faults.append(f"{place}{field}: must be text; got {value!r}.")
    return ""


def _table(
    place: str, entry: Mapping[str, object], faults: list[str], *, optional: bool
) -> dict[str, list[str]]:
    """Return the terms of an entry as lists of spellings."""
    content = entry.get("terms")
    if content is None and optional:
        return {}
    if not isinstance(content, Mapping) or not content:
        faults.append(
            f"{place}terms: must map axes to terms, such as {{X: 'u u|u|', Y N: 'v r'}}; "
            f"got {content!r}."
        )
        return {}
    table: dict[str, list[str]] = {}
    for axes, value in content.items():
        if isinstance(value, list) and all(isinstance(each, str | int) for each in value):
            table[str(axes)] = [str(each) for each in value]
        elif isinstance(value, str | int) and not isinstance(value, bool):
            table[str(axes)] = str(value).split()
        else:
            faults.append(f"{place}terms.{axes}: must be terms; got {value!r}.")
    return table
