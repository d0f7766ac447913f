"""Where a model or a set of coefficients comes from, ready to cite."""

from __future__ import annotations

from hydrodamp.models.catalog import PAPER
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel

BIBTEX = """@inproceedings{gibson-mccarter-stilwell-neu,
  author    = {Gibson, Scott B. and McCarter, Brian and Stilwell, Daniel J. and Neu, Wayne L.},
  title     = {A Comparison of Hydrodynamic Damping Models using Least-Squares and Adaptive
               Identifier Methods for Autonomous Underwater Vehicles},
  booktitle = {OCEANS 2015},
  year      = {2015}
}"""
"""The paper the catalogue follows."""


def cite(subject: DampingModel | Damping) -> str:
    """Return the references of a model, or of coefficients and their model."""
    model = subject.model if isinstance(subject, Damping) else subject
    lines = [f"{model.title}: {model.source or 'no source given'}"]
    if isinstance(subject, Damping) and subject.source:
        lines.insert(0, f"Coefficients: {subject.source}")
    return "\n".join([*lines, "", BIBTEX] if PAPER in model.source else lines)
