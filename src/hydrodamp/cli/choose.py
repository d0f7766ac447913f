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

#: The model that is selected from the training log.
SPARSE = "sparse"


def selects(listed: str | None) -> bool:
    """Tell whether a list of models asks for one to be selected from the log."""
    return listed is not None and SPARSE in names(listed)


def with_sparse(
    vehicle: Vehicle, log: Log, models: tuple[DampingModel, ...]
) -> tuple[DampingModel, ...]:
    """Return the models and the one selected from a log."""
    from hydrodamp.cli.output import note
    from hydrodamp.identification.sparse import Sparse
    from hydrodamp.progress import progress

    for model in models:
        if model.key.casefold() == SPARSE:
            raise _same_name(model.key, SPARSE)
    way = Sparse()
    with progress("selecting terms", len(way.windows)) as step:
        selected = way.select(vehicle, log, models, lambda *_: step())
    note(f"sparse: {selected.n_coefficients} coefficients. {selected.note}")
    return (*models, selected)


def choose_models(listed: str | None) -> tuple[DampingModel, ...]:
    """Return the models of a list with commas."""
    from hydrodamp.models.catalog import PAPER_MODELS

    asked = PAPER_MODELS if listed is None else names(listed)
    if not asked:
        raise ModelError("`--models` must name at least one model; got an empty list.")
    chosen: dict[str, DampingModel] = {}
    for model in (model for name in asked if name != SPARSE for model in named_models(name)):
        # Not all file systems distinguish A.json from a.json.
        there = chosen.setdefault(model.key.casefold(), model)
        if (there.key, there.terms) != (model.key, model.terms):
            raise _same_name(there.key, model.key)
    return tuple(chosen.values())


def _same_name(first: str, second: str) -> ModelError:
    pair = f"'{first}'" if first == second else f"'{first}' and '{second}'"
    return ModelError(f"two different models are called {pair}: rename the one in your file.")


def named_models(name: str) -> tuple[DampingModel, ...]:
    """Return the model of a name, or those of a file."""
    from hydrodamp.files import absent
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
    """Return the file of ``FILE:NAME``; any other name as it is."""
    file = name.rpartition(":")[0]
    return file if _is_yaml(file) else name


def one_of(file: str, key: str, found: tuple[DampingModel, ...]) -> DampingModel:
    """Return the model of a file that has a key."""
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
    """Return the one model of a name or of a file."""
    found = named_models(name)
    if len(found) != 1:
        keys = ", ".join(model.key for model in found)
        raise ModelError(
            f"{name}: `--model` takes one model; the file holds {keys}. Name one of them: "
            f"`--model {name}:{found[0].key}`."
        )
    return found[0]


def choose_methods(listed: str) -> tuple[Method, ...]:
    """Return the methods of a list with commas."""
    from hydrodamp.identification.methods import find_method

    if not names(listed):
        raise MethodError("`--methods` must name at least one method; got an empty list.")
    return tuple(find_method(name) for name in names(listed))


def names(listed: str) -> tuple[str, ...]:
    """Return the names of a list with commas, each once."""
    return tuple(dict.fromkeys(name.strip() for name in listed.split(",") if name.strip()))
