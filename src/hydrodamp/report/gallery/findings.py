"""What a report shows beside a comparison: grades of coefficients, a band, and pictures."""

from __future__ import annotations

from dataclasses import dataclass, field

from hydrodamp.identification.grades import Identifiability
from hydrodamp.report.gallery.picture import Gallery
from hydrodamp.validation.bands import PredictionBand
from hydrodamp.validation.comparison import Comparison, Row

FIGURES = "figures"
"""The folder of the pictures, in a folder of results."""


@dataclass(frozen=True)
class Findings:
    """What is found out about the chosen row after the fits."""

    identifiability: Identifiability | None = None
    gallery: Gallery = field(default_factory=Gallery)
    not_graded: str = ""
    band: PredictionBand | None = None
    folder: str = FIGURES


def chosen_row(comparison: Comparison) -> Row | None:
    """Return the row whose pictures are drawn."""
    if all(row.rms is None for row in comparison.rows):
        alone = len(comparison.rows) == 1 and comparison.rows[0].fit.status.usable
        return comparison.rows[0] if alone else None
    return comparison.choice().row


def models_of(comparison: Comparison, first: Row | None) -> tuple[str, ...]:
    """Return the models of a report in the order in which they take dashes."""
    lowest: dict[str, float] = {}
    for row in comparison.rows:
        error = float("inf") if row.rms is None else row.rms
        lowest[row.model] = min(error, lowest.get(row.model, error))
    chosen = () if first is None else (first.model,)
    return tuple(dict.fromkeys((*chosen, *sorted(lowest, key=lowest.__getitem__))))
