"""From names on the command line to models and methods."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from hydrodamp.errors import MethodError, ModelError

if TYPE_CHECKING:
    from hydrodamp.identification.fit import Method
    from hydrodamp.models.model import DampingModel


def choose_models(listed: str | None) -> tuple[DampingModel, ...]:
    """Return the models of a list with commas.

    Parameters
    ----------
    listed : str or None
        Names of the catalogue and YAML files; None for the paper's eight.

    Returns
    -------
    models : tuple of DampingModel
        Each once, in order.

    Raises
    ------
    ModelError
        If a name is unknown, with the nearest, or two models share a name.
    FileError
        If a file cannot be read.
    """
    from hydrodamp.models.catalog import PAPER_MODELS

    names = PAPER_MODELS if listed is None else _names(listed)
    if not names:
        raise ModelError("`--models` must name at least one model; got an empty list.")
    chosen: dict[str, DampingModel] = {}
    for model in (model for name in names for model in named_models(name)):
        if chosen.setdefault(model.key, model).terms != model.terms:
            raise ModelError(
                f"two different models are called '{model.key}': rename the one in your file."
            )
    return tuple(chosen.values())


def named_models(name: str) -> tuple[DampingModel, ...]:
    """Return the model of a name, or those of a file.

    Parameters
    ----------
    name : str
        A name of the catalogue or a YAML file.

    Returns
    -------
    models : tuple of DampingModel
        One, or all of the file.

    Raises
    ------
    ModelError
        If there is no such model, with the nearest.
    """
    from hydrodamp.models.catalog import catalog, find_model
    from hydrodamp.models.files import read_models

    is_file = Path(name).suffix.lower() in (".yaml", ".yml") or Path(name).is_file()
    if name not in catalog and is_file:
        return read_models(name)
    return (find_model(name),)


def choose_model(name: str) -> DampingModel:
    """Return the one model of a name or of a file.

    Parameters
    ----------
    name : str
        A name of the catalogue or a YAML file of one model.

    Returns
    -------
    model : DampingModel
        The model.

    Raises
    ------
    ModelError
        If there is no such model, or the file holds several.
    """
    found = named_models(name)
    if len(found) != 1:
        keys = ", ".join(model.key for model in found)
        raise ModelError(f"{name}: `--model` takes one model; the file holds {keys}.")
    return found[0]


def choose_methods(listed: str) -> tuple[Method, ...]:
    """Return the methods of a list with commas.

    Parameters
    ----------
    listed : str
        Their keys.

    Returns
    -------
    methods : tuple of Method
        Each once, in order.

    Raises
    ------
    MethodError
        If a key is unknown, with the nearest.
    """
    from hydrodamp.identification.methods import find_method

    names = _names(listed)
    if not names:
        raise MethodError("`--methods` must name at least one method; got an empty list.")
    return tuple(find_method(name) for name in names)


def _names(listed: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name.strip() for name in listed.split(",") if name.strip()))
