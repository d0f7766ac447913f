"""``hydrodamp models``: the catalogue."""

from __future__ import annotations

from typing import Annotated

import typer

from hydrodamp.cli import options
from hydrodamp.cli.output import emit, results


def models(
    name: Annotated[
        str | None,
        typer.Argument(metavar="NAME", help="A model of the catalogue, or a YAML file."),
    ] = None,
    json: options.Json = False,
) -> None:
    """List the damping models, or show one: terms, counts, source, note."""
    from hydrodamp.cli.choose import named_models
    from hydrodamp.models.catalog import catalog
    from hydrodamp.report.model_grids import model_document, model_grid, models_grid
    from hydrodamp.report.screen import show

    shown = tuple(catalog.values()) if name is None else named_models(name)
    single = name is not None and len(shown) == 1
    if json:
        listed = [model_document(model) for model in shown]
        emit(listed[0] if single else {"models": listed})
    elif single:
        show(results(), model_grid(shown[0]))
    else:
        show(results(), models_grid(shown))
