"""Guessed roles: names, units, sizes and motion weighed together."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.data.recording import Recording
from hydrodamp.ingest.formats.files import usual_axes
from hydrodamp.ingest.probing.columns import (
    Series,
    Ticking,
    hint,
    quantity_of_role,
    series_of,
    ticking,
)
from hydrodamp.ingest.probing.frames import (
    RateMatch,
    Upright,
    WayMatch,
    angle_unit,
    match_rates,
    match_way,
    weigh,
)

_ODD = 15.0  # m/s, beyond the speed of nearly all craft
_SIBLINGS = 3  # points for each role that the same message fills
_SPEEDS = tuple(f"velocity.{name}" for name in "uvw")
_PLACES = tuple(f"position.{name}" for name in "xyz")
_COMPASS = {
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
    chosen: bool = True
    topic: str = ""


@dataclass(frozen=True, eq=False)
class Roles:
    """All guesses about a recording."""

    guesses: tuple[Guess, ...]
    clocks: Mapping[str, Ticking]
    flags: Mapping[str, str]  # for topics that mark their good rows the field that does
    rates: RateMatch
    way: WayMatch
    upright: Upright
    world: str

    def chosen(self, role: str) -> Guess | None:
        """Return the best guess for a role."""
        return next((one for one in self.guesses if one.role == role and one.chosen), None)

    def all_of(self, role: str) -> tuple[Guess, ...]:
        """Return every chosen guess of a role, such as all commands."""
        return tuple(one for one in self.guesses if one.role == role and one.chosen)


def guess_roles(recording: Recording) -> Roles:
    """Guess what every column of a recording is."""
    clocks = {topic.name: clock for topic in recording.topics if (clock := ticking(topic))}
    series = {
        one.column: one
        for topic in recording.topics
        if topic.name in clocks
        for one in series_of(topic, clocks[topic.name])
    }
    found = _best([*_named(series.values())], series)
    flags = _flags(series, found)
    playing = {one.role: series[one.column] for one in found if one.chosen}
    rates, way = match_rates(playing), match_way(playing)
    weighed = [_weighed(one, series[one.column], rates, way) for one in found]
    upright = weigh(recording.format, playing)
    world = _world(recording.format, upright.body)
    placed = [_placed(one, world, way) for one in weighed]
    return Roles((*_times(clocks), *placed), clocks, flags, rates, way, upright, world)


def _world(form: str, body: str) -> str:
    return "NED" if body == "FRD" else "ENU" if usual_axes(form).endswith("ENU") else "NWU"


def _placed(one: Guess, world: str, way: WayMatch) -> Guess:
    """Name the axes of the world that a position, or an earth-fixed velocity, is along."""
    group, _, channel = one.role.partition(".")
    if one.role in _SPEEDS and way.earth_fixed:
        one = _with(one, "along the axes of the position: earth-fixed")
    elif one.role not in _PLACES:
        return one
    name, sign = _COMPASS[world]["uvwxyz".index(channel) % 3]
    return replace(one, role=f"{group}.{name}", sign=sign)


def _flags(series: Mapping[str, Series], named: Iterable[Guess]) -> dict[str, str]:
    """Return the fields of zeros and ones, both of them, that say which rows are good."""
    found = [series[one.column] for one in named if one.role == "flag"]
    return {one.topic: one.field for one in found if set(one.values.tolist()) == {0.0, 1.0}}


def _times(clocks: Mapping[str, Ticking]) -> Iterator[Guess]:
    for topic, clock in clocks.items():
        if clock.column is not None:
            column, why = f"{topic}.{clock.column}".lstrip("."), (clock.evidence,)
            yield Guess(column, "time", clock.confidence, clock.unit, 1, why, topic=topic)


def _named(series: Iterable[Series]) -> Iterator[Guess]:
    for one in series:
        if (told := hint(one.topic, one.field, one.unit)) is None:
            continue
        role, sure = told
        why: tuple[str, ...] = ("name and unit" if one.unit and quantity_of_role(role) else "name",)
        if role.startswith("attitude.q["):  # parts of an array: w first, as most write them
            role, why = f"attitude.q{'wxyz'[int(role[-2])]}", (*why, "w first")
        yield Guess(one.column, role, sure, one.unit, 1, why, topic=one.topic)


def _best(guesses: list[Guess], series: Mapping[str, Series]) -> list[Guess]:
    """Mark the best guess of each role; a message that fills several roles has the advantage."""

    def message(one: Guess) -> tuple[str, str, str]:
        its = series[one.column]
        return its.topic, its.field.rpartition(".")[0], one.role.partition(".")[0]

    filled = Counter(kind for kind, _ in {(message(one), one.role) for one in guesses})

    def merit(one: Guess) -> tuple[float, int]:
        siblings = _SIBLINGS * filled[message(one)]
        return one.confidence + siblings, len(series[one.column].seconds)

    best: dict[str, Guess] = {}
    for one in sorted(guesses, key=merit, reverse=True):
        best.setdefault(one.role, one)
    many = {"commands", "flag"}
    return [replace(one, chosen=one.role in many or best[one.role] is one) for one in guesses]


def _weighed(one: Guess, series: Series, rates: RateMatch, way: WayMatch) -> Guess:
    """Return a guess with what its numbers and its motion say."""
    group, _, channel = one.role.partition(".")
    if channel in ("roll", "pitch", "yaw", "heading"):
        unit = angle_unit(series)
        one = replace(one, unit=unit) if series.unit else _with(one, f"{unit} by its size", unit)
    if not one.chosen:
        return one
    if group == "attitude" and rates.unit:
        return _surer(_with(one, "turns as the rates say"), min(dict(rates.axes).values()))
    if group == "velocity" and channel in dict(rates.axes) and rates.unit:
        likeness = dict(rates.axes)[channel]
        told = f"turns as the attitude does ({likeness:.2f}), in {rates.unit}"
        return _surer(_with(one, told, rates.unit), likeness)
    if way.agreement.agrees() and one.role in (*_SPEEDS, *_PLACES):
        likeness = way.agreement.correlation
        return _surer(_with(one, f"velocity and position agree ({likeness:.2f})"), likeness)
    if one.role in _SPEEDS:
        usual = float(np.nanmedian(np.abs(series.values)))
        if usual > _ODD:
            doubted = _with(one, f"its median size is {usual:.3g}: cm/s or mm/s?")
            return replace(doubted, confidence=one.confidence // 2)
    return one


def _with(one: Guess, told: str, unit: str | None = None) -> Guess:
    """Return a guess with one more piece of evidence."""
    return replace(one, evidence=(*one.evidence, told), unit=unit or one.unit)


def _surer(one: Guess, likeness: float) -> Guess:
    doubt = (1 - one.confidence / 100) * (1 - likeness)
    return replace(one, confidence=min(99, round(100 * (1 - doubt))))
