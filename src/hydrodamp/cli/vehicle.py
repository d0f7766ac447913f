"""``hydrodamp vehicle new``: a commented vehicle file to fill in."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hydrodamp.cli import options
from hydrodamp.cli.output import emit, note

Size = Annotated[float | None, typer.Option(metavar="METRES", help="Of the hull [m].")]

_UNRIGHTED = (
    "it lacks a righting moment, so that nothing turns the vehicle upright in roll and pitch. Give "
    "`center_of_gravity` and `center_of_buoyancy` where these axes are free; the rest is estimated."
)


def new(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The YAML file to write.")],
    length: Size = None,
    diameter: Size = None,
    mass: Annotated[
        float | None, typer.Option(metavar="KG", help="With flooded spaces [kg].")
    ] = None,
    like: Annotated[
        str | None, typer.Option(metavar="V", help=f"Start from one of the fleet: {options.FLEET}.")
    ] = None,
    force: options.Force = False,
    json: options.Json = False,
) -> None:
    """Write a commented vehicle file to fill in."""
    from hydrodamp.arrays import LARGEST
    from hydrodamp.errors import VehicleError
    from hydrodamp.files import save_text
    from hydrodamp.results import check_new_file
    from hydrodamp.vehicle.file import fleet_text
    from hydrodamp.vehicle.template import rename_vehicle, vehicle_template

    sizes = {"length": length, "diameter": diameter, "mass": mass}
    complete = like is not None or mass is not None
    for name, size in sizes.items():
        if size is not None and not 0.0 < size <= LARGEST:
            raise VehicleError(f"`--{name}` must be positive and at most {LARGEST:g}; got {size:g}")
    if like is None:
        text = vehicle_template(file.stem, **sizes)
    elif any(size is not None for size in sizes.values()):
        raise VehicleError(
            "`--like` copies a known vehicle: leave out --length, --diameter, --mass"
        )
    else:
        text = rename_vehicle(fleet_text(like), file.stem)
    check_new_file(file, force)
    save_text(text, file)
    if json:
        emit({"path": str(file), "complete": complete})
    else:
        whole = "ready to use" if like is not None else _UNRIGHTED
        note(f"written to {file}: {whole if complete else 'fill in its numbers'}")
