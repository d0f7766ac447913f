"""What a report shows beside a comparison: grades of coefficients, a band, and pictures."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Annotated

from pydantic import Field

from hydrodamp.identification.grades import Identifiability
from hydrodamp.validation.bands import PredictionBand
from hydrodamp.validation.compare import Comparison, Row

#: The folder of the pictures, in a folder of results.
FIGURES = "figures"

#: The element ``svg`` begins in so many bytes of a file.
_HEAD = 2000


@dataclass(frozen=True)
class Picture:
    """A drawing and its words; the drawing is a file of its own beside theirs."""

    name: Annotated[str, Field(pattern="^[a-z0-9-]+$")]
    title: str
    caption: str
    svg: Annotated[bytes, Field(exclude=True)] = b""
    print_only: bool = False

    @property
    def alt(self) -> str:
        """The words in its place for those who do not see it."""
        return f"Figure: {self.title}. The caption describes it."

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [pt]; zero where the drawing does not begin as ours do."""
        head = self.svg[:_HEAD]
        width = re.search(rb'<svg\b[^>]*?\swidth="([\d.]+)pt"', head)
        height = re.search(rb'<svg\b[^>]*?\sheight="([\d.]+)pt"', head)
        return (float(width[1]), float(height[1])) if width and height else (0.0, 0.0)


@dataclass(frozen=True)
class Gallery:
    """The pictures of a run."""

    pictures: tuple[Picture, ...] = ()
    not_drawn: tuple[str, ...] = ()


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
    """Return the models in the order in which they take dashes: the chosen one, then by error."""
    scored = [row for row in comparison.rows if row.rms is not None]
    ranked = [row.model for row in sorted(scored, key=lambda row: row.rms or 0.0)]
    chosen = () if first is None else (first.model,)
    return tuple(dict.fromkeys((*chosen, *ranked, *comparison.models)))
