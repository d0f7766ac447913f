"""The methods by the keys they have on the command line."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Protocol, runtime_checkable

from hydrodamp.errors import MethodError, did_you_mean
from hydrodamp.identification.adaptive import AdaptiveIdentifier
from hydrodamp.identification.dissipation.dissipative import Dissipative
from hydrodamp.identification.fit import REFUSALS, Fit, Method, attempted
from hydrodamp.identification.gains import ByNoise, ByTerm
from hydrodamp.identification.linear import LeastSquares, WeakForm
from hydrodamp.identification.output_error import OutputError, Recommended
from hydrodamp.identification.recursive import RecursiveLeastSquares
from hydrodamp.identification.ridge import Ridge
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.parallel import each
from hydrodamp.simulation.problem import Problem

#: ``recommended`` is what a user gets who names none; ``ls`` and ``ai`` are the paper's.
#: ``ai-scaled`` is ``ai`` with gains by axis and term and thirty passes.
METHODS: dict[str, Method] = {
    "recommended": Recommended(),
    "ls": LeastSquares(),
    "weak": WeakForm(),
    "ridge": Ridge(),
    "dissipative": Dissipative(),
    "oe": OutputError(),
    "ai": AdaptiveIdentifier(a=20.0, gamma=20.0),
    "ai-scaled": AdaptiveIdentifier(a=ByNoise(), gamma=ByTerm(), passes=30),
    "rls": RecursiveLeastSquares(),
}


@runtime_checkable
class Shared(Protocol):
    """A method that shares work between models."""

    def identify_all(self, problem: Problem, models: Iterable[DampingModel]) -> tuple[Fit, ...]:
        """Identify several models at once."""
        ...


def find_method(key: str) -> Method:
    """Return the method of a key.

    Parameters
    ----------
    key : str
        Such as ``"ls"``.

    Returns
    -------
    method : Method
        A value with the verb ``identify``.

    Raises
    ------
    MethodError
        If there is none, with the nearest.

    Examples
    --------
    >>> find_method("ls")
    LeastSquares(derivative=None)
    """
    if key not in METHODS:
        known = ", ".join(METHODS)
        raise MethodError(f"unknown method '{key}'.{did_you_mean(key, METHODS)} Known: {known}.")
    return METHODS[key]


def identify_all(
    problem: Problem,
    models: Iterable[DampingModel],
    method: Method,
    done: Callable[[Fit], None] | None = None,
) -> tuple[Fit, ...]:
    """Identify several models by one method, on all cores.

    A method that shares work between models does it once, such as the triangle of least
    squares. Where a method cannot identify one of the models from this log, that fit has the
    status ``REFUSED`` and the reason among its remarks; the others are not lost with it.

    Parameters
    ----------
    problem : Problem
        Prepared for the terms of all models.
    models : iterable of DampingModel
        Which terms.
    method : Method
        How.
    done : callable, optional
        Called with each fit as it comes, to keep it or for a progress bar; with all at once
        where the method shares its work.

    Returns
    -------
    fits : tuple of Fit
        In the order of the models.
    """
    asked = tuple(models)
    if isinstance(method, Shared):
        with suppress(*REFUSALS):  # then one by one, to find which
            fits = method.identify_all(problem, asked)
            for fit in fits:
                if done is not None:
                    done(fit)
            return fits
    return each(attempted, [(method, problem, model) for model in asked], done)
