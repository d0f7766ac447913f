"""``hydrodamp vehicle new``: a commented vehicle file to fill in."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hydrodamp.cli import options
from hydrodamp.cli.output import emit, note

Size = Annotated[float | None, typer.Option(metavar="METRES", help="Of the hull [m].")]


def new(
    file: Annotated[str, typer.Argument(metavar="FILE", help="The YAML file to write.")],
    length: Size = None,
    diameter: Size = None,
    mass: Annotated[
        float | None,
        typer.Option("--mass", metavar="KG", help="With flooded spaces [kg]."),
    ] = None,
    force: options.Force = False,
    json: options.Json = False,
) -> None:
    """Write a commented vehicle file to fill in.

    With --length, --diameter and --mass it is an estimate that can be used as it is.
    """
    from hydrodamp.cli.targets import check_new_file
    from hydrodamp.saving import save_text
    from hydrodamp.vehicle.template import vehicle_template

    path = Path(file)
    check_new_file(file, force)
    save_text(vehicle_template(path.stem, length=length, diameter=diameter, mass=mass), path)
    complete = mass is not None
    if json:
        emit({"path": str(path), "complete": complete})
    else:
        hint = "an estimate, ready to use" if complete else "fill in its numbers"
        note(f"written to {path}: {hint}")
