"""Roles and units that only magnitudes decide: accelerations, coordinates, speeds, turn rates."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.channels import SPECIFIC_FORCE, UNITS, unit_factor
from hydrodamp.data.recording import Recording
from hydrodamp.ingest.inspection.columns import Series, synchronise
from hydrodamp.ingest.inspection.frames import RateMatch, RoleSeries, match_rates
from hydrodamp.ingest.inspection.guess import Guess
from hydrodamp.ingest.inspection.names import words
from hydrodamp.ingest.mapping.channel_schema import GEOGRAPHIC
from hydrodamp.ingest.mapping.geodesy import tangent_plane, unfold_minutes

_GRAVITY = UNITS["acceleration"]["g"]
_MAX_GRAVITY_RATIO = 1.4  # of the median norm of a specific force to gravity, or its inverse
_SCALE_TOLERANCE = 0.15  # relative error of a speed against the path
_MIN_PLATEAU = 0.98  # ratio of path lengths of two chords from which noise adds nothing
_MAX_TURN_RAD = 6.5  # rad; larger courses are in degrees
_HEMISPHERES = (("latitude", {"N", "S"}, "S"), ("longitude", {"E", "W"}, "W"))
_HORIZONTAL = (("position.north", "position.east"), ("position.x", "position.y"))
_COORDINATES = tuple(f"position.{name}" for name in GEOGRAPHIC)
_UNCONFIRMED = 55  # % of confidence, if neither file nor motion states a unit
_SURGES = ("velocity.u", "velocity.x", "velocity.north")
#: Words of names whose unit is not SI by convention, and that unit.
_UNITS_BY_CONVENTION = {"sog": "kn", "stw": "kn", "rot": "deg/min", "turn": "deg/min"}

SeriesByColumn = Mapping[str, Series]


def check_specific_forces(
    guesses: Sequence[Guess], series: SeriesByColumn
) -> tuple[list[Guess], dict[str, str]]:
    """Return guesses with the units of specific forces, and the columns that are none."""
    by_axis = [
        [guess for guess in guesses if guess.role == f"specific_force.{axis}"]
        for axis in SPECIFIC_FORCE.columns
    ]
    units: dict[str, str | None] = {}
    rejected: dict[str, str] = {}
    for axes in zip(*by_axis, strict=False):
        columns = [series[guess.column] for guess in axes]
        unit, norm = _unit_of_gravity(columns)
        for item in columns:
            units[item.column] = unit
            if unit is None:
                rejected[item.column] = (
                    f"no specific force: its norm is {norm:.3g} {item.unit or ''}".rstrip()
                    + f", which is far from 1 g in {item.unit or 'every unit'}; an accelerometer"
                    " measures gravity"
                )
    accepted = (guess for guess in guesses if guess.column not in rejected)
    return [
        _with_unit(guess, units[guess.column], "by the norm") if guess.column in units else guess
        for guess in accepted
    ], rejected


def _unit_of_gravity(columns: Sequence[Series]) -> tuple[str | None, float]:
    """Return the unit in which the median norm is near gravity, or None; and the median norm."""
    stated = columns[0].unit
    if len({len(item.values) for item in columns}) > 1:
        return stated or "m/s^2", _GRAVITY  # of several clocks: not tested
    norms = np.linalg.norm([item.values for item in columns], axis=0)
    if not np.isfinite(norms).any():
        return stated or "m/s^2", _GRAVITY
    norm = float(np.nanmedian(norms))
    known = {unit: norm * factor / _GRAVITY for unit, factor in UNITS["acceleration"].items()}
    limit = np.log(_MAX_GRAVITY_RATIO)
    near = [unit for unit, ratio in known.items() if ratio and abs(np.log(ratio)) < limit]
    return next((unit for unit in near if stated in (None, unit)), None), norm


def _with_unit(guess: Guess, unit: str | None, reason: str) -> Guess:
    """Return a guess with a unit that neither file nor name states."""
    if guess.unit is not None or unit is None:
        return guess
    return replace(guess, unit=unit, evidence=(*guess.evidence, f"{unit} {reason}"))


def read_coordinates(
    guesses: Sequence[Guess], series: SeriesByColumn, recording: Recording
) -> tuple[list[Guess], dict[str, str]]:
    """Return guesses with the units and hemispheres of coordinates, and the reasons of others."""
    rejected: dict[str, str] = {}
    signs: dict[str, int] = {}
    units: dict[str, str] = {}
    latitudes, longitudes = (
        [guess for guess in guesses if guess.role == role] for role in _COORDINATES
    )
    for pair in zip(latitudes, longitudes, strict=False):
        unit = pair[0].unit or _unit_of_coordinates([series[guess.column].values for guess in pair])
        for guess, (_, letters, negative) in zip(pair, _HEMISPHERES, strict=True):
            hemisphere = _hemispheres(recording, guess.topic, letters)
            if unit is None:
                rejected[guess.column] = "no latitude and longitude by their magnitude"
            elif len(hemisphere) > 1:
                rejected[guess.column] = "in two hemispheres; write signed degrees to the file"
            else:
                units[guess.column] = unit
                signs[guess.column] = -1 if negative in hemisphere else 1
    return [
        replace(_with_unit(guess, units[guess.column], "by magnitude"), sign=signs[guess.column])
        if guess.column in units
        else guess
        for guess in guesses
        if guess.column not in rejected
    ], rejected


def _unit_of_coordinates(values: Sequence[FloatArray]) -> str | None:
    """Return the unit of latitude and longitude."""
    latitude, longitude = (float(np.nanmax(np.abs(item))) for item in values)
    if latitude <= np.pi / 2 and longitude <= np.pi:
        return "rad"
    if latitude <= 90.0 and longitude <= 360.0:
        return "deg"
    minutes = max(float(np.nanmax(np.abs(item) % 100.0)) for item in values)
    if latitude <= 9000.0 and longitude <= 18000.0:
        return "ddmm" if minutes < 60.0 else None
    return "degE7" if latitude <= 90e7 and longitude <= 180e7 else None


def _hemispheres(recording: Recording, topic: str, letters: set[str]) -> set[str]:
    """Return the letters of the hemisphere that the text columns of a topic hold."""
    cells = (
        {text.strip().upper() for text in column} - {""} for column in _texts(recording, topic)
    )
    return next((column for column in cells if column and column <= letters), set())


def _texts(recording: Recording, topic: str) -> Iterator[Sequence[str]]:
    yield from recording.topic(topic).texts.values()


def read_speeds(guesses: Sequence[Guess], series: SeriesByColumn) -> list[Guess]:
    """Return guesses with the units of course, speed and turn rate.

    A column named as a sway is the speed along the path where no surge is recorded, if it is never
    negative and of the length of the path. A speed that is negative is a surge.
    """
    best = {guess.role: guess for guess in guesses if guess.is_best}
    has_surge = not best.keys().isdisjoint(_SURGES)
    read = []
    for guess in guesses:
        values = series[guess.column].values
        is_signed = bool(np.nanmin(values) < 0.0)
        if guess.role == "velocity.course":
            is_large = float(np.nanmax(np.abs(values))) > _MAX_TURN_RAD
            guess = _with_unit(guess, "deg" if is_large else "rad", "by magnitude")
        elif guess.role == "velocity.r":
            guess = _unit_by_convention(guess)
        elif guess is best.get("velocity.speed"):
            if is_signed and not has_surge:
                guess = _add_evidence(guess, "negative at times: along the vehicle", "velocity.u")
            guess = _scale_speed(guess, best, series)
        elif guess is best.get("velocity.v") and not (is_signed or has_surge):
            guess = _as_speed(guess, best, series)
        read.append(guess)
    return read


def _as_speed(guess: Guess, best: Mapping[str, Guess], series: SeriesByColumn) -> Guess:
    """Return a sway as the speed along the path, unless the position contradicts."""
    speed = _add_evidence(guess, "never negative: the speed along the path", "velocity.speed")
    scaled = _scale_speed(speed, best, series)
    is_contradicted = horizontal_roles(best) and scaled.confidence < guess.confidence
    return guess if is_contradicted else scaled


def _add_evidence(guess: Guess, message: str, role: str) -> Guess:
    return replace(guess, role=role, evidence=(*guess.evidence, message))


def _scale_speed(guess: Guess, best: Mapping[str, Guess], series: SeriesByColumn) -> Guess:
    """Return a speed with the unit in which its integral is the length of the path.

    A speed without a course and a position is u only if the vehicle keeps to its heading.
    """
    names = horizontal_roles(best)
    if not names and guess.role == "velocity.speed" and "velocity.course" not in best:
        guess = _add_evidence(guess, "u, unless it drifts or moves astern", guess.role)
        guess = replace(guess, confidence=_UNCONFIRMED)
    if guess.unit is not None:
        return guess
    if not names:
        return _unit_by_convention(guess)
    units = [best[name].unit for name in names]
    items = [series[guess.column], *(series[best[name].column] for name in names)]
    elapsed, columns = synchronise(items)
    is_complete = np.isfinite(columns).all(axis=1)
    speed = float(np.abs(columns[is_complete, 0]).mean()) if is_complete.sum() > 1 else 0.0
    if speed == 0.0:
        return _unit_by_convention(guess)
    ratio = _mean_speed(elapsed, to_metres(columns[:, 1:], names, units)) / speed
    for unit, factor in UNITS["speed"].items():
        if abs(ratio / factor - 1.0) < _SCALE_TOLERANCE:
            return _with_unit(guess, unit, "by the length of the path")
    evidence = (*guess.evidence, f"the path is {ratio:.2g} times its integral")
    return replace(_unit_by_convention(guess), confidence=_UNCONFIRMED, evidence=evidence)


def horizontal_roles(best: Collection[str]) -> tuple[str, ...]:
    """Return the roles of the horizontal position, if there is any."""
    return next((pair for pair in (*_HORIZONTAL, _COORDINATES) if {*pair} <= {*best}), ())


def _unit_by_convention(guess: Guess) -> Guess:
    """Return a guess with the unit that its name has by convention, which nothing confirms."""
    known = (_UNITS_BY_CONVENTION.get(word) for word in words(guess.column))
    unit = next(filter(None, known), None)
    if unit is None or guess.unit is not None:
        return guess
    return replace(_with_unit(guess, unit, "by convention"), confidence=_UNCONFIRMED)


def to_metres(columns: FloatArray, roles: Sequence[str], units: Sequence[str | None]) -> FloatArray:
    """Return a horizontal position [m] from its columns."""
    factors = [unit_factor(unit) if unit else 1.0 for unit in units]
    if roles[0] not in _COORDINATES:
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


def match_turn_rate(roles: RoleSeries) -> RateMatch:
    """Compare rates with the attitude, a turn rate per minute converted to radians per second."""
    turn = roles.get("velocity.r")
    if turn is None or turn.unit != "deg/min":
        return match_rates(roles)
    values = turn.values * unit_factor("deg/min")
    planar = {
        role: item for role, item in roles.items() if role not in ("velocity.p", "velocity.q")
    }
    match = match_rates({**planar, "velocity.r": replace(turn, values=values)})
    return replace(match, unit="deg/min") if match.unit == "rad/s" else match_rates(roles)


def reclassify_normalised_wrench(guesses: list[Guess], series: SeriesByColumn) -> list[Guess]:
    """Reclassify as commands a wrench no component of which exceeds one."""
    wrench = [guess for guess in guesses if guess.role.startswith("wrench.")]
    large = {
        guess.topic
        for guess in wrench
        if guess.unit is not None or float(np.nanmax(np.abs(series[guess.column].values))) > 1.0
    }
    normalised = [guess for guess in wrench if guess.topic not in large]
    evidence = "at most one: normalised, not newtons"
    return [
        _add_evidence(guess, evidence, "commands") if guess in normalised else guess
        for guess in guesses
    ]


def quaternion_order(column: str, series: SeriesByColumn) -> str:
    """Return the order of a quaternion: tilts are small, so x and y are small."""
    elements = [series.get(re.sub(r"\d(?=]?$)", index, column)) for index in "02"]
    first, third = (0.0 if item is None else np.nanmean(item.values**2) for item in elements)
    return "xyzw" if first < third else "wxyz"
