"""Roles of columns, from evidence of names, units, magnitudes and motion."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.conditioning.vertical_axis import VerticalAxis
from hydrodamp.data.recording import Recording
from hydrodamp.ingest.formats.files import conventional_axes
from hydrodamp.ingest.inspection.clock_units import confirm_clocks, with_clock
from hydrodamp.ingest.inspection.columns import (
    Series,
    TopicClock,
    clock_at_rate,
    find_clocks,
    topic_series,
)
from hydrodamp.ingest.inspection.coordinates import (
    find_speed,
    mask_coordinates,
    read_coordinates,
)
from hydrodamp.ingest.inspection.equivalent_commands import rank_actuation
from hydrodamp.ingest.inspection.frames import (
    MAX_ANGLE_RAD,
    RateMatch,
    VelocityMatch,
    find_vertical_axis,
    infer_units,
    match_velocity,
)
from hydrodamp.ingest.inspection.guess import Guess
from hydrodamp.ingest.inspection.magnitudes import (
    check_specific_forces,
    match_turn_rate,
    quaternion_order,
    read_speeds,
    reclassify_normalised_wrench,
)
from hydrodamp.ingest.inspection.names import NO_ROLE, guess_role, quantity_of_role, words
from hydrodamp.ingest.inspection.yaw_convention import YawMatch, match_yaw
from hydrodamp.ingest.mapping.channel_schema import WORLD_DIRECTIONS

_PULSE_RANGE_US = (800.0, 2200.0)  # us, of a servo
_SERVO_WORDS = {*["pwm", "servo", "rc", "rcou", "rcout", "ch", "channel", "channels", "esc"]}
_SHARED_ROLES = ("commands", "flag")  # of several columns each
_UNIT_FROM_SIZE_CONFIDENCE = 68  # %, if only the magnitude indicates the unit
_IDLE_VALUES = (0.0, 1500.0, 65535.0)  # of a servo that is absent or unused
_GYRO_RESOLUTION = 1e-5  # rad/s or deg/s; less than the noise of any gyro
_ROS_VECTOR = re.compile(r"[./]z$")
_ROS_FIELD = re.compile(r"\b(pose|twist)[./](pose|twist|position|linear)\b|angular_velocity[./]x")

_SPEEDS, _RATES, _EARTH_FIXED = (
    tuple(f"velocity.{name}" for name in names) for names in ("uvw", "pqr", "xyz")
)
_PLACES = tuple(f"position.{name}" for name in "xyz")
_DIRECTIONS = tuple(f"velocity.{name}" for name in WORLD_DIRECTIONS)
#: Range up to which a column is constant; that of other roles may be.
_CONSTANT_RANGE = dict.fromkeys(("commands", "flag", *_SPEEDS, *_EARTH_FIXED, *_DIRECTIONS), 0.0)
_CONSTANT_RANGE |= dict.fromkeys(("position.latitude", "position.longitude", "position.up"), 0.0)
_CONSTANT_RANGE |= dict.fromkeys(("velocity.speed", "velocity.course"), 0.0)
_CONSTANT_RANGE |= dict.fromkeys(_RATES, _GYRO_RESOLUTION)
_AXES_OF = {
    "NED": (("north", 1), ("east", 1), ("down", 1)),
    "NWU": (("north", 1), ("east", -1), ("up", 1)),
    "ENU": (("east", 1), ("north", 1), ("up", 1)),
}


@dataclass(frozen=True, eq=False)
class Roles:
    """All guesses about a recording."""

    guesses: tuple[Guess, ...]
    clocks: Mapping[str, TopicClock]
    flags: Mapping[str, str]  # by topic, the field that marks valid rows
    rates: RateMatch
    velocity: VelocityMatch
    vertical_axis: VerticalAxis
    world: str
    without_role: Mapping[str, str]  # by column without a role, the reason

    def best(self, role: str) -> Guess | None:
        """Return the best guess for a role."""
        return next((guess for guess in self.guesses if guess.role == role and guess.is_best), None)

    def all_of(self, role: str) -> tuple[Guess, ...]:
        """Return every best guess of a role, such as all commands."""
        return tuple(guess for guess in self.guesses if guess.role == role and guess.is_best)


def guess_roles(recording: Recording, others: Sequence[Recording] = ()) -> Roles:
    """Guess the role of every column; a constant column may vary in other recordings."""
    clocks = find_clocks(recording)
    # Without a clock, names still give roles.
    rows = {topic.name: clock_at_rate(topic, 1.0) for topic in recording.topics if topic.n}
    series = {
        item.column: item
        for topic in recording.topics
        if (clock := (clocks or rows).get(topic.name))
        for item in topic_series(topic, clock)
    }
    named, without_role = _guess_from_names(recording, series, others)
    flags = _flag_fields(series, named)
    lengths = {column: len(item.seconds) for column, item in series.items()}
    series = {column: item.decimate() for column, item in series.items()}
    named, no_forces = check_specific_forces(named, series)
    series |= mask_coordinates(named, series)
    speed = find_speed(named, series) if clocks else ()
    named, no_coordinates = read_coordinates(named, series, recording, speed)
    without_role |= no_forces | no_coordinates
    guesses = _mark_best(named, lengths)
    guesses = read_speeds(guesses, series) if clocks else guesses
    best = {
        guess.role: replace(item, unit=guess.unit, values=guess.sign * item.values)
        for guess in guesses
        if guess.is_best and (item := series[guess.column])
    }
    role_series = infer_units(best)
    if clocks and match_turn_rate(role_series).unit is None:
        clocks, role_series = confirm_clocks(clocks, role_series)
        series = {key: with_clock(item, clocks) for key, item in series.items()}
    format_name = _message_format(recording, [guess.column for guess in guesses])
    upright = find_vertical_axis(format_name, role_series)
    is_matched = clocks and not (upright.body == "FLU" and "attitude.heading" in role_series)
    yaw = match_yaw(role_series) if is_matched else YawMatch()
    role_series = {**yaw.correct(role_series)}
    rates = match_turn_rate(role_series) if clocks else RateMatch()
    velocity = match_velocity(role_series) if clocks else VelocityMatch()
    units = {item.column: item.unit for item in role_series.values()}
    is_enu = conventional_axes(format_name).endswith("ENU")
    world = "NED" if upright.body == "FRD" else "ENU" if is_enu else "NWU"
    all_guesses = list(_clock_guesses(clocks))
    for guess in guesses:
        guess = replace(guess, unit=units.get(guess.column, guess.unit))
        if yaw.exchanges and guess.role in _PLACES[:2]:
            role = _PLACES[1 - _PLACES.index(guess.role)]
            guess = replace(guess.with_evidence(yaw.evidence), role=role)
        elif guess.is_best and guess.role == yaw.role and not yaw.exchanges:
            offset = yaw.sign * yaw.zero_in(guess.unit)
            guess = replace(guess.with_evidence(yaw.evidence), sign=yaw.sign, offset=offset)
        guess = _add_motion_evidence(guess, series[guess.column], rates, velocity)
        all_guesses.append(_name_world_axes(guess, world, velocity))
    return Roles(tuple(all_guesses), clocks, flags, rates, velocity, upright, world, without_role)


def _message_format(recording: Recording, columns: Sequence[str]) -> str:
    """Return the format whose axes count: for tables of ROS messages with this remark.

    Axes by REP 103 are those of messages of vectors; other numbers in a bag have no convention.
    """
    names = (name for topic in recording.topics for name in topic.fields)
    if "ROS" not in recording.format and any(map(_ROS_FIELD.search, names)):
        return f"{recording.format} of ROS messages"
    has_vectors = any(map(_ROS_VECTOR.search, columns))
    return recording.format if has_vectors or "ROS" not in recording.format else ""


def _name_world_axes(guess: Guess, world: str, velocity: VelocityMatch) -> Guess:
    """Name the world axes of a position or an earth-fixed velocity."""
    group, _, channel = guess.role.partition(".")
    if guess.role in _SPEEDS and velocity.earth_fixed:
        guess = guess.with_evidence("earth-fixed, by its correlation with the position")
    elif guess.role in _EARTH_FIXED:
        if velocity.earth_fixed is False:
            return replace(guess, role=_SPEEDS[_EARTH_FIXED.index(guess.role)])
        guess = guess.with_evidence("earth-fixed by its name")
    elif guess.role not in _PLACES:
        return guess
    name, sign = _AXES_OF[world]["uvwxyz".index(channel) % 3]
    return replace(guess, role=f"{group}.{name}", sign=sign)


def _flag_fields(series: Mapping[str, Series], guesses: Iterable[Guess]) -> dict[str, str]:
    """Return the fields of zeros and ones that mark valid rows."""
    flags = [series[guess.column] for guess in guesses if guess.role == "flag"]
    return {flag.topic: flag.field for flag in flags if set(flag.values.tolist()) == {0.0, 1.0}}


def _clock_guesses(clocks: Mapping[str, TopicClock]) -> Iterator[Guess]:
    for topic, clock in clocks.items():
        if clock.column is not None:
            column, evidence = f"{topic}.{clock.column}".lstrip("."), (clock.evidence,)
            yield Guess(column, "time", clock.confidence, clock.unit, 1, evidence, topic=topic)


def _guess_from_names(
    recording: Recording, series: Mapping[str, Series], others: Sequence[Recording]
) -> tuple[list[Guess], dict[str, str]]:
    """Return guesses from names, and reasons for columns without a role."""
    values_by_column: dict[str, list[FloatArray]] = {}
    for topic in (topic for item in others for topic in item.topics):
        for item in topic_series(topic, None):
            values_by_column.setdefault(item.column, []).append(item.values)
    guesses: list[Guess] = []
    without_role: dict[str, str] = {}
    for column, item in series.items():
        topic = recording.topic(item.topic)
        unit_text = topic.units.get(item.field, "")
        role, confidence = guess_role(topic.name, item.field, item.unit, topic.fields, unit_text)
        if standard := topic.standard_names.get(item.field):
            hint = guess_role("", standard, item.unit, (), unit_text)
            is_excluded = not hint[1] and hint[0] != NO_ROLE
            role, confidence = hint if is_excluded or not confidence else (role, confidence)
        values = np.concatenate([item.values, *values_by_column.get(column, ())])
        low, high = float(np.nanmin(values)), float(np.nanmax(values))
        is_pulse = (
            item.unit in (None, "us") and _PULSE_RANGE_US[0] <= low and high <= _PULSE_RANGE_US[1]
        )
        if is_stick := is_pulse and low < high and role in MAX_ANGLE_RAD:
            role, confidence = "commands", 60
        if confidence == 0:
            without_role[column] = role
            continue
        is_constant = high - low <= _CONSTANT_RANGE.get(role, -1.0)
        is_servo = bool({*words(column)} & _SERVO_WORDS)
        is_idle = role != "commands" or (low in _IDLE_VALUES and (low or is_servo))
        if is_constant and is_idle:
            without_role[column] = f"never changes from {low:.3g}"
            continue
        evidence = ["name and unit" if item.unit and quantity_of_role(role) else "name"]
        if role.startswith("attitude.q["):  # an element of an array
            order = quaternion_order(column, series)
            role = f"attitude.q{order[int(role[-2])]}"
            evidence.append(f"{order[0]} first, by magnitude")
        if is_constant:
            evidence.append("constant in this run")
        if is_pulse := is_pulse and role == "commands" and (is_stick or is_servo):
            evidence.append("a pulse width: -1 at 1100, 1 at 1900 us")
        guesses.append(
            Guess(column, role, confidence, item.unit, 1, (*evidence,), True, topic.name, is_pulse)
        )
    return reclassify_normalised_wrench(guesses, series), without_role


def _mark_best(guesses: list[Guess], lengths: Mapping[str, int]) -> list[Guess]:
    """Mark the best guess of each role; a wrench that acts, else that of the fastest topic."""

    def merit(guess: Guess) -> tuple[float, int, int, bool]:
        is_wrench = guess.role.startswith("wrench.")
        acts = rank_actuation(guess.column) if is_wrench else 0.0
        is_heading = guess.role == "attitude.heading"  # a yaw may have another sign
        return acts, guess.confidence, lengths[guess.column], is_heading

    best: dict[str, Guess] = {}
    for guess in sorted(guesses, key=merit, reverse=True):
        best.setdefault(_competing_role(guess), guess)
    return [
        replace(guess, is_best=guess.role in _SHARED_ROLES or best[_competing_role(guess)] is guess)
        for guess in guesses
    ]


def _competing_role(guess: Guess) -> str:
    """Return the role that a guess competes for: yaw and heading are the same angle."""
    return "attitude.yaw" if guess.role == "attitude.heading" else guess.role


def _add_motion_evidence(
    guess: Guess, series: Series, rates: RateMatch, velocity: VelocityMatch
) -> Guess:
    """Return a guess with the evidence of its magnitude and motion."""
    group, _, channel = guess.role.partition(".")
    if not guess.is_best:
        return guess
    if guess.role in MAX_ANGLE_RAD and not series.unit:
        guess = guess.with_evidence(f"{guess.unit} by its magnitude")
    if group == "attitude" and rates.unit:
        guess = guess.with_evidence("consistent with the rates")
        return _raise_confidence(guess, min(dict(rates.axes).values()))
    if group == "attitude" and not series.unit and guess.unit == "rad":
        return replace(guess, confidence=min(guess.confidence, _UNIT_FROM_SIZE_CONFIDENCE))
    if guess.role in _RATES and rates.unit:
        correlation = dict(rates.axes).get(channel, 0.0)
        comparison = f"consistent with the attitude ({correlation:.2f})"
        message = f"{comparison if correlation else 'as the other rates'}, in {rates.unit}"
        return _raise_confidence(
            replace(guess.with_evidence(message), unit=rates.unit), correlation
        )
    is_assumed = guess.confidence > _UNIT_FROM_SIZE_CONFIDENCE
    if guess.role in _RATES and series.unit is None and is_assumed:
        guess = guess.with_evidence(f"{guess.unit} by the magnitude of its array")
        return replace(guess, confidence=_UNIT_FROM_SIZE_CONFIDENCE)
    if velocity.regression.is_consistent() and guess.role in (*_SPEEDS, *_EARTH_FIXED, *_PLACES):
        correlation = velocity.regression.correlation
        message = f"consistent velocity and position ({correlation:.2f})"
        return _raise_confidence(guess.with_evidence(message), correlation)
    return guess


def _raise_confidence(guess: Guess, correlation: float) -> Guess:
    error = (1 - guess.confidence / 100) * (1 - correlation)
    return replace(guess, confidence=min(99, round(100 * (1 - error))))
