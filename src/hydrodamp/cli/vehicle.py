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
    like: Annotated[
        str | None,
        typer.Option(
            "--like", metavar="V", help=f"Start from a vehicle of the fleet: {options.FLEET}."
        ),
    ] = None,
    force: options.Force = False,
    json: options.Json = False,
) -> None:
    """Write a commented vehicle file to fill in."""
    from hydrodamp.cli.targets import check_new_file
    from hydrodamp.errors import VehicleError
    from hydrodamp.files import save_text
    from hydrodamp.vehicle.fleet import fleet_text
    from hydrodamp.vehicle.template import copied, vehicle_template

    path, sizes = Path(file), {"length": length, "diameter": diameter, "mass": mass}
    if like is not None and any(size is not None for size in sizes.values()):
        raise VehicleError(
            "`--like` copies a known vehicle: leave out --length, --diameter, --mass"
        )
    check_new_file(file, force)
    text = (
        vehicle_template(path.stem, **sizes)
        if like is None
        else copied(fleet_text(like), path.stem)
    )
    save_text(text, path)
    complete = like is not None or mass is not None
    if json:
        emit({"path": str(path), "complete": complete})
    else:
        note(f"written to {path}: {_hint(like, complete)}")
    if mass is not None:
        note(
            "note: both centers are at the origin, so nothing rights the vehicle in roll and "
            "pitch: enter `center_of_gravity`, as the comment there says."
        )


def _hint(like: str | None, complete: bool) -> str:
    if like is not None:
        return f"{like} under a name of its own, ready to use"
    return "an estimate, ready to use" if complete else "fill in its numbers"
