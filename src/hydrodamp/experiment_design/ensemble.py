"""Prior of damping coefficients, and a Monte Carlo ensemble sampled from it.

Member 0 is the nominal prior kappa_0; the others are kappa_0 + clip(L z) + s e with L L^T the prior
covariance, z and e standard normal, and s the scale of terms that the model lacks.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import AXES
from hydrodamp.errors import ModelError
from hydrodamp.identification.har_covariance import reference_model
from hydrodamp.models.damping import Damping, draw_coefficients, foreign_to
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.damping_estimate import hull_damping, published_damping
from hydrodamp.simulation.problem import vehicle_stamp
from hydrodamp.vehicle.vehicle import Vehicle

MAX_RELATIVE_STD = 0.3
"""Largest relative standard deviation of a coefficient, and the value if unknown; assumed."""

MODEL_FORM_SHARE = 0.02
"""Share of the force on an axis that is of terms that the model lacks; assumed."""


def prior_damping(vehicle: Vehicle, model: DampingModel, damping: Damping | None) -> Damping:
    """Return the prior: as given, a published set of the vehicle, or an estimate from its hull."""
    free = model.restricted_to(vehicle.axes)
    if damping is not None:
        if fault := foreign_to(damping, vehicle_stamp(vehicle)):
            raise ModelError(fault)
        if missing := [name for name in free.commands if name not in damping.model.commands]:
            raise ModelError(
                f"the prior has no gains of {', '.join(missing)}: give one that was identified "
                f"with the terms of model '{free.key}'."
            )
        return damping
    if free.commands:
        raise ModelError(
            f"model '{free.key}' has gains of {' '.join(free.commands)}, and no prior for them: "
            "give `damping`, identified from a log."
        )
    return published_damping(vehicle) or hull_damping(vehicle)


@dataclass(frozen=True, eq=False)
class DampingEnsemble:
    """Members of an ensemble of damping, the nominal one first.

    Attributes
    ----------
    dampings : tuple of Damping
        All of one model: the terms of ``model``, of the prior and of the reference model.
    model : DampingModel
        The model to identify, restricted to the free axes.
    """

    dampings: tuple[Damping, ...]
    model: DampingModel

    @property
    def extended_model(self) -> DampingModel:
        """The model of all members."""
        return self.dampings[0].model


def draw_ensemble(vehicle: Vehicle, damping: Damping, n: int) -> DampingEnsemble:
    """Return the estimate of a vehicle and n draws from its covariance, none where it has none."""
    if fault := foreign_to(damping, vehicle_stamp(vehicle)):
        raise ModelError(fault)
    if undetermined := [name for name, value in damping.as_dict().items() if np.isnan(value)]:
        raise ModelError(
            f"{', '.join(undetermined)} could not be determined: identify a model without, or by "
            "`ridge`."
        )
    rows: list[FloatArray] = []
    if n and damping.covariance is not None:
        rows = [*draw_coefficients(damping, n, np.random.default_rng(0))]
    members = (damping, *(replace(damping, coefficients=row) for row in rows))
    return DampingEnsemble(members, damping.model)


def sample_ensemble(
    vehicle: Vehicle, model: DampingModel, prior: Damping, scale: FloatArray, n: int, seed: int
) -> DampingEnsemble:
    """Sample n members from the prior.

    Known coefficients vary by their standard errors, at most by ``MAX_RELATIVE_STD``. Terms that
    the prior lacks make ``MODEL_FORM_SHARE`` of the force on an axis: ``scale`` (coefficients of
    the extended model) would make all of it.
    """
    extended, rng = extended_model(vehicle, model, prior), np.random.default_rng(seed)
    known = prior.model.restricted_to(vehicle.axes)
    values = dict(zip(known.labels, prior.onto(known), strict=True))
    nominal = np.array([values.get(label, 0.0) for label in extended.labels])
    is_known = np.array([label in values for label in extended.labels])
    root = np.zeros((extended.n_coefficients, known.n_coefficients))
    root[[extended.index(label) for label in known.labels]] = _covariance_root(prior, known)
    axes = np.repeat(np.arange(6), [len(row) for row in extended.terms])
    n_unknown = np.bincount(axes[~is_known], minlength=6)[axes]
    form_std = np.where(is_known, 0.0, MODEL_FORM_SHARE * scale / np.sqrt(np.maximum(n_unknown, 1)))
    max_std = MAX_RELATIVE_STD * np.abs(nominal)
    dampings = [Damping(extended, nominal)]
    for _ in range(n - 1):
        deviation = root @ rng.standard_normal(known.n_coefficients)
        deviation = np.clip(deviation, -2.0 * max_std, 2.0 * max_std)
        form_error = form_std * rng.standard_normal(extended.n_coefficients)
        dampings.append(Damping(extended, nominal + deviation + form_error))
    return DampingEnsemble(tuple(dampings), model.restricted_to(vehicle.axes))


def extended_model(vehicle: Vehicle, model: DampingModel, prior: Damping) -> DampingModel:
    """Return a model with the terms of the model, the prior and the reference model."""
    extended = model.restricted_to(vehicle.axes)
    for addition in (prior.model.restricted_to(vehicle.axes), reference_model(vehicle.axes)):
        rows = zip(AXES, addition.terms, strict=True)
        terms = {axis: [*row] for axis, row in rows if row}
        extended = extended.with_terms(terms, key=extended.key)
    return extended


def _covariance_root(prior: Damping, known: DampingModel) -> FloatArray:
    """Return L of the prior covariance L L^T, limited to ``MAX_RELATIVE_STD``."""
    max_std = MAX_RELATIVE_STD * np.abs(prior.onto(known))
    if prior.covariance is None:
        return np.diag(max_std)
    indices = [prior.model.index(label) for label in known.labels]
    covariance = prior.covariance[np.ix_(indices, indices)]
    eigenvalues, eigenvectors = np.linalg.eigh(np.nan_to_num(covariance))
    root = eigenvectors * np.sqrt(np.maximum(eigenvalues, 0.0))
    std = np.linalg.norm(root, axis=1)
    return np.asarray(root * (max_std / np.maximum(std, np.maximum(max_std, 1e-12)))[:, None])
