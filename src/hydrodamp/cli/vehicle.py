"""``hydrodamp vehicle new``: write a vehicle file from main dimensions or a known vehicle."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from hydrodamp.cli import options
from hydrodamp.cli.output import emit, note

Size = Annotated[float | None, options.option("new-size")]

NO_RESTORING_MOMENT = (
    "it has no restoring moment in roll and pitch. Give `center_of_gravity` and "
    "`center_of_buoyancy` if these axes are free; all else is estimated."
)


def new(
    file: Annotated[Path, options.argument("new-file")],
    length: Size = None,
    diameter: Size = None,
    mass: Annotated[float | None, options.option("new-mass")] = None,
    like: Annotated[str | None, options.option("new-like")] = None,
    force: options.Force = False,
    json: options.Json = False,
) -> None:
    """Write a commented vehicle file from main dimensions or a known vehicle."""
    from hydrodamp.arrays import MAX_MAGNITUDE
    from hydrodamp.errors import VehicleError
    from hydrodamp.files import save_text
    from hydrodamp.results import check_new_file
    from hydrodamp.vehicle.file import fleet_text, rename_vehicle, vehicle_template

    sizes = {"length": length, "diameter": diameter, "mass": mass}
    complete = like is not None or mass is not None
    for name, size in sizes.items():
        if size is not None and not 0.0 < size <= MAX_MAGNITUDE:
            raise VehicleError(
                f"`--{name}` must be positive and at most {MAX_MAGNITUDE:g}; got {size:g}"
            )
    if like is None:
        text = vehicle_template(file.stem, **sizes)
    elif any(size is not None for size in sizes.values()):
        raise VehicleError("`--like` cannot be combined with --length, --diameter or --mass.")
    else:
        text = rename_vehicle(fleet_text(like), file.stem)
    check_new_file(file, force)
    save_text(text, file)
    if json:
        emit({"path": str(file), "complete": complete})
    else:
        state = "ready to use" if like is not None else NO_RESTORING_MOMENT
        note(f"written to {file}: {state if complete else 'fill in the missing numbers'}")
