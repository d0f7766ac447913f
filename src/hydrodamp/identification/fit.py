"""What a method returns: a damping model with numbers, and how far to trust it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from hydrodamp.data.log import Log
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.simulation.stamp import stamp
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
    """

    damping: Damping
    method: str
    status: Status
    rank: int | None = None
    aliased: tuple[tuple[str, ...], ...] = ()
    n_samples: int = 0
    provenance: dict[str, str] = field(default_factory=dict)

    @property
    def model(self) -> DampingModel:
        """The model that was identified."""
        return self.damping.model

    def __str__(self) -> str:
        """Return the outcome and the coefficients, one screen."""
        rank = "" if self.rank is None else f", rank {self.rank}"
        head = f"{self.model.key} by {self.method}: {self.model.n_coefficients} coefficients{rank}"
        groups = "".join(f"\n  not told apart: {' '.join(group)}" for group in self.aliased[:8])
        more = f"\n  and {len(self.aliased) - 8} more groups" if len(self.aliased) > 8 else ""
        return f"{head}\n{self.status.value}{groups}{more}\n{self.damping}"


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


def provenance(problem: Problem, method: object) -> dict[str, str]:
    """Return log, vehicle and settings of a fit, in words.

    Parameters
    ----------
    problem : Problem
        What was used.
    method : object
        Its ``repr`` names the settings.

    Returns
    -------
    words : dict of str to str
        For the record beside the numbers.
    """
    log = problem.log
    return {
        "log": log.source or "in memory",
        "segments": " ".join(segment.name for segment in log.segments),
        "samples": str(problem.n_samples),
        "vehicle": problem.vehicle.name,
        "settings": repr(method),
    }


def empty_fit(problem: Problem, model: DampingModel, method: str, status: Status) -> Fit:
    """Return a fit with all coefficients zero and a status that says why."""
    return Fit(
        damping=Damping(model, np.zeros(model.n_coefficients), vehicle=stamp(problem.vehicle)),
        method=method,
        status=status,
        n_samples=problem.n_samples,
    )
