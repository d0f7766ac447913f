"""The methods: key, value, what it asks for, references; and several models by one method.

Only names are here, so that the command line lists methods without importing any.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

from hydrodamp.errors import MethodError, did_you_mean

if TYPE_CHECKING:
    from hydrodamp.identification.fit import Fit, Method
    from hydrodamp.models.damping import Damping
    from hydrodamp.models.model import DampingModel
    from hydrodamp.simulation.problem import Problem

_WEAK = """@article{messenger-bortz-2021,
  author  = {Messenger, Daniel A. and Bortz, David M.},
  title   = {Weak {SINDy}: {Galerkin}-Based Data-Driven Model Selection},
  journal = {Multiscale Modeling \\& Simulation},
  year    = {2021},
  doi     = {10.1137/20M1343166}
}"""

_TRUNCATED = """@article{farina-piroddi-2010,
  author  = {Farina, Marcello and Piroddi, Luigi},
  title   = {An Iterative Algorithm for Simulation Error Based Identification of Polynomial
             Input-Output Models Using Multi-Step Prediction},
  journal = {International Journal of Control},
  year    = {2010},
  doi     = {10.1080/00207171003793262}
}"""

_RIDGE = """@article{hoerl-kennard-1970,
  author  = {Hoerl, Arthur E. and Kennard, Robert W.},
  title   = {Ridge Regression: Biased Estimation for Nonorthogonal Problems},
  journal = {Technometrics},
  year    = {1970},
  doi     = {10.1080/00401706.1970.10488634}
}"""


@dataclass(frozen=True)
class MethodEntry:
    """A method in the table.

    Attributes
    ----------
    makes : str
        What makes the value, as module and name in ``hydrodamp.identification``.
    says : str
        What the method asks for, in one line.
    references : tuple of str
        BibTeX entries beside those of the models.
    printed : str
        The column of the paper's Table I that it stands beside; empty where none.
    """

    makes: str
    says: str
    references: tuple[str, ...] = ()
    printed: str = ""

    def value(self) -> Method:
        """Return the method itself."""
        module, name = self.makes.rsplit(".", 1)
        made: Method = getattr(import_module(f"hydrodamp.identification.{module}"), name)()
        return made


#: The methods by the keys they have on the command line.
METHODS = {
    "recommended": MethodEntry(
        "recommended.Recommended",
        "the replay of windows that do best on parts of the log that were not fitted",
        (_WEAK, _TRUNCATED),
    ),
    "ls": MethodEntry(
        "linear.LeastSquares",
        "the acceleration at each sample, recorded or by differences: the paper's least squares",
        printed="ls",
    ),
    "weak": MethodEntry(
        "linear.WeakForm",
        "the change of momentum over test functions of a second or two",
        (_WEAK,),
    ),
    "ridge": MethodEntry(
        "linear.Ridge",
        "the weak form with small coefficients preferred, strength by cross-validation",
        (_RIDGE,),
    ),
    "dissipative": MethodEntry(
        "dissipative.Dissipative",
        "the weak form among coefficients that take power everywhere in the operating box",
        (_WEAK,),
    ),
    "oe": MethodEntry(
        "output_error.OutputError",
        "the replay of windows of 2, 4, 8 and then 16 s",
        (_WEAK, _TRUNCATED),
    ),
    "ai": MethodEntry(
        "adaptive.AdaptiveIdentifier",
        "a simulated plant with feedback, sample by sample: the paper's adaptive identifier",
        printed="ai",
    ),
    "ai-scaled": MethodEntry(
        "adaptive.scaled",
        "the same with gains by axis and term from the whole log, in thirty passes",
    ),
    "rls": MethodEntry(
        "recursive.RecursiveLeastSquares",
        "the integrated equation, sample by sample, forgetting only where there is news",
    ),
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
        known = ", ".join(METHODS)
        raise MethodError(f"unknown method '{key}'.{did_you_mean(key, METHODS)} Known: {known}.")
    return METHODS[key].value()


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
    from hydrodamp.identification.fit import REFUSALS, attempted, check_drive
    from hydrodamp.simulation.parallel import each

    asked = tuple(models)
    together = getattr(method, "identify_all", None)
    if together is not None:
        with suppress(*REFUSALS):  # then one by one, to find which
            for model in asked:
                check_drive(problem, model)
            fits: tuple[Fit, ...] = together(problem, asked)
            for fit in fits:
                done(fit)
            return fits
    return each(attempted, [(method, problem, model) for model in asked], done)


def cite(subject: DampingModel | Damping | Fit) -> str:
    """Return the references of a model, of coefficients, or of a fit and its method.

    Parameters
    ----------
    subject : DampingModel, Damping or Fit
        What was used.

    Returns
    -------
    references : str
        One line a source, then BibTeX entries, each once.

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
    entries: list[str] = []
    if isinstance(subject, Fit):
        lines += [f"Method: {subject.method} of hydrodamp.", ""]
        known = METHODS.get(subject.method.partition("-")[0], MethodEntry("", ""))
        entries += [*known.references, *([BIBTEX] if known.printed else [])]
        subject = subject.damping
    if isinstance(subject, Damping):
        lines += [f"Coefficients: {subject.source}"] if subject.source else []
        subject = subject.model
    lines.append(f"{subject.title}: {subject.source or 'no source given'}")
    first = [BIBTEX] if PAPER in subject.source else []
    return "\n\n".join(["\n".join(lines), *dict.fromkeys([*first, *entries])])
