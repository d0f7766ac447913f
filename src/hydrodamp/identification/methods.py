"""Registry of identification methods: keys, references, lazy import; several models at once."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from hydrodamp.errors import MethodError, no_such

if TYPE_CHECKING:
    from hydrodamp.data.log import Log
    from hydrodamp.identification.fit import Fit, Method
    from hydrodamp.identification.identifiability import GradedFit
    from hydrodamp.models.damping import Damping
    from hydrodamp.models.model import DampingModel
    from hydrodamp.simulation.problem import Problem
    from hydrodamp.vehicle.vehicle import Vehicle


@dataclass(frozen=True)
class MethodEntry:
    """Entry of the registry.

    Attributes
    ----------
    factory : str
        Module and name in ``hydrodamp.identification`` of the function or class.
    references : tuple of str
        Papers in addition to those of the models, one per line.
    paper_column : str
        The column of Table I of the paper with the same method; empty for none.
    """

    factory: str
    references: tuple[str, ...] = ()
    paper_column: str = ""

    def make(self) -> Method:
        """Import and return the method."""
        module, name = self.factory.rsplit(".", 1)
        method: Method = getattr(import_module(f"hydrodamp.identification.{module}"), name)()
        return method


def _entry(factory: str, references: Iterable[str] = (), paper_column: str = "") -> MethodEntry:
    papers = tuple(_DATA["references"][name] for name in references)
    return MethodEntry(factory, papers, paper_column)


#: References, and the methods by their keys on the command line.
_DATA = tomllib.loads(Path(__file__).with_name("methods.toml").read_text("utf-8"))
METHODS = {key: _entry(**fields) for key, fields in _DATA["methods"].items()}


def find_method(key: str | Method) -> Method:
    """Return a method with its default settings.

    Parameters
    ----------
    key : str or Method
        Such as ``"ls"``; a method is returned as it is.

    Returns
    -------
    method : Method
        With the method ``identify``.

    Raises
    ------
    MethodError
        If the key is unknown; the message suggests similar keys.

    Examples
    --------
    >>> find_method("ls")
    LeastSquares(derivative=None)
    """
    if not isinstance(key, str):
        return key
    if key not in METHODS:
        raise MethodError(no_such("method", key, METHODS))
    return METHODS[key].make()


def identify(
    model: DampingModel, vehicle: Vehicle, log: Log, method: str | Method = "recommended"
) -> Fit:
    """Identify one model from one log, and grade its coefficients.

    Parameters
    ----------
    model : DampingModel
        The terms.
    vehicle : Vehicle
        Mass matrix, restoring wrench and actuators.
    log : Log
        The measurements.
    method : str or Method
        A key, or a method with its settings such as ``LeastSquares()``.

    Returns
    -------
    fit : Fit
        Coefficients, status, covariance and grades; no grades from too short a log.

    Raises
    ------
    ProblemError
        If the log lacks what the vehicle or a term needs.
    MethodError
        If the method is unknown, or cannot identify the model from the log.
    """
    from hydrodamp.identification.identifiability import add_grades
    from hydrodamp.simulation.problem import prepare

    problem, identifier = prepare(vehicle, log, model), find_method(method)
    return add_grades(problem, identifier.identify(problem, model))[0]


def identify_all(
    problem: Problem,
    models: Iterable[DampingModel],
    method: str | Method = "recommended",
    done: Callable[[Fit], None] = lambda _: None,
) -> tuple[Fit, ...]:
    """Identify several models by one method, and grade their coefficients, on all cores.

    Work common to all models, such as the R factor of least squares, is done once. Where a method
    cannot identify one of the models, or only the terms of another model use the commands of the
    log, that fit has the status ``REFUSED`` and the reason among its remarks; the other models are
    still identified.

    Parameters
    ----------
    problem : Problem
        Prepared for the terms of all models.
    models : iterable of DampingModel
        The terms.
    method : str or Method
        A key, or a method with its settings.
    done : callable, optional
        Called with each fit when it is complete.

    Returns
    -------
    fits : tuple of Fit
        In the order of the models, with grades; without them from too short a log.

    Raises
    ------
    MethodError
        If the method is unknown.
    """
    graded = identify_and_grade(problem, models, find_method(method), lambda pair: done(pair[0]))
    return tuple(fit for fit, _ in graded)


def identify_and_grade(
    problem: Problem,
    models: Iterable[DampingModel],
    method: Method,
    done: Callable[[GradedFit], None],
) -> tuple[GradedFit, ...]:
    """Return the fits of :func:`identify_all`, each with what its grades are of."""
    from hydrodamp.identification.fit import check_actuation, check_sensors, identify_or_refuse
    from hydrodamp.identification.identifiability import add_grades
    from hydrodamp.progress import run_parallel

    def identify_one(model: DampingModel) -> GradedFit:
        return add_grades(problem, identify_or_refuse(method, problem, model))

    requested = tuple(models)
    identify_jointly = getattr(method, "identify_all", None)
    if identify_jointly is not None:
        with suppress(MethodError):  # then separately, to find the model at fault
            check_sensors(problem, method)
            for model in requested:
                check_actuation(problem, model)
            fits = identify_jointly(problem, requested)
            return run_parallel(add_grades, [(problem, fit) for fit in fits], done)
    return run_parallel(identify_one, [(model,) for model in requested], done)


def cite(subject: DampingModel | Damping | Fit) -> str:
    """Return the references of a model, of coefficients, or of a fit and its method.

    Parameters
    ----------
    subject : DampingModel, Damping or Fit
        The subject.

    Returns
    -------
    references : str
        One line per source, then the BibTeX entry of the paper where it applies.

    Examples
    --------
    >>> from hydrodamp.models.catalog import catalog
    >>> print(cite(catalog["linear"]).splitlines()[0][:50])
    Linear: Gibson, McCarter, Stilwell, Neu: A Compari
    """
    from hydrodamp.identification.fit import Fit
    from hydrodamp.models.catalog import BIBTEX, PAPER
    from hydrodamp.models.damping import Damping

    lines: list[str] = []
    if isinstance(subject, Fit):
        entry = METHODS.get(subject.method.partition("-")[0], MethodEntry(""))
        lines += [f"Method: {subject.method} of hydrodamp", *entry.references]
        lines += [PAPER] if entry.paper_column else []
        subject = subject.damping
    if isinstance(subject, Damping):
        lines += [f"Coefficients: {subject.source}"] if subject.source else []
        subject = subject.model
    lines.append(f"{subject.title}: {subject.source or 'no source given'}")
    text = "\n".join(lines)
    return f"{text}\n\n{BIBTEX}" if PAPER in text else text
