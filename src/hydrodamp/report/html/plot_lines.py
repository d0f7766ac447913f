"""What each line of the time series is: its name, its look, and the words of the band."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.report.figures.look import Look, colour_of, looks_of
from hydrodamp.report.gallery.captions import said_of_band
from hydrodamp.report.gallery.findings import chosen_row, models_of
from hydrodamp.validation.bands import PredictionBand
from hydrodamp.validation.comparison import Comparison, Row

WIDTH = 1.5
"""Of a line [px]."""


@dataclass(frozen=True)
class Line:
    """A replay that can be drawn."""

    name: str
    method: str
    colour: str
    dashes: tuple[float, ...]

    @classmethod
    def of(cls, row: Row, look: Look) -> Line:
        """Return the line of a row."""
        dashes = tuple(round(WIDTH * length, 1) for length in look.dashes)
        return cls(f"{row.model} by {row.method}", row.method, look.colour, dashes)


@dataclass(frozen=True)
class BandLine:
    """The band that can be drawn."""

    name: str
    method: str
    colour: str
    words: str


def lines_of(comparison: Comparison, rows: Sequence[Row]) -> tuple[Line, ...]:
    """Return how replays are drawn, in the looks that the pictures of the run have too."""
    models = models_of(comparison, chosen_row(comparison))
    looks = looks_of([(row.model, row.method) for row in rows], models)
    return tuple(map(Line.of, rows, looks))


def band_line(
    row: Row, band: PredictionBand, half: FloatArray, names: Sequence[str], unit: str
) -> BandLine:
    """Return what is said of a band."""
    name = f"{100.0 * band.level:.0f} % band of {row.model} by {row.method}"
    widths = [
        f"{one} {np.sqrt(np.nanmean(column**2)):.2g} {'m/s' if one in 'uvw' else unit}"
        for one, column in zip(names, half.T, strict=True)
        if np.isfinite(column).any()
    ]
    said = said_of_band(f"{row.model} by {row.method}")
    wide = f" Half its width, in the root mean square: {', '.join(widths)}." if widths else ""
    return BandLine(name, row.method, colour_of(row.method), f"{said}{wide}")
