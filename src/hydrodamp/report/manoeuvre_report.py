"""Report of a ship's manoeuvres: verdict, table, JSON and pictures."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.experiment_design.ship_manoeuvres import LEVEL, Characteristic, ShipManoeuvres
from hydrodamp.experiment_design.ship_motion import CIRCLE, MAX_DURATION, TURN
from hydrodamp.files import as_json
from hydrodamp.identification.dissipativity import velocity_unit
from hydrodamp.report.figures.manoeuvres import manoeuvre_figure, spiral_figure
from hydrodamp.report.pictures import draw_pictures
from hydrodamp.report.table import NOTHING, Table, coefficient
from hydrodamp.results import save_results
from hydrodamp.vehicle.actuators import Limited

#: Names of all files, relative to their folder.
RESULTS = (
    *("manoeuvres.json", "turning-circle.svg", "zigzag-10-10.svg", "zigzag-20-20.svg"),
    *("stopping.svg", "spiral.svg"),
)

#: Length [m] of ships from which the limits apply (section 2).
IMO, MIN_LENGTH = "IMO resolution MSC.137(76)", 100.0


def describe_verdict(result: ShipManoeuvres) -> str:
    """Return the reservations, whether the ship meets the limits, and what is beyond them."""
    exceeded = [
        f"{_name(each)} "
        + ("not reached" if each.value is None else f"{each.value:.3g} > {each.limit:.3g}")
        for each in result.characteristics
        if each.limit is not None and not each.draws[0] <= each.limit
    ]
    unfinished = [
        _title(*key)
        for key, reached in _find_failures(result).items()
        if any(each.limit is not None for each in reached)
    ]
    share = result.probability
    chance = "" if share is None else f" ({100.0 * share:.0f} % of the draws meet them)"
    verb, reasons = ("does not meet", f": {', '.join(exceeded)}") if exceeded else ("meets", "")
    subject = result.ship.vehicle.name
    if result.reservations:
        subject = f"{' '.join(result.reservations)} With these reservations, {subject}"
    verdict = f"{subject} {verb} the limits of {IMO}{chance}{reasons}."
    if unfinished:
        names = ", ".join(unfinished)
        verdict += f" The model does not hold to the end: {names}; "
        verdict += "the numbers are of the motion before."
    return verdict


def _find_failures(result: ShipManoeuvres) -> dict[tuple[str, str], list[Characteristic]]:
    """Return the numbers that the estimate reaches in each simulated manoeuvre that it fails."""
    groups = dict[tuple[str, str], list[Characteristic]]()
    for each in result.characteristics:
        if each.manoeuvre in result.trajectories:
            groups.setdefault((each.manoeuvre, each.side), []).append(each)
    reached = {
        key: [each for each in group if each.value is not None] for key, group in groups.items()
    }
    return {key: numbers for key, numbers in reached.items() if len(numbers) < len(groups[key])}


def _end(result: ShipManoeuvres, name: str, column: int) -> str:
    """Return how a run ends that lacks a number."""
    run, ship = result.trajectories[name], result.ship
    n = int(np.isfinite(run.states[:, column, 0]).sum())
    last = run.states[n - 1, column]
    if np.abs(last[8]) >= np.radians(CIRCLE):
        return "turns to the other side" if name == TURN else f"turns by {CIRCLE:g} deg"
    if last[0] <= 0.0:
        return "stops"
    longest = MAX_DURATION * ship.time_unit
    return "does not end" if (n + 1) * run.period > longest else "diverges"


def _name(each: Characteristic) -> str:
    return f"{each.name} of the {_title(each.manoeuvre, each.side)}"


def _title(name: str, side: str) -> str:
    return f"{name} to {side}" if side else name


def describe_conditions(result: ShipManoeuvres) -> Iterator[str]:
    """Yield conditions, manoeuvres that the model cannot hold, and extrapolations."""
    ship, steady = result.ship, result.steady[0]
    rudder, propeller = ship.names[ship.rudder], ship.names[ship.propeller]
    yield (
        f"Approach at {ship.speed:.3g} m/s, L {ship.length:.4g} m, L/V {ship.time_unit:.3g} s; "
        f"`{rudder}` at {np.degrees(ship.rudder_rate):.3g} deg/s, straight ahead with "
        f"{np.degrees(steady[2]) + 0.0:.1f} deg to starboard; `{propeller}` held at "
        f"{steady[3]:.4g}, reversed for stopping."
    )
    if unused := [name for name in ship.names if name not in (rudder, propeller)]:
        yield f"Other commands are held at 0: {', '.join(unused)}."
    if ship.length < MIN_LENGTH:
        yield f"The limits of the IMO are those of ships of {MIN_LENGTH:g} m and more."
    for actuator in ship.vehicle.actuators:
        if isinstance(actuator, Limited) and actuator.command == rudder and actuator.limit:
            yield f"`{rudder}` is limited to {np.degrees(actuator.limit):.3g} deg in the vehicle."
    for (name, side), reached in _find_failures(result).items():
        run, column = result.trajectories[name], len(result.steady) * (side == "port")
        last = int(np.isfinite(run.states[:, column, 0]).sum()) - 1
        angle = ship.side * np.degrees(run.commands[last, column, ship.rudder]) + 0.0
        yield (
            f"The model cannot hold the {_title(name, side)}: it {_end(result, name, column)}, "
            f"{last * run.period:.3g} s after the order, with `{rudder}` {angle:.3g} deg to "
            f"starboard and `{propeller}` at {run.commands[last, column, ship.propeller]:.4g}"
            + ("; its numbers are of the motion before that." if reached else ".")
        )
    if outside := [_name(each) for each in result.characteristics if each.is_outside]:
        yield (
            "The estimate is outside the band of the draws, since motion is not linear in the "
            f"coefficients and some draws fail: {', '.join(outside)}."
        )
    for name, velocities in result.extrapolation.items():
        for key, (known, largest, error) in velocities.items():
            width = "" if error is None else f"; predicted error ±{error:.2g} {_unit(key)[1]}"
            yield f"Extrapolation in the {name}: {_exceed(key, known, largest)}{width}."
    for name, ends in result.drawn_extrapolation.items():
        if clauses := [_exceed(key, *pair) for key, pair in ends.items()]:
            share = f"{100.0 * (1.0 - LEVEL):.0f} % of the draws of the {name}"
            yield f"Extrapolation in {share}: {'; '.join(clauses)}."


def _unit(velocity: str) -> tuple[float, str]:
    """Return the factor from SI units to those of messages, and the unit."""
    scale = np.degrees(1.0) if velocity in "pqr" else 1.0
    return scale, velocity_unit(velocity).replace("rad", "deg")


def _exceed(velocity: str, known: float, largest: float) -> str:
    scale, unit = _unit(velocity)
    return f"{velocity} reaches {scale * largest:.2g} {unit}, {scale * known:.2g} in the log"


def manoeuvre_table(result: ShipManoeuvres) -> Table:
    """Return a row for each number: band, share of the draws that have it, and limit."""
    rows = (
        (
            *(each.manoeuvre, each.side, each.name, coefficient(each.value)),
            " to ".join(f"{end:.3g}" for end in each.band) if each.band else NOTHING,
            NOTHING if each.completed_share is None else f"{100.0 * each.completed_share:.0f} %",
            *(coefficient(each.limit), each.unit),
        )
        for each in result.characteristics
    )
    header = ("manoeuvre", "side", "number", "value", "95 % band", "of draws", "IMO limit", "unit")
    notes = tuple(describe_conditions(result))
    return Table.of_words("Manoeuvres", header, "lllrrrrl", rows, notes)


def manoeuvre_document(result: ShipManoeuvres) -> dict[str, Any]:
    """Return all numbers for JSON."""
    keys = ("manoeuvre", "side", "name", "unit", "value", "band", "completed_share", "limit")
    return {
        "verdict": describe_verdict(result),
        "reservations": list(result.reservations),
        "meets_limits": bool(result.is_met[:, 0].all()),
        "probability": result.probability,
        "speed": result.ship.speed,
        "length": result.ship.length,
        "notes": [*describe_conditions(result)],
        "numbers": [{key: getattr(each, key) for key in keys} for each in result.characteristics],
    }


def write_manoeuvres(result: ShipManoeuvres, folder: Path) -> list[str]:
    """Write JSON and pictures into a folder; return messages on what is missing."""
    draw = {name: partial(manoeuvre_figure, result, name) for name in result.trajectories}
    draw["spiral"] = partial(spiral_figure, result)
    sketches = [(name.replace(" ", "-").replace("/", "-"), "", draw[name]) for name in draw]
    pictures, missing = draw_pictures(sketches, {})
    contents = {folder / f"{each.name}.svg": each.svg for each in pictures}
    contents[folder / "manoeuvres.json"] = as_json(manoeuvre_document(result)).encode("utf-8")
    save_results(contents, folder, RESULTS)
    return missing
