"""``hydrodamp models``: the catalogue."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from hydrodamp.cli import options
from hydrodamp.cli.output import emit, results
from hydrodamp.errors import ModelError

if TYPE_CHECKING:
    from hydrodamp.models.model import DampingModel


def models(
    name: Annotated[
        str | None,
        typer.Argument(metavar="NAME", help="A model of the catalogue, a YAML file, or FILE:NAME."),
    ] = None,
    model: Annotated[
        str | None, typer.Argument(metavar="MODEL", help="One model of a file that holds several.")
    ] = None,
    json: options.Json = False,
) -> None:
    """List the damping models, or show one: terms, counts, source, note."""
    from hydrodamp.cli.choose import SPARSE, named_models, one_of
    from hydrodamp.models.catalog import catalog
    from hydrodamp.report.fit_tables import SPARSE as SELECTED, model_document

    if name is None:
        _list(tuple(catalog.values()), "", json)
    elif model is not None:
        _refuse_name(name, model)
        _show(model_document(one_of(name, model, named_models(name))), json)
    elif name == SPARSE:
        _show(SELECTED, json)
    elif len(found := named_models(name)) == 1:
        _show(model_document(found[0]), json)
    else:
        _list(found, name, json)


def _refuse_name(name: str, model: str) -> None:
    from hydrodamp.models.catalog import catalog

    if name in catalog:
        raise ModelError(f"`{name}` is a model of the catalogue, no file: leave out `{model}`.")


def _show(document: dict[str, Any], json: bool) -> None:
    from hydrodamp.report.fit_tables import model_grid
    from hydrodamp.report.grid import show

    emit(document) if json else show(results(), model_grid(document))


def _list(found: tuple[DampingModel, ...], file: str, json: bool) -> None:
    """List models; the catalogue, which is no file, with the one that comes with a log."""
    from hydrodamp.report.fit_tables import SPARSE, model_document, models_grid
    from hydrodamp.report.grid import show

    documents, selected = [model_document(model) for model in found], [] if file else [SPARSE]
    if json:
        emit({"models": documents, **({"selected_from_a_log": selected} if selected else {})})
        return
    command = f"hydrodamp models {file or 'NAME'}{' MODEL' if file else ''}"
    show(results(), models_grid([*documents, *selected], command))
