"""Position along the horizontal: units and hemispheres of coordinates, and the path in metres."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.channels import UNITS, unit_factor
from hydrodamp.data.recording import Recording
from hydrodamp.ingest.formats.cells import COORDINATE_NAMES
from hydrodamp.ingest.inspection.columns import Series, synchronise
from hydrodamp.ingest.inspection.guess import Guess
from hydrodamp.ingest.inspection.names import words
from hydrodamp.ingest.mapping.channel_schema import COORDINATES
from hydrodamp.ingest.mapping.geodesy import mask_missing_fixes, tangent_plane, unfold_minutes

#: Roles of a horizontal position with named axes.
NORTH_EAST = ("position.north", "position.east")

#: Relative error of a speed against the path.
SCALE_TOLERANCE = 0.15

_PLANES = (NORTH_EAST, ("position.x", "position.y"), COORDINATES)
_MIN_PLATEAU = 0.98  # ratio of path lengths of two chords from which noise adds nothing
# Of latitude and of longitude: letters of hemispheres, and the words of their columns.
_HEMISPHERES = (
    ({"N", "S"}, re.compile(r"\b(n ?s|north ?south|hemi\w*)\b")),
    ({"E", "W"}, re.compile(r"\b(e ?w|east ?west|hemi\w*)\b")),
)
# Roles of a speed along the path, or of its components, in order of preference.
_SPEEDS = tuple(
    tuple(f"velocity.{name}" for name in names)
    for names in (("u", "v"), ("north", "east"), ("x", "y"), ("speed",), ("v",))
)

SeriesByColumn = Mapping[str, Series]


def _pair_coordinates(guesses: Sequence[Guess]) -> Iterator[tuple[Guess, Guess]]:
    latitudes, longitudes = (
        [guess for guess in guesses if guess.role == role] for role in COORDINATES
    )
    yield from zip(latitudes, longitudes, strict=False)


def mask_coordinates(guesses: Sequence[Guess], series: SeriesByColumn) -> dict[str, Series]:
    """Return the series of coordinates, without those of a receiver without a fix."""
    masked = {}
    for pair in _pair_coordinates(guesses):
        items = [series[guess.column] for guess in pair]
        for item, partner in zip(items, items[::-1], strict=True):
            values = mask_missing_fixes(item.values, item.seconds, partner.values, partner.seconds)
            masked[item.column] = replace(item, values=values)
    return masked


def find_speed(guesses: Sequence[Guess], series: SeriesByColumn) -> list[Series]:
    """Return the recorded speed along the path, or its components, if there is any."""
    by_confidence = sorted(guesses, key=lambda guess: guess.confidence)
    best = {guess.role: series[guess.column] for guess in by_confidence}
    roles = next((roles for roles in _SPEEDS if roles[0] in best), ())
    items = [best[role] for role in roles if role in best]
    # A component without a unit is in m/s, a speed over ground may be in knots.
    return [replace(it, unit=it.unit or "m/s") for it in items] if len(roles) > 1 else items


def read_coordinates(
    guesses: Sequence[Guess],
    series: SeriesByColumn,
    recording: Recording,
    speed: Sequence[Series],
) -> tuple[list[Guess], dict[str, str]]:
    """Return guesses with the units and hemispheres of coordinates, and the reasons of others."""
    rejected: dict[str, str] = {}
    accepted: dict[str, Guess] = {}
    for pair in _pair_coordinates(guesses):
        items = [series[guess.column] for guess in pair]
        units = [pair[0].unit] if pair[0].unit else _possible_units([it.values for it in items])
        is_by_path, unit = _choose_unit(units, items, speed)
        for index, (guess, item) in enumerate(zip(pair, items, strict=True)):
            hemispheres = _hemispheres(recording, item, index)
            if unit is None:
                rejected[guess.column] = "no latitude and longitude by their magnitude"
                continue
            if len(hemispheres) > 1:
                rejected[guess.column] = "in two hemispheres; write signed degrees to the file"
                continue
            alternatives = [name for name in units if name != unit]
            if is_by_path or not alternatives:
                reason = "by the length of the path" if is_by_path else "by magnitude"
                guess = guess.with_unit(unit, reason)
            else:
                reason = f"by magnitude, unless it is {' or '.join(alternatives)}"
                guess = guess.with_unconfirmed_unit(unit, reason)
            sign = 1 if hemispheres.isdisjoint({"S", "W"}) else -1
            accepted[guess.column] = replace(guess, sign=sign)
    return [
        accepted.get(guess.column, guess) for guess in guesses if guess.column not in rejected
    ], rejected


def _possible_units(values: Sequence[FloatArray]) -> list[str]:
    """Return the units that latitude and longitude may have, the usual one first."""
    latitude, longitude = (float(np.nanmax(np.abs(item))) for item in values)
    if latitude <= 90.0 and longitude <= 360.0:
        return ["deg", "rad"] if latitude <= np.pi / 2 and longitude <= np.pi else ["deg"]
    if latitude <= 9000.0 and longitude <= 18000.0:
        minutes = max(float(np.nanmax(np.abs(item) % 100.0)) for item in values)
        return ["ddmm"] if minutes < 60.0 else []
    limits = {"degE7": 1e7, "degE6": 1e6}
    return [unit for unit, n in limits.items() if latitude <= 90.0 * n and longitude <= 360.0 * n]


def _choose_unit(
    units: Sequence[str], coordinates: Sequence[Series], speed: Sequence[Series]
) -> tuple[bool, str | None]:
    """Return whether the path decides the unit of coordinates, and the unit."""
    errors = {}
    for unit in units if len(units) > 1 else ():
        path = (replace(item, unit=unit) for item in coordinates)
        if ratio := compare_path(speed, dict(zip(COORDINATES, path, strict=True))):
            is_stated = all(item.unit for item in speed)
            errors[unit] = abs(float(np.log(ratio))) if is_stated else match_speed(ratio)[0]
    nearest = min(errors, key=lambda unit: errors[unit], default=None)
    if nearest is None:
        return False, next(iter(units), None)
    return errors[nearest] < SCALE_TOLERANCE, nearest


def _hemispheres(recording: Recording, coordinate: Series, index: int) -> set[str]:
    """Return the letters of the hemispheres of a coordinate without a negative value."""
    if np.nanmin(coordinate.values) < 0.0:
        return set()
    letters, names = _HEMISPHERES[index]
    for field, cells in recording.topic(coordinate.topic).texts.items():
        if COORDINATE_NAMES[index].search(field) or names.search(" ".join(words(field))):
            recorded = {text.strip().upper() for text in cells} - {""}
            if recorded and recorded <= letters:
                return recorded
    return set()


def horizontal_roles(best: Collection[str]) -> tuple[str, ...]:
    """Return the roles of the horizontal position, if there is any."""
    return next((pair for pair in _PLANES if {*pair} <= {*best}), ())


def compare_path(speed: Sequence[Series], path: Mapping[str, Series]) -> float | None:
    """Return the length of a path per integral of a speed; None if either is unknown or zero."""
    elapsed, columns = synchronise([*speed, *path.values()])
    n_speeds, units = len(speed), [item.unit for item in path.values()]
    factors = [UNITS["speed"].get(item.unit or "", 1.0) for item in speed]
    speeds = np.linalg.norm(columns[:, :n_speeds] * factors, axis=1)
    is_complete = np.isfinite(columns).all(axis=1)
    mean_speed = float(speeds[is_complete].mean()) if is_complete.sum() > 1 else 0.0
    if mean_speed == 0.0:
        return None
    position = to_metres(columns[:, n_speeds:], [*path], units)
    return _mean_speed(elapsed, position) / mean_speed or None


def match_speed(ratio: float) -> tuple[float, str]:
    """Return the unit of a speed whose integral the path exceeds by a ratio, and its error."""
    errors = {unit: abs(float(np.log(ratio / factor))) for unit, factor in UNITS["speed"].items()}
    unit = min(errors, key=lambda unit: errors[unit])
    return errors[unit], unit


def to_metres(columns: FloatArray, roles: Sequence[str], units: Sequence[str | None]) -> FloatArray:
    """Return a horizontal position [m] from its columns."""
    factors = [unit_factor(unit) if unit else 1.0 for unit in units]
    if roles[0] not in COORDINATES:
        return columns * factors
    angles = unfold_minutes(columns) if units[0] == "ddmm" else columns
    return np.column_stack(tangent_plane(*(angles * factors).T)[:2])


def _mean_speed(elapsed: FloatArray, position: FloatArray) -> float:
    """Return the length of a path per time: chords so long that noise adds little."""
    step = float(np.median(np.diff(elapsed)))
    n_steps, speed = 1, _chord_speed(position, 1)
    while 8 * n_steps < len(position):
        longer = _chord_speed(position, 2 * n_steps)
        if longer > _MIN_PLATEAU * speed:
            break
        n_steps, speed = 2 * n_steps, longer
    return speed / step


def _chord_speed(position: FloatArray, n_steps: int) -> float:
    chords = position[n_steps:] - position[:-n_steps]
    return float(np.nanmean(np.linalg.norm(chords, axis=1))) / n_steps
