"""Guessed roles: names, units, sizes and motion weighed together."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.conditioning.vertical import VerticalAxis
from hydrodamp.data.recording import Recording
from hydrodamp.data.units import UNITS
from hydrodamp.ingest.formats.files import conventional_axes
from hydrodamp.ingest.inspection.columns import (
    Series,
    TopicClock,
    clock_at_rate,
    find_clocks,
    topic_series,
)
from hydrodamp.ingest.inspection.elements import split_index
from hydrodamp.ingest.inspection.frames import (
    RateMatch,
    VelocityMatch,
    find_vertical_axis,
    match_rates,
    match_velocity,
)
from hydrodamp.ingest.inspection.names import guess_role, quantity_of_role, words
from hydrodamp.ingest.mapping.schema import WORLD_DIRECTIONS

_PULSE_RANGE_US = (800.0, 2200.0)  # us, of a servo
_SERVO_WORDS = frozenset(
    ("pwm", "servo", "rc", "rcou", "rcout", "ch", "channel", "channels", "esc")
)
_UNIT_FROM_SIZE_CONFIDENCE = 68  # %, of a unit that nothing but its size speaks for
_MAX_RATE_RAD_S = 3.5  # rad/s, faster than nearly all craft turn
_IDLE_VALUES = (0.0, 1500.0, 65535.0)  # of a servo that is not there, or never used
_GYRO_RESOLUTION = 1e-5  # rad/s or deg/s, less than any gyro's noise
_MIN_RANGE = {"commands": 0.0, "flag": 0.0} | dict.fromkeys(
    (f"velocity.{one}" for one in "pqr"), _GYRO_RESOLUTION
)
_MIN_RANGE |= dict.fromkeys((f"velocity.{one}" for one in ("xyzuvw")), 0.0)
_MIN_RANGE |= dict.fromkeys((f"velocity.{one}" for one in WORLD_DIRECTIONS), 0.0)
_ROS_FIELD = re.compile(r"\b(pose|twist)[./](pose|twist|position|linear)\b|angular_velocity[./]x")

#: For every angle the largest that it may be in radians; one beyond is in degrees.
_MAX_ANGLE_RAD = {
    "attitude.roll": 3.3,
    "attitude.pitch": 1.65,
    "attitude.yaw": 6.5,
    "attitude.heading": 6.5,
}
_SPEEDS = tuple(f"velocity.{name}" for name in "uvw")
_RATES = tuple(f"velocity.{name}" for name in "pqr")
_EARTH_FIXED = tuple(f"velocity.{name}" for name in "xyz")
_PLACES = tuple(f"position.{name}" for name in "xyz")
_AXES_OF = {
    "NED": (("north", 1), ("east", 1), ("down", 1)),
    "NWU": (("north", 1), ("east", -1), ("up", 1)),
    "ENU": (("east", 1), ("north", 1), ("up", 1)),
}


@dataclass(frozen=True)
class Guess:
    """What a column may be."""

    column: str
    role: str
    confidence: int
    unit: str | None = None
    sign: int = 1
    evidence: tuple[str, ...] = ()
    is_best: bool = True
    topic: str = ""
    is_pulse: bool = False  # the width of one, in microseconds


@dataclass(frozen=True, eq=False)
class Roles:
    """All guesses about a recording."""

    guesses: tuple[Guess, ...]
    clocks: Mapping[str, TopicClock]
    flags: Mapping[str, str]  # for topics that mark their good rows the field that does
    rates: RateMatch
    velocity: VelocityMatch
    vertical_axis: VerticalAxis
    world: str
    without_role: Mapping[str, str]  # for columns without a role, why

    def best(self, role: str) -> Guess | None:
        """Return the best guess for a role."""
        return next((one for one in self.guesses if one.role == role and one.is_best), None)

    def all_of(self, role: str) -> tuple[Guess, ...]:
        """Return every chosen guess of a role, such as all commands."""
        return tuple(one for one in self.guesses if one.role == role and one.is_best)


def guess_roles(recording: Recording, others: Sequence[Recording] = ()) -> Roles:
    """Guess what every column of a recording is; one at rest here may move in others."""
    clocks = find_clocks(recording)
    # Where nothing counts the time, names say something all the same.
    rows = {topic.name: clock_at_rate(topic, 1.0) for topic in recording.topics if topic.n}
    series = {
        one.column: one
        for topic in recording.topics
        if topic.name in (clocks or rows)
        for one in topic_series(topic, (clocks or rows)[topic.name])
    }
    named, silent = _guess_from_names(recording, series, others)
    found = _mark_best(named, series)
    playing = _infer_units({one.role: series[one.column] for one in found if one.is_best})
    rates = match_rates(playing) if clocks else RateMatch()
    way = match_velocity(playing) if clocks else VelocityMatch()
    units = {one.column: one.unit for one in playing.values()}
    weighed = [
        _add_motion_evidence(
            replace(one, unit=units.get(one.column, one.unit)), series[one.column], rates, way
        )
        for one in found
    ]
    form = _message_format(recording)
    upright = find_vertical_axis(form, playing)
    world = _world_frame(form, upright.body)
    guesses = (*_clock_guesses(clocks), *(_name_world_axes(one, world, way) for one in weighed))
    return Roles(guesses, clocks, _flag_fields(series, found), rates, way, upright, world, silent)


def _message_format(recording: Recording) -> str:
    """Return the format of a recording, and whose messages a table of it holds."""
    names = (name for topic in recording.topics for name in topic.fields)
    if "ROS" not in recording.format and any(map(_ROS_FIELD.search, names)):
        return f"{recording.format} of ROS messages"
    return recording.format


def _has_stated_unit(one: Series) -> bool:
    return one.unit in UNITS["angle"]


def _infer_units(playing: Mapping[str, Series]) -> dict[str, Series]:
    """Return angles of a message, and rates of an array, in one unit, and positions in metres."""
    made = dict(playing)
    unsaid = {
        role: one
        for role in _MAX_ANGLE_RAD
        if (one := made.get(role)) and not _has_stated_unit(one)
    }
    beyond = {
        one.topic
        for role, one in unsaid.items()
        if float(np.nanmax(np.abs(one.values))) > _MAX_ANGLE_RAD[role]
    }
    for role, one in unsaid.items():
        made[role] = replace(one, unit="deg" if one.topic in beyond else "rad")
    unsaid = {role: one for role in _RATES if (one := made.get(role)) and one.unit is None}
    size = {role: float(np.nanquantile(np.abs(one.values), 0.99)) for role, one in unsaid.items()}
    fast = {array_of(one) for role, one in unsaid.items() if size[role] > _MAX_RATE_RAD_S}
    for role, one in unsaid.items():
        made[role] = replace(one, unit="deg/s" if array_of(one) in fast else "rad/s")
    for role in {*_PLACES, "position.depth"} & made.keys():
        scale = UNITS["length"].get(made[role].unit or "m", 1.0)
        made[role] = replace(made[role], values=made[role].values * scale)
    return made


def _world_frame(form: str, body: str) -> str:
    return "NED" if body == "FRD" else "ENU" if conventional_axes(form).endswith("ENU") else "NWU"


def _name_world_axes(one: Guess, world: str, way: VelocityMatch) -> Guess:
    """Name the axes of the world that a position, or an earth-fixed velocity, is along."""
    group, _, channel = one.role.partition(".")
    if one.role in _SPEEDS and way.earth_fixed:
        one = _add_evidence(one, "along the axes of the position: earth-fixed")
    elif one.role in _EARTH_FIXED:
        if way.earth_fixed is False:
            return replace(one, role=_SPEEDS[_EARTH_FIXED.index(one.role)])
        one = _add_evidence(one, "earth-fixed by its name")
    elif one.role not in _PLACES:
        return one
    name, sign = _AXES_OF[world]["uvwxyz".index(channel) % 3]
    return replace(one, role=f"{group}.{name}", sign=sign)


def array_of(one: Series) -> tuple[str, str]:
    """Return the array that a series is an element of; columns of a topic make one too."""
    return one.topic, split_index(one.field)[0] if one.field.endswith((")", "]")) else ""


def _flag_fields(series: Mapping[str, Series], named: Iterable[Guess]) -> dict[str, str]:
    """Return the fields of zeros and ones, both of them, that say which rows are good."""
    found = [series[one.column] for one in named if one.role == "flag"]
    return {one.topic: one.field for one in found if set(one.values.tolist()) == {0.0, 1.0}}


def _clock_guesses(clocks: Mapping[str, TopicClock]) -> Iterator[Guess]:
    for topic, clock in clocks.items():
        if clock.column is not None:
            column, why = f"{topic}.{clock.column}".lstrip("."), (clock.evidence,)
            yield Guess(column, "time", clock.confidence, clock.unit, 1, why, topic=topic)


def _guess_from_names(
    recording: Recording, series: Mapping[str, Series], others: Sequence[Recording]
) -> tuple[list[Guess], dict[str, str]]:
    """Return what names say of columns, and of those that they say nothing of why."""
    topics = {topic.name: (topic, frozenset(topic.fields)) for topic in recording.topics}
    again: dict[str, list[FloatArray]] = {}
    for topic in (topic for other in others for topic in other.topics):
        for its in topic_series(topic, None):
            again.setdefault(its.column, []).append(its.values)
    guesses: list[Guess] = []
    silent: dict[str, str] = {}
    for column, one in series.items():
        topic, beside = topics[one.topic]
        role, sure = guess_role(
            one.topic, one.field, one.unit, beside, topic.units.get(one.field, "")
        )
        known = np.concatenate([one.values, *again.get(column, ())])
        known = known[np.isfinite(known)]
        low, high = float(known.min()), float(known.max())
        is_pulse = one.unit is None and _PULSE_RANGE_US[0] <= low and high <= _PULSE_RANGE_US[1]
        if is_stick := is_pulse and low < high and role in _MAX_ANGLE_RAD:
            role, sure = "commands", 60
        if sure == 0:
            silent[column] = role
            continue
        is_still, is_driven = (
            high - low <= _MIN_RANGE.get(role, -1.0),
            {*words(column)} & _SERVO_WORDS,
        )
        if is_still and (role != "commands" or (low in _IDLE_VALUES and (low or is_driven))):
            silent[column] = f"never changes from {low:.3g}"
            continue
        why: tuple[str, ...] = ("name and unit" if one.unit and quantity_of_role(role) else "name",)
        if role.startswith("attitude.q["):  # a part of an array
            order = _quaternion_order(column, series)
            role, why = f"attitude.q{order[int(role[-2])]}", (*why, f"{order[0]} first, by size")
        is_pulse = is_pulse and role == "commands" and (is_stick or bool(is_driven))
        why = (*why, "still in this run") if is_still else why
        why = (*why, "a pulse width: -1 at 1100, 1 at 1900 us") if is_pulse else why
        guesses.append(
            Guess(column, role, sure, one.unit, 1, why, topic=one.topic, is_pulse=is_pulse)
        )
    return _reclassify_normalised_wrench(guesses, series), silent


def _reclassify_normalised_wrench(
    guesses: list[Guess], series: Mapping[str, Series]
) -> list[Guess]:
    """Take a wrench of which no component of its topic exceeds one for commands."""
    loads = [one for one in guesses if one.role.startswith("wrench.")]
    large = {
        one.topic
        for one in loads
        if one.unit is not None or float(np.nanmax(np.abs(series[one.column].values))) > 1.0
    }
    why = "no larger than one: no newtons"
    return [
        replace(_add_evidence(one, why), role="commands")
        if one.role.startswith("wrench.") and one.topic not in large
        else one
        for one in guesses
    ]


def _quaternion_order(column: str, series: Mapping[str, Series]) -> str:
    """Return the order of a quaternion: hardly any craft tilts far, so x and y are small."""
    there = (series.get(re.sub(r"\d(?=]?$)", place, column)) for place in "02")
    first, third = (0.0 if one is None else float(np.nanmean(one.values**2)) for one in there)
    return "xyzw" if first < third else "wxyz"


def _mark_best(guesses: list[Guess], series: Mapping[str, Series]) -> list[Guess]:
    """Mark the best guess of each role; of guesses alike that of the faster messages."""

    def merit(one: Guess) -> tuple[int, int]:
        return one.confidence, len(series[one.column].seconds)

    best: dict[str, Guess] = {}
    for one in sorted(guesses, key=merit, reverse=True):
        best.setdefault(_competing_role(one), one)
    many = {"commands", "flag"}
    return [
        replace(one, is_best=one.role in many or best[_competing_role(one)] is one)
        for one in guesses
    ]


def _competing_role(one: Guess) -> str:
    """Return the role that a guess competes for: a yaw and a heading are one angle."""
    return "attitude.yaw" if one.role == "attitude.heading" else one.role


def _add_motion_evidence(one: Guess, series: Series, rates: RateMatch, way: VelocityMatch) -> Guess:
    """Return a guess with what its numbers and its motion say."""
    group, _, channel = one.role.partition(".")
    if not one.is_best:
        return one
    if one.role in _MAX_ANGLE_RAD and not series.unit:
        one = _add_evidence(one, f"{one.unit} by its size")
    if group == "attitude" and not rates.unit and not series.unit and one.unit == "rad":
        one = replace(one, confidence=min(one.confidence, _UNIT_FROM_SIZE_CONFIDENCE))
    if group == "attitude" and rates.unit:
        return _raise_confidence(
            _add_evidence(one, "turns as the rates say"), min(dict(rates.axes).values())
        )
    if one.role in _RATES and rates.unit:
        likeness = dict(rates.axes).get(channel, 0.0)
        does = f"turns as the attitude does ({likeness:.2f})" if likeness else "beside others"
        return _raise_confidence(
            _add_evidence(one, f"{does}, in {rates.unit}", rates.unit), likeness
        )
    if one.role in _RATES and series.unit is None:
        why = f"{one.unit} by the size of its array"
        one = replace(_add_evidence(one, why), confidence=_UNIT_FROM_SIZE_CONFIDENCE)
    if way.regression.is_consistent() and one.role in (*_SPEEDS, *_EARTH_FIXED, *_PLACES):
        likeness = way.regression.correlation
        return _raise_confidence(
            _add_evidence(one, f"velocity and position agree ({likeness:.2f})"), likeness
        )
    return one


def _add_evidence(one: Guess, told: str, unit: str | None = None) -> Guess:
    """Return a guess with one more piece of evidence."""
    return replace(one, evidence=(*one.evidence, told), unit=unit or one.unit)


def _raise_confidence(one: Guess, likeness: float) -> Guess:
    doubt = (1 - one.confidence / 100) * (1 - likeness)
    return replace(one, confidence=min(99, round(100 * (1 - doubt))))
