"""Vehicle, models and methods from their names on the command line."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import hydrodamp as hd
from hydrodamp.cli.options import FLEET
from hydrodamp.cli.output import note
from hydrodamp.errors import MethodError, ModelError, VehicleError, no_such
from hydrodamp.progress import progress

#: Model whose terms are selected from the training data.
SPARSE = "sparse"


def find_vehicle(name: str) -> hd.Vehicle:
    """Return a vehicle by name or file."""
    if not name:
        raise VehicleError(
            f"`--vehicle` is missing: give a vehicle of the fleet ({FLEET}) or a YAML file; "
            "`hydrodamp vehicle new` writes one."
        )
    return hd.find_vehicle(name)


@dataclass(frozen=True)
class ModelList:
    """Models of a list, and whether it also asks for one selected from the training data."""

    models: tuple[hd.DampingModel, ...]
    selects_terms: bool

    def candidates(self, vehicle: hd.Vehicle, log: hd.Log) -> tuple[hd.DampingModel, ...]:
        """Return the models, and one with the candidate commands of the selection."""
        if not self.selects_terms:
            return self.models
        unassigned = [name for name in log.command_names if name not in vehicle.commands]
        candidate = hd.DampingModel.from_table({vehicle.axes[0]: " ".join(unassigned)}, key=SPARSE)
        return (*self.models, candidate)

    def complete(
        self, vehicle: hd.Vehicle, log: hd.Log, estimate_gains: bool = False
    ) -> tuple[hd.DampingModel, ...]:
        """Return the models with the selected one and with actuator gains, if requested."""
        from hydrodamp.simulation.checks import with_gains

        models = self.models
        if self.selects_terms:
            selection = hd.StepwiseSelection()
            with progress("selecting terms", len(selection.windows)) as step:
                selected = selection.select(vehicle, log, models, lambda *_: step())
            note(f"sparse: {selected.n_coefficients} coefficients. {selected.note}")
            models = (*models, selected)
        if estimate_gains:
            models = tuple(with_gains(vehicle, log, model) for model in models)
        return models


def list_models(listed: str | None) -> ModelList:
    """Return the models of a comma-separated list; the default is the paper's eight."""
    requested = hd.PAPER_MODELS if listed is None else split_names(listed)
    if not requested:
        raise ModelError("`--models` must name at least one model; got an empty list.")
    selects_terms = SPARSE in requested
    models: dict[str, hd.DampingModel] = {}
    for model in (
        model for name in requested if name != SPARSE for model in read_named_models(name)
    ):
        key = model.key.casefold()  # not all file systems distinguish A.json from a.json
        first = models.setdefault(key, model)
        same = (first.key, first.terms) == (model.key, model.terms)
        if not same or (key == SPARSE and selects_terms):
            raise ModelError(
                f"two different models are called '{model.key}' (case-insensitive): rename the "
                "one in your file."
            )
    return ModelList(tuple(models.values()), selects_terms)


def read_named_models(name: str) -> tuple[hd.DampingModel, ...]:
    """Return a model by name or ``FILE:NAME``, or all models of a file."""
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


def find_model(name: str) -> ModelList:
    """Return a single model by name or file, or the one that is selected from the log."""
    if not name:
        raise ModelError(
            "`--model` is missing: give a model of `hydrodamp models`, a YAML file, or `sparse`, "
            "which is selected from the log."
        )
    listed = list_models(name)
    if len(listed.models) + listed.selects_terms != 1:
        keys = ", ".join(model.key for model in listed.models)
        raise ModelError(
            f"`--model {name}` names several models: {keys}. Give one, such as FILE:NAME; "
            "`hydrodamp compare --models` takes several."
        )
    return listed


def list_methods(listed: str) -> tuple[hd.Method, ...]:
    """Return the methods of a comma-separated list."""
    if not split_names(listed):
        raise MethodError("`--methods` must name at least one method; got an empty list.")
    return tuple(hd.find_method(name) for name in split_names(listed))


def split_names(listed: str) -> tuple[str, ...]:
    """Return the distinct names of a comma-separated list."""
    return tuple(dict.fromkeys(name.strip() for name in listed.split(",") if name.strip()))
