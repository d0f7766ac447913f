"""What a report shows beside a comparison: grades of coefficients, and pictures."""

from __future__ import annotations

from dataclasses import dataclass, field

from hydrodamp.identification.trust.identifiability import Identifiability
from hydrodamp.report.gallery.picture import Gallery
from hydrodamp.validation.comparison import Comparison, Row

FIGURES = "figures"
"""The folder of the pictures, in a folder of results."""


@dataclass(frozen=True)
class Findings:
    """What the training log says of the chosen row.

    Attributes
    ----------
    identifiability : Identifiability or None
        Which coefficients of the chosen model the log determines; None where it was not
        asked or could not say.
    gallery : Gallery
        The pictures.
    not_graded : str
        Why there are no grades, in a sentence; empty where there are or none were asked for.
    folder : str
        Name of the folder that their files are in.
    """

    identifiability: Identifiability | None = None
    gallery: Gallery = field(default_factory=Gallery)
    not_graded: str = ""
    folder: str = FIGURES


def chosen_row(comparison: Comparison) -> Row | None:
    """Return the row whose pictures are drawn.

    Parameters
    ----------
    comparison : Comparison
        Any.

    Returns
    -------
    row : Row or None
        The one chosen; where none has an error, the only one, if there is one alone
        with numbers.
    """
    if all(row.rms is None for row in comparison.rows):
        alone = len(comparison.rows) == 1 and comparison.rows[0].fit.status.usable
        return comparison.rows[0] if alone else None
    return comparison.choice().row
