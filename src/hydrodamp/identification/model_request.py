"""Models that are requested for a log: given ones, and those that the log determines."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from hydrodamp.data.log import Log
from hydrodamp.errors import ModelError
from hydrodamp.identification.general_model import GENERAL_KEY, add_inputs, general_model
from hydrodamp.identification.stepwise import Round, StepwiseSelection
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.checks import missing_actuation, with_gains
from hydrodamp.vehicle.vehicle import Vehicle

#: Key of the model whose terms are selected.
SPARSE = "sparse"


@dataclass(frozen=True)
class ModelRequest:
    """Given models, and whether ``general`` and ``sparse`` are requested for the training data."""

    models: tuple[DampingModel, ...]
    has_general: bool = False
    selects_terms: bool = False

    def __len__(self) -> int:
        """Return the number of models."""
        return len(self.models) + self.has_general + self.selects_terms

    def with_terms(self) -> tuple[DampingModel, ...]:
        """Return the models; raise if one that needs a log is requested."""
        if self.has_general or self.selects_terms:
            name = GENERAL_KEY if self.has_general else SPARSE
            raise ModelError(f"the model `{name}` needs a whole log: give one with terms.")
        return self.models

    def unselected(self, vehicle: Vehicle, log: Log) -> tuple[DampingModel, ...]:
        """Return the models but the selected one; those that nothing drives with the inputs."""
        models = tuple(
            add_inputs(model, vehicle, log) if needs_inputs(vehicle, log, model) else model
            for model in self.models
        )
        return (*models, general_model(vehicle, log)) if self.has_general else models

    def candidates(
        self, vehicle: Vehicle, log: Log, models: Sequence[DampingModel]
    ) -> tuple[DampingModel, ...]:
        """Return models, and one with the candidate commands of the selection."""
        if not self.selects_terms:
            return tuple(models)
        unassigned = [name for name in log.command_names if name not in vehicle.commands]
        candidate = DampingModel.from_table({vehicle.axes[0]: " ".join(unassigned)}, key=SPARSE)
        return (*models, candidate)

    def selection(self, vehicle: Vehicle, log: Log, gains: bool) -> StepwiseSelection | None:
        """Return the selection of terms, also from those of the other models, if requested."""
        if not self.selects_terms:
            return None
        general = (general_model(vehicle, log),) if self.has_general else ()
        return _SelectionAmong(candidates=(*self.models, *general), has_gains=gains)


@dataclass(frozen=True)
class _SelectionAmong(StepwiseSelection):
    """Selection with the terms of given models, but not with the inputs that they were given."""

    candidates: tuple[DampingModel, ...] = ()
    has_gains: bool = False

    def select(
        self,
        vehicle: Vehicle,
        log: Log,
        models: Iterable[DampingModel] = (),
        done: Callable[[Round], None] | None = None,
    ) -> DampingModel:
        model = super().select(vehicle, log, self.candidates, done)
        return with_gains(vehicle, log, model) if self.has_gains else model


def needs_inputs(vehicle: Vehicle, log: Log, model: DampingModel) -> bool:
    """Whether nothing drives the vehicle but commands of the log without a term in the model."""
    return bool(log.command_names) and bool(missing_actuation(vehicle, log, (model,)))
