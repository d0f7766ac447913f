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
    from hydrodamp.identification.fit import Fit, Method
    from hydrodamp.models.damping import Damping
    from hydrodamp.models.model import DampingModel
    from hydrodamp.simulation.problem import Problem


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


def find_method(key: str) -> Method:
    """Return a method with its default settings.

    Parameters
    ----------
    key : str
        Such as ``"ls"``.

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
    if key not in METHODS:
        raise MethodError(no_such("method", key, METHODS))
    return METHODS[key].make()


def identify_all(
    problem: Problem,
    models: Iterable[DampingModel],
    method: Method,
    done: Callable[[Fit], None] = lambda _: None,
) -> tuple[Fit, ...]:
    """Identify several models by one method, on all cores.

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
    method : Method
        The method with its settings.
    done : callable, optional
        Called with each fit when it is complete; with all together where work is common.

    Returns
    -------
    fits : tuple of Fit
        In the order of the models.
    """
    from hydrodamp.identification.fit import check_actuation, check_sensors, identify_or_refuse
    from hydrodamp.progress import run_parallel

    requested = tuple(models)
    identify_jointly = getattr(method, "identify_all", None)
    if identify_jointly is not None:
        with suppress(MethodError):  # then separately, to find the model at fault
            check_sensors(problem, method)
            for model in requested:
                check_actuation(problem, model)
            fits: tuple[Fit, ...] = identify_jointly(problem, requested)
            for fit in fits:
                done(fit)
            return fits
    return run_parallel(identify_or_refuse, [(method, problem, model) for model in requested], done)


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
