"""What to cite for a fit: its model, and the method that found its numbers."""

from __future__ import annotations

from hydrodamp.identification.fit import Fit
from hydrodamp.models.catalog import BIBTEX
from hydrodamp.models.damping import Damping, cite as cite_model
from hydrodamp.models.model import DampingModel

_WEAK = """@article{messenger-bortz-2021,
  author  = {Messenger, Daniel A. and Bortz, David M.},
  title   = {Weak {SINDy}: {Galerkin}-Based Data-Driven Model Selection},
  journal = {Multiscale Modeling \\& Simulation},
  year    = {2021},
  doi     = {10.1137/20M1343166}
}"""

_RIDGE = """@article{hoerl-kennard-1970,
  author  = {Hoerl, Arthur E. and Kennard, Robert W.},
  title   = {Ridge Regression: Biased Estimation for Nonorthogonal Problems},
  journal = {Technometrics},
  year    = {1970},
  doi     = {10.1080/00401706.1970.10488634}
}"""

#: Entries by key; a method that is not here has no paper of its own.
_METHODS = {
    **dict.fromkeys(("ls", "ai", "ai-scaled"), (BIBTEX,)),
    "weak": (_WEAK,),
    "ridge": (_RIDGE,),
    "dissipative": (_WEAK,),
    "recommended": (_WEAK, _RIDGE),
}


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
    if not isinstance(subject, Fit):
        return cite_model(subject)
    said = cite_model(subject.damping)
    entries = [entry for entry in _METHODS.get(subject.method, ()) if entry not in said]
    return "\n\n".join([f"Method: {subject.method} of hydrodamp.", said, *entries])
