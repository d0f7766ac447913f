"""The model that has no terms before there is a log, listed beside those that have."""

from __future__ import annotations

from dataclasses import replace

from hydrodamp.identification.candidates import KEY
from hydrodamp.report.document import Document
from hydrodamp.report.grid import Grid
from hydrodamp.report.numbers import NOTHING

_TITLE = "Selected from a log"
_NOTE = (
    "comes with a log: its terms are selected from the training data, axis by axis from those of "
    "the paper's models and by what they do to the replay, with dissipation kept. Ask for it by "
    f"`hydrodamp compare LOG ... --models {KEY}`, alone or beside others."
)
_SOURCE = (
    "Selection by the simulated output: Piroddi and Spinelli (2003), "
    "doi:10.1080/00207170310001635419"
)


def with_selected(grid: Grid) -> Grid:
    """Return a list of models and the one that is selected from a log."""
    row = (KEY, NOTHING, *[""] * (len(grid.header) - 3), _TITLE)
    return replace(grid, rows=(*grid.rows, row), notes=(f"`{KEY}` {_NOTE}", *grid.notes))


def selected_grid() -> Grid:
    """Return what is known of the selected model before there is a log."""
    notes = f"Source: {_SOURCE}", f"Note: {KEY} {_NOTE}"
    return Grid(f"{_TITLE} ({KEY})", ("terms",), (("none before there is a log",),), "l", notes)


def selected_document() -> Document:
    """Return the selected model as a document."""
    return {
        "model": KEY,
        "title": _TITLE,
        "n_coefficients": None,
        "terms": None,
        "commands": [],
        "source": _SOURCE,
        "note": f"{KEY} {_NOTE}",
    }
