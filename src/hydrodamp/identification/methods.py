"""The methods: key, value, references; and several models by one method.

Only names are here, so that the command line lists methods without importing any.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

from hydrodamp.errors import MethodError, no_such

if TYPE_CHECKING:
    from hydrodamp.identification.fit import Fit, Method
    from hydrodamp.models.damping import Damping
    from hydrodamp.models.model import DampingModel
    from hydrodamp.simulation.problem import Problem

_WEAK = (
    "D. A. Messenger, D. M. Bortz: Weak SINDy: Galerkin-Based Data-Driven Model Selection. "
    "Multiscale Modeling & Simulation, 2021. doi:10.1137/20M1343166"
)
_TRUNCATED = (
    "M. Farina, L. Piroddi: An Iterative Algorithm for Simulation Error Based Identification of "
    "Polynomial Input-Output Models Using Multi-Step Prediction. International Journal of "
    "Control, 2010. doi:10.1080/00207171003793262"
)
_RIDGE = (
    "A. E. Hoerl, R. W. Kennard: Ridge Regression: Biased Estimation for Nonorthogonal Problems. "
    "Technometrics, 1970. doi:10.1080/00401706.1970.10488634"
)


@dataclass(frozen=True)
class MethodEntry:
    """A method in the table.

    Attributes
    ----------
    makes : str
        What makes the value, as module and name in ``hydrodamp.identification``.
    references : tuple of str
        Papers beside those of the models, a line each.
    printed : str
        The column of the paper's Table I that it stands beside; empty where none.
    """

    factory: str
    references: tuple[str, ...] = ()
    paper_column: str = ""

    def make(self) -> Method:
        """Return the method itself."""
        module, name = self.factory.rsplit(".", 1)
        made: Method = getattr(import_module(f"hydrodamp.identification.{module}"), name)()
        return made


#: The methods by the keys they have on the command line.
METHODS = {
    "recommended": MethodEntry("output_error.Recommended", (_WEAK, _TRUNCATED)),
    "ls": MethodEntry("least_squares.LeastSquares", paper_column="ls"),
    "weak": MethodEntry("least_squares.WeakForm", (_WEAK,)),
    "ridge": MethodEntry("least_squares.Ridge", (_WEAK, _RIDGE)),
    "dissipative": MethodEntry("dissipative.Dissipative", (_WEAK,)),
    "oe": MethodEntry("output_error.OutputError", (_WEAK, _TRUNCATED)),
    "ai": MethodEntry("adaptive.AdaptiveIdentifier", paper_column="ai"),
    "ai-scaled": MethodEntry("adaptive.scaled_identifier"),
    "rls": MethodEntry("recursive.RecursiveLeastSquares"),
}


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
        raise MethodError(no_such("method", key, METHODS))
    return METHODS[key].make()


def identify_all(
    problem: Problem,
    models: Iterable[DampingModel],
    method: Method,
    done: Callable[[Fit], None] = lambda _: None,
) -> tuple[Fit, ...]:
    """Identify several models by one method, on all cores.

    A method that shares work between models does it once, such as the triangle of least
    squares. Where a method cannot identify one of the models from this log, or nothing says what
    force drives the vehicle but the terms of another model, that fit has the status ``REFUSED``
    and the reason among its remarks; the others are not lost with it.

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
    from hydrodamp.identification.fit import check_actuation, identify_or_refuse
    from hydrodamp.simulation.parallel import run_parallel

    asked = tuple(models)
    together = getattr(method, "identify_all", None)
    if together is not None:
        with suppress(MethodError):  # then one by one, to find which
            for model in asked:
                check_actuation(problem, model)
            fits: tuple[Fit, ...] = together(problem, asked)
            for fit in fits:
                done(fit)
            return fits
    return run_parallel(identify_or_refuse, [(method, problem, model) for model in asked], done)


def cite(subject: DampingModel | Damping | Fit) -> str:
    """Return the references of a model, of coefficients, or of a fit and its method.

    Parameters
    ----------
    subject : DampingModel, Damping or Fit
        What was used.

    Returns
    -------
    references : str
        One line a source, then the paper's BibTeX entry where it is among them.

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
        known = METHODS.get(subject.method.partition("-")[0], MethodEntry(""))
        lines += [f"Method: {subject.method} of hydrodamp", *known.references]
        lines += [PAPER] if known.paper_column else []
        subject = subject.damping
    if isinstance(subject, Damping):
        lines += [f"Coefficients: {subject.source}"] if subject.source else []
        subject = subject.model
    lines.append(f"{subject.title}: {subject.source or 'no source given'}")
    text = "\n".join(lines)
    return f"{text}\n\n{BIBTEX}" if PAPER in text else text
