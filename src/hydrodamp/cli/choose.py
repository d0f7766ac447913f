"""From names on the command line to models and methods."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from hydrodamp.errors import FileError, MethodError, ModelError, did_you_mean

if TYPE_CHECKING:
    from hydrodamp.data.log import Log
    from hydrodamp.identification.fit import Method
    from hydrodamp.models.model import DampingModel
    from hydrodamp.vehicle.vehicle import Vehicle

SPARSE = "sparse"
"""The model that is selected from the training log."""


def selects(listed: str | None) -> bool:
    """Tell whether a list of models asks for one to be selected from the log."""
    return listed is not None and SPARSE in _names(listed)


def with_sparse(
    vehicle: Vehicle, log: Log, models: tuple[DampingModel, ...]
) -> tuple[DampingModel, ...]:
    """Return the models and the one selected from a log.

    Parameters
    ----------
    vehicle : Vehicle
        Everything known.
    log : Log
        What the models are identified from.
    models : tuple of DampingModel
        Their damping terms are candidates too; their terms with commands are kept.

    Returns
    -------
    models : tuple of DampingModel
        The selected one comes last.

    Raises
    ------
    ModelError
        If another model has its name.
    """
    from hydrodamp.cli.output import note
    from hydrodamp.cli.progress import progress
    from hydrodamp.validation.sparse import Sparse

    for model in models:
        if model.key.casefold() == SPARSE:
            raise _called_alike(model.key, SPARSE)
    way = Sparse()
    try:
        with progress("selecting terms", len(way.windows)) as step:
            selected = way.select(vehicle, log, models, step)
    except KeyboardInterrupt:
        note("stopped while selecting `sparse`, before any fit: nothing is written.")
        raise
    note(f"sparse: {selected.n_coefficients} coefficients. {selected.note}")
    return (*models, selected)


def choose_models(listed: str | None) -> tuple[DampingModel, ...]:
    """Return the models of a list with commas.

    Parameters
    ----------
    listed : str or None
        Names of the catalogue and YAML files; None for the paper's eight. ``sparse`` is
        left out, see :func:`with_sparse`.

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

    asked = PAPER_MODELS if listed is None else _names(listed)
    names = tuple(name for name in asked if name != SPARSE)
    if not asked:
        raise ModelError("`--models` must name at least one model; got an empty list.")
    chosen: dict[str, DampingModel] = {}
    for model in (model for name in names for model in named_models(name)):
        there = chosen.setdefault(model.key.casefold(), model)  # not all systems tell A.json from a
        if (there.key, there.terms) != (model.key, model.terms):
            raise _called_alike(there.key, model.key)
    return tuple(chosen.values())


def _called_alike(first: str, second: str) -> ModelError:
    names = f"'{first}'" if first == second else f"'{first}' and '{second}'"
    return ModelError(f"two different models are called {names}: rename the one in your file.")


def named_models(name: str) -> tuple[DampingModel, ...]:
    """Return the model of a name, or those of a file.

    Parameters
    ----------
    name : str
        A name of the catalogue, a YAML file, or one model of it as ``FILE:NAME``.

    Returns
    -------
    models : tuple of DampingModel
        One, or all of the file.

    Raises
    ------
    ModelError
        If there is no such model, with the nearest.
    FileError
        If there is no such file, or it cannot be read.
    """
    from hydrodamp.loading import absent
    from hydrodamp.models.catalog import catalog, find_model
    from hydrodamp.models.files import read_models

    file = file_of(name)
    if name in catalog:
        return (find_model(name),)
    if file != name:
        return (one_of(file, name.removeprefix(f"{file}:").strip(), read_models(file)),)
    if _is_yaml(name) or Path(name).is_file():
        return read_models(name)
    if Path(name).suffix and not did_you_mean(name, catalog):
        raise FileError(absent(name))
    return (find_model(name),)


def file_of(name: str) -> str:
    """Return the file of ``FILE:NAME``; any other name as it is.

    Parameters
    ----------
    name : str
        As for :func:`named_models`.

    Returns
    -------
    file : str
        What stands before the colon, where that is a YAML file's name.

    Examples
    --------
    >>> file_of("mine.yaml:tank"), file_of("linear")
    ('mine.yaml', 'linear')
    """
    file = name.rpartition(":")[0]
    return file if _is_yaml(file) else name


def one_of(file: str, key: str, found: tuple[DampingModel, ...]) -> DampingModel:
    """Return the model of a file that has a key.

    Parameters
    ----------
    file : str
        How messages call it.
    key : str
        Of the model.
    found : tuple of DampingModel
        What the file holds.

    Returns
    -------
    model : DampingModel
        The one.

    Raises
    ------
    ModelError
        If there is none, with the nearest.
    """
    keys = [model.key for model in found]
    if key not in keys:
        raise ModelError(
            f"{file}: no model is called '{key}'; the file holds {', '.join(keys)}."
            f"{did_you_mean(key, keys)}"
        )
    return found[keys.index(key)]


def _is_yaml(name: str) -> bool:
    return Path(name).suffix.lower() in (".yaml", ".yml")


def choose_model(name: str) -> DampingModel:
    """Return the one model of a name or of a file.

    Parameters
    ----------
    name : str
        A name of the catalogue, a YAML file of one model, or ``FILE:NAME``.

    Returns
    -------
    model : DampingModel
        The model.

    Raises
    ------
    ModelError
        If there is no such model, or the file holds several.
    FileError
        If there is no such file, or it cannot be read.
    """
    found = named_models(name)
    if len(found) != 1:
        keys = ", ".join(model.key for model in found)
        raise ModelError(
            f"{name}: `--model` takes one model; the file holds {keys}. Name one of them: "
            f"`--model {name}:{found[0].key}`."
        )
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
