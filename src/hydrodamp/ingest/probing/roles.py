"""Guessed roles: names, units, sizes and motion weighed together."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.recording import Recording
from hydrodamp.ingest.formats.detect import usual_axes
from hydrodamp.ingest.probing.clocks import Ticking, ticking
from hydrodamp.ingest.probing.frames import (
    RateMatch,
    WayMatch,
    angle_unit,
    match_rates,
    match_way,
)
from hydrodamp.ingest.probing.names import hint, quantity_of_role
from hydrodamp.ingest.probing.planar import planar
from hydrodamp.ingest.probing.series import Series, series_of
from hydrodamp.ingest.probing.upright import Upright, weigh

_HELD = 0.3  # share of samples that repeat the last one; a measurement seldom does
_ODD = 15.0  # m/s, beyond the speed of nearly all craft
_SIBLINGS = 3  # points for each role that the same message fills
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


@dataclass(frozen=True, eq=False)
class Roles:
    """All guesses about a recording."""

    guesses: tuple[Guess, ...]
    clocks: tuple[tuple[str, Ticking], ...]
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
    clocks = [(topic.name, clock) for topic in recording.topics if (clock := ticking(topic))]
    series: dict[str, Series] = {}
    for topic in recording.topics:
        clock = dict(clocks).get(topic.name)
        series |= {one.column: one for one in (series_of(topic, clock) if clock else ())}
    named = _best([*_named(series.values())], series)
    series |= _without_bad(series, named)
    found = [*named, *_unnamed(series, named)]
    playing = {one.role: series[one.column] for one in found if one.chosen}
    commands = [series[one.column] for one in found if one.role == "commands"]
    rates, way = match_rates(playing), match_way(playing)
    weighed = [_weighed(one, series[one.column], rates, way) for one in found]
    upright = weigh(recording.format, playing, commands)
    world = _world(recording.format, upright.body)
    placed = [_placed(one, world, way) for one in weighed]
    return Roles((*_times(clocks), *placed), tuple(clocks), rates, way, upright, world)


def _world(form: str, body: str) -> str:
    return "NED" if body == "FRD" else "ENU" if usual_axes(form).endswith("ENU") else "NWU"


def _placed(one: Guess, world: str, way: WayMatch) -> Guess:
    """Name the axes of the world that a position, or an earth-fixed velocity, is along."""
    group, _, channel = one.role.partition(".")
    if group == "velocity" and channel in "uvw" and channel and way.earth_fixed:
        told = "along the axes of the position: earth-fixed"
        one = replace(one, evidence=(*one.evidence, told))
        channel = "xyz"["uvw".index(channel)]
    elif group != "position" or channel not in ("x", "y", "z"):
        return one
    name, sign = _COMPASS[world]["xyz".index(channel)]
    return replace(one, role=f"{group}.{name}", sign=sign)


def _without_bad(series: dict[str, Series], named: Sequence[Guess]) -> dict[str, Series]:
    """Return the velocities of topics with a flag, without the rows that it marks as bad."""
    flags = {series[one.column].topic: series[one.column] for one in named if one.role == "flag"}
    masked = {}
    for one in named:
        here = series[one.column]
        flag = flags.get(here.topic)
        if flag is not None and one.role.startswith("velocity.") and set_of_two(flag.values):
            values = np.where(flag.values == 1.0, here.values, np.nan)
            if np.isfinite(values).any():
                masked[one.column] = replace(here, values=values)
    return masked


def set_of_two(values: FloatArray) -> bool:
    """Tell a field of zeros and ones, both of them."""
    return bool(((values == 0.0) | (values == 1.0)).all() and values.min() < values.max())


def _times(clocks: Sequence[tuple[str, Ticking]]) -> Iterator[Guess]:
    for topic, clock in clocks:
        if clock.column is not None:
            column = f"{topic}.{clock.column}" if topic else clock.column
            yield Guess(column, "time", clock.confidence, clock.unit, 1, (clock.evidence,))


def _named(series: Iterable[Series]) -> Iterator[Guess]:
    for one in series:
        told = hint(one.topic, one.field, one.unit)
        if told is not None:
            role, confidence = told
            why = "name and unit" if one.unit and quantity_of_role(role) else "name"
            yield Guess(one.column, role, confidence, one.unit, 1, (why,))


def _best(guesses: list[Guess], series: dict[str, Series]) -> list[Guess]:
    """Mark the best guess of each role; a message that fills several roles has the advantage."""
    guesses = _orders(guesses)
    filled: dict[str, set[str]] = {}
    for one in guesses:
        filled.setdefault(_message(one, series), set()).add(one.role)

    def merit(one: Guess) -> tuple[float, int]:
        siblings = _SIBLINGS * len(filled[_message(one, series)])
        return one.confidence + siblings, len(series[one.column].seconds)

    best: dict[str, Guess] = {}
    for one in guesses:
        if one.role not in best or merit(one) > merit(best[one.role]):
            best[one.role] = one
    many = {"commands", "flag"}
    return [replace(one, chosen=one.role in many or best[one.role] is one) for one in guesses]


def _message(one: Guess, series: dict[str, Series]) -> str:
    """Return topic and path of a field without its last part."""
    field = series[one.column].field
    return f"{series[one.column].topic} {field.rpartition('.')[0]} {one.role.partition('.')[0]}"


def _orders(guesses: list[Guess]) -> list[Guess]:
    """Name the parts of quaternions in arrays: w first, as most write them."""
    named = []
    for one in guesses:
        if one.role.startswith("attitude.q["):
            part = "wxyz"[int(one.role[-2])]
            one = replace(one, role=f"attitude.q{part}", evidence=(*one.evidence, "w first"))
        named.append(one)
    return named


def _unnamed(series: dict[str, Series], named: list[Guess]) -> Iterator[Guess]:
    """Guess from the numbers alone, where names say little."""
    known = {one.column for one in named}
    moving = [one for one in named if one.role.startswith(("velocity.", "attitude."))]
    left = [one for column, one in series.items() if column not in known]
    if len({one.topic for one in left}) == 1 and not moving:
        for column, (role, confidence, unit, told) in planar(left).items():
            known.add(column)
            yield Guess(column, role, confidence, unit, 1, (told,), bool(role))
    for one in left:
        if one.column not in known and not one.topic and (share := _held(one)) > _HELD:
            told = f"{100 * share:.0f} % of its samples repeat the last, as commands do"
            if one.varies:
                yield Guess(one.column, "commands", round(30 + 40 * share), one.unit, 1, (told,))


def _held(one: Series) -> float:
    return float(np.mean(np.diff(one.values) == 0.0)) if len(one.values) > 1 else 0.0


def _weighed(one: Guess, series: Series, rates: RateMatch, way: WayMatch) -> Guess:
    """Return a guess with what its numbers and its motion say."""
    group, _, channel = one.role.partition(".")
    if channel in ("roll", "pitch", "yaw", "heading"):
        unit = angle_unit(series)
        told = () if series.unit else (f"{unit} by its size",)
        one = replace(one, unit=unit, evidence=(*one.evidence, *told))
    if not one.chosen:
        return one
    if group == "attitude" and rates.unit:
        told = ("turns as the rates say",)
        likeness = min(likeness for _, likeness in rates.axes)
        return _surer(replace(one, evidence=(*one.evidence, *told)), likeness)
    if group == "velocity" and channel in dict(rates.axes) and rates.unit:
        likeness = dict(rates.axes)[channel]
        told = (f"turns as the attitude does ({likeness:.2f}), in {rates.unit}",)
        return _surer(replace(one, unit=rates.unit, evidence=(*one.evidence, *told)), likeness)
    if way.agreement.agrees() and (group, channel) in _WAY:
        told = (f"velocity and position agree ({way.agreement.correlation:.2f})",)
        one = replace(one, evidence=(*one.evidence, *told))
        return _surer(one, way.agreement.correlation)
    if group == "velocity" and channel in "uvw" and _usual(series) > _ODD:
        told = (f"its median size is {_usual(series):.3g}: cm/s or mm/s?",)
        return replace(one, confidence=one.confidence // 2, evidence=(*one.evidence, *told))
    return one


_WAY = {("velocity", name) for name in "uvw"} | {("position", name) for name in "xyz"}


def _usual(series: Series) -> float:
    return float(np.nanmedian(np.abs(series.values)))


def _surer(one: Guess, likeness: float) -> Guess:
    doubt = (1 - one.confidence / 100) * (1 - likeness)
    return replace(one, confidence=min(99, round(100 * (1 - doubt))))
