"""Roles and units that only magnitudes decide: accelerations, courses, speeds, turn rates."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from hydrodamp.data.channels import SPECIFIC_FORCE, UNITS, unit_factor
from hydrodamp.ingest.inspection.columns import Series, synchronise
from hydrodamp.ingest.inspection.coordinates import (
    SCALE_TOLERANCE,
    SeriesByColumn,
    compare_path,
    horizontal_roles,
    match_speed,
    to_metres,
)
from hydrodamp.ingest.inspection.frames import (
    MAX_ANGLE_RAD,
    RateMatch,
    RoleSeries,
    infer_units,
    match_rates,
)
from hydrodamp.ingest.inspection.guess import UNCONFIRMED, Guess
from hydrodamp.ingest.inspection.names import words

_GRAVITY = UNITS["acceleration"]["g"]
_MAX_GRAVITY_RATIO = 1.4  # of the median norm of a specific force to gravity, or its inverse
_MAX_TURN_RAD = 6.5  # rad; larger courses are in degrees
_MIN_COSINE = 0.5  # mean, of a course against a heading
_UNNAMED_PLANE = ("position.x", "position.y")
_HEADINGS = ("attitude.yaw", "attitude.heading")
_SURGES = ("velocity.u", "velocity.x", "velocity.north")
#: Words of names whose unit is not SI by convention, and that unit.
_UNITS_BY_CONVENTION = {"sog": "kn", "stw": "kn", "rot": "deg/min", "turn": "deg/min"}


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
        guess.with_unit(units[guess.column], "by the norm") if guess.column in units else guess
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
            guess = _read_course(guess, best, series)
        elif guess.role == "velocity.r":
            guess = _unit_by_convention(guess)
        elif guess is best.get("velocity.speed"):
            if is_signed and not has_surge:
                guess = replace(
                    guess.with_evidence("negative at times: along the vehicle"), role="velocity.u"
                )
            guess = _scale_speed(guess, best, series)
        elif guess is best.get("velocity.v") and not (is_signed or has_surge):
            guess = _as_speed(guess, best, series)
        read.append(guess)
    return read


def _read_course(guess: Guess, best: Mapping[str, Guess], series: SeriesByColumn) -> Guess:
    """Return a course with its unit, by the direction of the path or the heading if it is small."""
    course = series[guess.column]
    if guess.unit is not None or float(np.nanmax(np.abs(course.values))) > _MAX_TURN_RAD:
        return guess.with_unit("deg", "by magnitude")
    names = horizontal_roles({*best} - {*_UNNAMED_PLANE})
    angles = infer_units(_series_of(MAX_ANGLE_RAD, best, series))
    headings = [angles[role] for role in _HEADINGS if role in angles]
    references = [*_series_of(names, best, series).values()] or headings[:1]
    _, columns = synchronise([course, *references])
    units = [item.unit for item in references]
    if not references or not np.isfinite(columns).all(axis=1).any():
        return guess.with_unconfirmed_unit("deg", "by magnitude, unless it is rad")
    if names:
        directions = np.diff(to_metres(columns[:, 1:], names, units), axis=0) @ (1.0, 1.0j)
        options, limit = [directions], 0.0
    else:
        directions = np.exp(1j * unit_factor(units[0] or "rad") * columns[1:, 1])
        # a yaw may count from east, counterclockwise
        options = [directions, 1j * np.conj(directions)]
        limit = _MIN_COSINE * np.isfinite(directions * columns[1:, 0]).sum()
    along = {}
    for unit in ("deg", "rad"):
        turned = np.exp(-1j * unit_factor(unit) * columns[1:, 0])
        along[unit] = max(float(np.nansum(option * turned).real) for option in options)
    unit = max(along, key=along.__getitem__)
    if along[unit] > limit:
        return guess.with_unit(unit, f"by the direction of the {'path' if names else 'heading'}")
    return guess.with_unconfirmed_unit("deg", "by magnitude, unless it is rad")


def _as_speed(guess: Guess, best: Mapping[str, Guess], series: SeriesByColumn) -> Guess:
    """Return a sway as the speed along the path, unless the position contradicts."""
    speed = replace(
        guess.with_evidence("never negative: the speed along the path"), role="velocity.speed"
    )
    scaled = _scale_speed(speed, best, series)
    is_contradicted = horizontal_roles(best) and scaled.confidence < guess.confidence
    return guess if is_contradicted else scaled


def _scale_speed(guess: Guess, best: Mapping[str, Guess], series: SeriesByColumn) -> Guess:
    """Return a speed with the unit in which its integral is the length of the path.

    A speed without a course and a position is u only if the vehicle keeps to its heading.
    """
    names = horizontal_roles(best)
    if not names and guess.role == "velocity.speed" and "velocity.course" not in best:
        guess = guess.with_evidence("u, unless it drifts or moves astern")
        guess = replace(guess, confidence=UNCONFIRMED)
    if guess.unit is not None:
        return guess
    if not names:
        return _unit_by_convention(guess)
    speed = series[guess.column]
    if (ratio := compare_path([speed], _series_of(names, best, series))) is None:
        return _unit_by_convention(guess)
    error, unit = match_speed(ratio)
    if error < SCALE_TOLERANCE:
        return guess.with_unit(unit, "by the length of the path")
    unknown = guess.with_evidence(f"the path is {ratio:.2g} times its integral")
    return replace(_unit_by_convention(unknown), confidence=UNCONFIRMED)


def _series_of(
    roles: Iterable[str], best: Mapping[str, Guess], series: SeriesByColumn
) -> dict[str, Series]:
    """Return the series of roles with their units and signs."""
    return {
        role: replace(item, unit=guess.unit, values=guess.sign * item.values)
        for role in roles
        if (guess := best.get(role)) and (item := series[guess.column])
    }


def _unit_by_convention(guess: Guess) -> Guess:
    """Return a guess with the unit that its name has by convention, which nothing confirms."""
    known = (_UNITS_BY_CONVENTION.get(word) for word in words(guess.column))
    unit = next(filter(None, known), None)
    if unit is None or guess.unit is not None:
        return guess
    return guess.with_unconfirmed_unit(unit, "by convention")


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
        replace(guess.with_evidence(evidence), role="commands") if guess in normalised else guess
        for guess in guesses
    ]


def quaternion_order(column: str, series: SeriesByColumn) -> str:
    """Return the order of a quaternion: tilts are small, so x and y are small."""
    elements = [series.get(re.sub(r"\d(?=]?$)", index, column)) for index in "02"]
    first, third = (0.0 if item is None else np.nanmean(item.values**2) for item in elements)
    return "xyzw" if first < third else "wxyz"
