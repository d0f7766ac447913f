"""What a method returns: a damping model with numbers, and how far to trust it."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError
from hydrodamp.identification.intervals import Uncertainty
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem, prepare, stamp
from hydrodamp.simulation.status import Status
from hydrodamp.vehicle.vehicle import Vehicle


@dataclass(frozen=True)
class Fit:
    """An identified damping model.

    Attributes
    ----------
    damping : Damping
        The model with its numbers and, where the method knows it, covariance.
    method : str
        Key of the method.
    status : Status
        The outcome in words.
    rank : int or None
        Coefficients that the data tell apart, summed over axes; None for
        online methods.
    aliased : tuple of tuple of str
        Labels that the data cannot tell apart, group by group. A group of one
        is a column that is zero throughout.
    n_samples : int
        Samples used.
    provenance : dict of str to str
        Log, vehicle and settings, in words.
    remarks : tuple of str
        What the method found on its way, in sentences: what it chose, what a
        constraint costs, what was checked.
    uncertainty : Uncertainty or None
        Standard errors and intervals; its covariance is that of the damping. None where
        the method knows none for coloured noise.
    """

    damping: Damping
    method: str
    status: Status
    rank: int | None = None
    aliased: tuple[tuple[str, ...], ...] = ()
    n_samples: int = 0
    provenance: dict[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    uncertainty: Uncertainty | None = None

    @property
    def model(self) -> DampingModel:
        """The model that was identified."""
        return self.damping.model

    @property
    def sentences(self) -> tuple[str, ...]:
        """What to read beside the numbers: the remarks, and what standard errors are from."""
        if self.uncertainty is not None:
            return (*self.remarks, str(self.uncertainty))
        return self.remarks if self.damping.covariance is None else (*self.remarks, WHITE)

    def __str__(self) -> str:
        """Return the outcome and the coefficients, one screen."""
        rank = "" if self.rank is None else f", rank {self.rank}"
        head = f"{self.model.key} by {self.method}: {self.model.n_coefficients} coefficients{rank}"
        groups = "".join(f"\n  not told apart: {' '.join(group)}" for group in self.aliased[:8])
        more = f"\n  and {len(self.aliased) - 8} more groups" if len(self.aliased) > 8 else ""
        said = "".join(f"\n{remark}" for remark in self.sentences)
        return f"{head}\n{self.status.value}{groups}{more}{said}\n{self.damping}"


#: What is said of a covariance that does not allow for coloured noise.
WHITE = (
    "Standard errors take the residuals as white: where neighbours err alike they are too narrow."
)


class Method(Protocol):
    """A way to identify coefficients: a value with one verb."""

    @property
    def key(self) -> str:
        """The key it has on the command line."""
        ...

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Identify the model's coefficients from a prepared problem."""
        ...


def identify(model: DampingModel, vehicle: Vehicle, log: Log, method: Method) -> Fit:
    """Identify one model from one log.

    Parameters
    ----------
    model : DampingModel
        Which terms.
    vehicle : Vehicle
        Everything known.
    log : Log
        What was measured.
    method : Method
        How, such as ``LeastSquares()``.

    Returns
    -------
    fit : Fit
        Coefficients and how far to trust them.

    Raises
    ------
    ProblemError
        If the log lacks what the vehicle or a term needs.
    """
    return method.identify(prepare(vehicle, log, model), model)


def digest(problem: Problem, model: DampingModel, method: object) -> str:
    """Return what tells one fit from another: data and vehicle, terms, settings, version."""
    import hydrodamp

    terms = model.restricted_to(problem.vehicle.axes).terms
    asked = (problem.digest, model.key, terms, repr(method), hydrodamp.__version__)
    return hashlib.sha256(repr(asked).encode()).hexdigest()[:16]


def provenance(problem: Problem, model: DampingModel, method: object) -> dict[str, str]:
    """Return log, vehicle and settings of a fit, in words."""
    log = problem.log
    return {
        "log": log.source or "in memory",
        "segments": " ".join(segment.name for segment in log.segments),
        "samples": str(problem.n_samples),
        "vehicle": problem.vehicle.name,
        "settings": repr(method),
        "digest": digest(problem, model, method),
    }


def fitted(
    problem: Problem,
    model: DampingModel,
    method: Method,
    coefficients: FloatArray,
    *,
    covariance: FloatArray | None = None,
    uncertainty: Uncertainty | None = None,
    rank: int | None = None,
    aliased: tuple[tuple[str, ...], ...] = (),
    status: Status | None = None,
    n_samples: int | None = None,
    remarks: tuple[str, ...] = (),
) -> Fit:
    """Put together the fit of a method that came to numbers.

    Parameters
    ----------
    problem : Problem
        What was used.
    model : DampingModel
        Restricted to the free axes.
    method : Method
        Its key and its settings go into the fit.
    coefficients : ndarray, shape (n_coefficients,)
        In the order of the model's labels.
    covariance : ndarray, shape (n_coefficients, n_coefficients), optional
        Of the coefficients, where there is no uncertainty.
    uncertainty : Uncertainty, optional
        How far to trust the coefficients.
    rank : int, optional
        Coefficients told apart, summed over axes.
    aliased : tuple of tuple of str
        Labels not told apart, group by group.
    status : Status, optional
        ``RANK_DEFICIENT`` where something is aliased, else ``OK``; ``FAILED`` whatever
        was asked for where a coefficient is not finite.
    n_samples : int, optional
        Samples used; all of the problem by default.
    remarks : tuple of str
        Sentences.

    Returns
    -------
    fit : Fit
        With the vehicle's stamp and provenance.
    """
    if not np.all(np.isfinite(coefficients)):
        return empty_fit(problem, model, method.key, Status.FAILED)
    if uncertainty is not None:
        covariance = uncertainty.covariance
    named = {label for group in aliased for label in group}
    aliased += tuple(group for group in problem.undetermined(model) if group[0] not in named)
    return Fit(
        damping=Damping(model, coefficients, covariance=covariance, vehicle=stamp(problem.vehicle)),
        method=method.key,
        status=status or (Status.RANK_DEFICIENT if aliased else Status.OK),
        rank=rank,
        aliased=aliased,
        n_samples=problem.n_samples if n_samples is None else n_samples,
        provenance=provenance(problem, model, method),
        remarks=remarks,
        uncertainty=uncertainty,
    )


def empty_fit(
    problem: Problem,
    model: DampingModel,
    method: str,
    status: Status,
    remarks: tuple[str, ...] = (),
) -> Fit:
    """Return a fit with all coefficients zero and a status that says why."""
    return Fit(
        damping=Damping(model, np.zeros(model.n_coefficients), vehicle=stamp(problem.vehicle)),
        method=method,
        status=status,
        n_samples=problem.n_samples,
        remarks=remarks,
    )


# What a method raises where a log and a model do not suit it. A problem that was prepared for
# other terms, or a fault of the program, is none of these and ends the work.
REFUSALS = (MethodError, np.linalg.LinAlgError, ArithmeticError)


def attempted(method: Method, problem: Problem, model: DampingModel) -> Fit:
    """Return a method's fit; where it raises, a fit whose status and remark say so."""
    try:
        return method.identify(problem, model)
    except REFUSALS as error:
        free = model.restricted_to(problem.vehicle.axes)
        return empty_fit(problem, free, method.key, Status.REFUSED, (str(error),))
