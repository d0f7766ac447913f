"""``hydrodamp models``: list the damping models of the catalogue."""

from __future__ import annotations

from typing import Annotated

import hydrodamp as hd
from hydrodamp.cli import options, resolve
from hydrodamp.cli.output import emit, print_results


def models(
    name: Annotated[str | None, options.argument("models-name")] = None,
    json: options.Json = False,
) -> None:
    """List the damping models, or show the terms and the source of one."""
    from hydrodamp.report.fit_tables import SPARSE, model_document, model_table

    sparse = [SPARSE] if name == resolve.SPARSE else []
    catalogue = [*(resolve.read_named_models(name) if name and not sparse else hd.catalog.values())]
    documents = sparse or [model_document(model) for model in catalogue]
    selected = [] if name else [SPARSE]
    if name and len(documents) == 1:
        emit(documents[0]) if json else print_results(
            SPARSE["note"] if sparse else str(catalogue[0])
        )
    elif json:
        emit({"models": documents, **({"selected_from_a_log": selected} if selected else {})})
    else:
        command = f"hydrodamp models {f'{name}:NAME' if name else 'NAME'}"
        print_results(model_table([*documents, *selected], command))
