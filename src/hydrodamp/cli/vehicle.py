"""Command ``vehicle new``."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Literal

import hydrodamp as hd
from hydrodamp.cli.inputs import read_logs, split_names
from hydrodamp.cli.output import emit, note
from hydrodamp.errors import VehicleError, demand
from hydrodamp.files import save_text
from hydrodamp.results import check_new_file

NO_ACTUATORS = "actuators: []"
NO_RESTORING_MOMENT = (
    "it has no restoring moment in roll and pitch. Give `center_of_gravity` and "
    "`center_of_buoyancy` if these axes are free. If the log has commands, give `actuators`, "
    "or estimate them with `--log LOG`; without them, the model `general` has gains of all "
    "commands. All else is estimated."
)


def add_actuators(text: str, log: hd.Log) -> str:
    """Return the text of a vehicle file with actuators whose gains are estimated from a log."""
    from hydrodamp.basis.term import AXES
    from hydrodamp.ingest.inspection.delay import estimate_delays
    from hydrodamp.ingest.inspection.draft_files import group_commands
    from hydrodamp.ingest.inspection.equivalent_commands import equivalent_commands
    from hydrodamp.report.fit_tables import half_widths
    from hydrodamp.vehicle.file import parse_vehicle

    if NO_ACTUATORS not in text:
        raise VehicleError("`--log` estimates actuators, but this vehicle has some: omit it.")
    vehicle = parse_vehicle(text, source="the vehicle of `--log`")
    omitted = [name for group in equivalent_commands(log) for name in group.omitted]
    groups = group_commands(each for each in estimate_delays(log) if each.command not in omitted)
    terms = {
        axis: " ".join(delay.command for delay in group)
        for axis, group in groups.items()
        if axis in vehicle.axes
    }
    if not terms:
        raise VehicleError(
            f"{log.source or 'log'}: no command moves the vehicle measurably, so no actuator can "
            "be estimated: omit `--log`, or use a log with more manoeuvres."
        )
    model = hd.catalog["fossen"].with_terms(terms)
    fit = hd.WeakForm().identify(hd.prepare(vehicle, log, model), model)
    margins = dict(zip(fit.model.labels, half_widths(fit).tolist(), strict=True))
    lines = ["actuators:  # gains by the weak form, with 95 % intervals; valid with these masses"]
    for axis, names in terms.items():
        for name in names.split():
            label, row = f"{axis}_{name}", [0.0] * len(AXES)
            row[AXES.index(axis)] = value = float(f"{fit.damping[label]:.4g}")
            lines.append(
                f"  - {{kind: matrix, commands: [{name}], wrench: [{row}]}}  "
                f"# {axis} {value:g} ± {margins[label]:.2g}"
            )
    return text.replace(NO_ACTUATORS, "\n".join(lines))


def new(
    file: Path,
    kind: Literal["auv", "rov", "boat", "catamaran", "ship"] | None = None,
    length: float | None = None,
    diameter: float | None = None,
    beam: float | None = None,
    draft: float | None = None,
    mass: float | None = None,
    block_coefficient: float | None = None,
    axes: str | None = None,
    like: str | None = None,
    log: list[str] | None = None,
    mapping: str | None = None,
    force: bool = False,
    json: bool = False,
) -> None:
    """Write a commented vehicle file from main dimensions or a known vehicle."""
    from hydrodamp.arrays import MAX_MAGNITUDE
    from hydrodamp.vehicle.file import fleet_text, parse_vehicle
    from hydrodamp.vehicle.template import rename_vehicle, vehicle_template
    from hydrodamp.vehicle.vehicle import without_righting

    sizes = {
        "length": length,
        "diameter": diameter,
        "beam": beam,
        "draft": draft,
        "mass": mass,
        "block_coefficient": block_coefficient,
    }
    known = {name: size for name, size in sizes.items() if size is not None}
    bounds = f"positive and at most {MAX_MAGNITUDE:g}"
    for name, size in known.items():
        option = f"--{name.replace('_', '-')}"
        demand(0.0 < size <= MAX_MAGNITUDE, option, bounds, f"{size:g}")
    free = None if axes is None else split_names(axes)
    if like is None:
        text = vehicle_template(file.stem, free, kind or "auv", **known)
    elif known or kind is not None:
        raise VehicleError("`--like` cannot be combined with --kind, --length, or other sizes.")
    else:
        text = rename_vehicle(fleet_text(like), file.stem)
        if free is not None:
            line = f"axes: [{', '.join(free)}]\n"
            text, n_lines = re.subn(r"^axes: .*\n", line, text, flags=re.MULTILINE)
            text += "" if n_lines else line
    check_new_file(file, force)
    complete = like is not None or bool(known)
    state = "fill in the missing numbers"
    if complete:
        is_usable = not without_righting(parse_vehicle(text))
        state = "ready to use" if is_usable else NO_RESTORING_MOMENT
    if log:
        text = add_actuators(text, read_logs(log, mapping))
    save_text(text, file)
    if json:
        emit({"path": str(file), "complete": complete})
    else:
        note(f"written to {file}: {state}")
