"""Damping models as a table: how many terms on which axis."""

from __future__ import annotations

from collections.abc import Iterable

from hydrodamp.basis.axes import AXES
from hydrodamp.models.model import DampingModel, group_axes
from hydrodamp.report.document import Document
from hydrodamp.report.grid import Grid


def models_grid(models: Iterable[DampingModel], command: str = "") -> Grid:
    """Return models with their counts."""
    rows = tuple(
        (
            model.key,
            str(model.n_coefficients),
            *(str(len(row)) for row in model.terms),
            model.title,
        )
        for model in models
    )
    header, align = ("name", "n", *AXES, "title"), "lr" + "r" * len(AXES) + "l"
    notes = (f"`{command}` shows the terms of one.",) if command else ()
    return Grid("Damping models", header, rows, align, notes)


def model_document(model: DampingModel) -> Document:
    """Return a model as a document."""
    return {
        "model": model.key,
        "title": model.title,
        "n_coefficients": model.n_coefficients,
        "terms": {
            axis: [str(term) for term in row] for axis, row in zip(AXES, model.terms, strict=True)
        },
        "commands": list(model.commands),
        "source": model.source,
        "note": model.note,
    }


def model_grid(model: DampingModel) -> Grid:
    """Return one model with its terms."""
    rows = tuple(
        (" ".join(axes), str(len(row)), " ".join(map(str, row)) or "none")
        for row, axes in group_axes(model).items()
    )
    remarks = (("Source", model.source), ("Note", model.note))
    return Grid(
        f"{model.title} ({model.key}): {model.n_coefficients} coefficients",
        ("axes", "n", "terms"),
        rows,
        "lrl",
        notes=tuple(f"{name}: {text}" for name, text in remarks if text),
    )
