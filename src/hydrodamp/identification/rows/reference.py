"""A regression rich enough that what it leaves over is noise rather than misfit."""

from __future__ import annotations

from hydrodamp.basis.axes import AXES
from hydrodamp.models.catalog import catalog
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem, prepare


def with_reference(problem: Problem, model: DampingModel) -> Problem:
    """Return a problem for a model, and for the model with the reference's terms."""
    reference = catalog["gertler-hagen"].restricted_to(problem.vehicle.axes)
    table = {
        axis: " ".join(str(term) for term in terms if not term.needs_propulsion)
        for axis, terms in zip(AXES, reference.terms, strict=True)
        if terms
    }
    return prepare(problem.vehicle, problem.log, (model, model.with_terms(table)))
