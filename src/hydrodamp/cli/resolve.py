"""From names on the command line to a vehicle, models and methods."""

from __future__ import annotations

from pathlib import Path

import hydrodamp as hd
from hydrodamp.cli.options import FLEET
from hydrodamp.cli.output import note
from hydrodamp.errors import MethodError, ModelError, VehicleError, no_such
from hydrodamp.progress import progress

#: The model that is selected from the training log.
SPARSE = "sparse"


def find_vehicle(name: str) -> hd.Vehicle:
    """Return the vehicle of a name or a file."""
    if not name:
        raise VehicleError(
            f"`--vehicle` is missing: name one of the fleet ({FLEET}), or a YAML file of your own; "
            "`hydrodamp vehicle new` writes one."
        )
    return hd.find_vehicle(name)


def selects_terms(listed: str | None) -> bool:
    """Tell whether a list of models asks for one to be selected from the log."""
    return listed is not None and SPARSE in split_names(listed)


def with_selectable_terms(
    listed: str | None, vehicle: hd.Vehicle, log: hd.Log, models: tuple[hd.DampingModel, ...]
) -> tuple[hd.DampingModel, ...]:
    """Return models, and for the one to be selected one with every command it may take."""
    if not selects_terms(listed):
        return models
    strange = [name for name in log.command_names if name not in vehicle.commands]
    offered = hd.DampingModel.from_table({vehicle.axes[0]: " ".join(strange)}, key=SPARSE)
    return (*models, offered)


def complete_models(
    listed: str | None,
    vehicle: hd.Vehicle,
    log: hd.Log,
    models: tuple[hd.DampingModel, ...],
    free_gains: bool = False,
) -> tuple[hd.DampingModel, ...]:
    """Return models with the one selected from a log and gains of its wrench, where asked for."""
    from hydrodamp.simulation.actuation import with_gains

    if selects_terms(listed):
        selection = hd.StepwiseSelection()
        with progress("selecting terms", len(selection.windows)) as step:
            selected = selection.select(vehicle, log, models, lambda *_: step())
        note(f"sparse: {selected.n_coefficients} coefficients. {selected.note}")
        models = (*models, selected)
    return tuple(with_gains(vehicle, log, model) for model in models) if free_gains else models


def list_models(listed: str | None) -> tuple[hd.DampingModel, ...]:
    """Return the models of a list with commas, without the one that comes with a log."""
    asked = hd.PAPER_MODELS if listed is None else split_names(listed)
    if not asked:
        raise ModelError("`--models` must name at least one model; got an empty list.")
    chosen: dict[str, hd.DampingModel] = {}
    for model in (model for name in asked if name != SPARSE for model in read_named_models(name)):
        key = model.key.casefold()  # not all file systems distinguish A.json from a.json
        there = chosen.setdefault(key, model)
        same = (there.key, there.terms) == (model.key, model.terms)
        if not same or (key == SPARSE and selects_terms(listed)):
            raise ModelError(
                f"two different models are called '{model.key}', whatever their capitals: rename "
                "the one in your file."
            )
    return tuple(chosen.values())


def read_named_models(name: str) -> tuple[hd.DampingModel, ...]:
    """Return the model of a name or of ``FILE:NAME``, or those of a file."""
    file = model_file(name)
    if file != name:
        key, file_models = name.removeprefix(f"{file}:").strip(), hd.read_models(file)
        keys = [model.key for model in file_models]
        if key not in keys:
            raise ModelError(f"{file}: {no_such('model', key, keys)}")
        return (file_models[keys.index(key)],)
    if name not in hd.catalog and (_is_yaml(name) or Path(name).is_file()):
        return hd.read_models(name)
    return (hd.find_model(name),)


def model_file(name: str) -> str:
    """Return the file of ``FILE:NAME``; any other name as it is."""
    file = name.rpartition(":")[0]
    return file if _is_yaml(file) else name


def _is_yaml(name: str) -> bool:
    return Path(name).suffix.lower() in (".yaml", ".yml")


def find_model(name: str) -> tuple[hd.DampingModel, ...]:
    """Return the one model of a name or of a file; none where it is to be selected."""
    if not name:
        raise ModelError(
            "`--model` is missing: name one of `hydrodamp models`, a YAML file of your own, or "
            "`sparse`, which is selected from the log."
        )
    models = list_models(name)
    if len(models) + selects_terms(name) != 1:
        keys = ", ".join(model.key for model in models)
        raise ModelError(
            f"`--model {name}` names several models: {keys}. Identify takes one model, such as "
            "FILE:NAME of a file; `hydrodamp compare --models` takes several."
        )
    return models


def list_methods(listed: str) -> tuple[hd.Method, ...]:
    """Return the methods of a list with commas."""
    if not split_names(listed):
        raise MethodError("`--methods` must name at least one method; got an empty list.")
    return tuple(hd.find_method(name) for name in split_names(listed))


def split_names(listed: str) -> tuple[str, ...]:
    """Return the names of a list with commas, each once."""
    return tuple(dict.fromkeys(name.strip() for name in listed.split(",") if name.strip()))
