"""A mapping file drafted from guesses: short, explicit, every line with its confidence."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hydrodamp.basis.atoms import check_command_name
from hydrodamp.data.channels import ATTITUDE, EULER, RESERVED, WRENCH
from hydrodamp.data.recording import Recording
from hydrodamp.errors import HydrodampError
from hydrodamp.ingest.inspection.columns import TopicClock, is_stamp
from hydrodamp.ingest.inspection.roles import Guess, Roles
from hydrodamp.ingest.mapping.schema import WORLD_DIRECTIONS

#: Confidence [%] below which a guess is left out, and from which it is sure.
MIN_CONFIDENCE, SURE_CONFIDENCE = 40, 70

_PLAIN_REASONS = ("name", "name and unit")  # go without saying
_GROUPS = ("attitude", "velocity", "position", "specific_force", "wrench")
_SPEEDS = (*"uvw", *WORLD_DIRECTIONS)
_VERTICAL = frozenset(f"position.{name}" for name in ("up", "down", "depth"))
_MAX_NAMES = 12  # columns of one message and reason that are named
_NO_VELOCITY = (
    "# No velocity was found, nor a pose to derive one from. Name its columns:",
    "# velocity: {u: COLUMN, v: COLUMN, w: COLUMN, p: COLUMN, q: COLUMN, r: COLUMN}",
)
_MAX_COMMANDS = 24  # more are no draft, but a list
_COMMENT_WIDTH = 86
_PLAIN_SCALAR = re.compile(r"[A-Za-z_/][\w./ -]*\w|[A-Za-z_]")
_YAML_KEYWORDS = frozenset(("y", "n", "yes", "no", "on", "off", "true", "false", "null", "none"))
_GENERIC = frozenset(["data", "value", "x", "y", "z", "output", "input", "xyz", "channels"])


@dataclass(frozen=True)
class Draft:
    """A mapping file, and how far to trust it."""

    text: str
    confidence: int


def write_draft(recording: Recording, roles: Roles) -> Draft:
    """Write a mapping file from guesses, and list what is not in it."""
    used = select_channels(roles)
    driven = [one for one in roles.all_of("commands") if one.confidence >= MIN_CONFIDENCE][
        :_MAX_COMMANDS
    ]
    motion = [one for one in used if one.role.startswith(("velocity.", "attitude."))]
    groups = {one.role.partition(".")[0] for one in used}
    is_whole = "velocity" in groups or {"attitude", "position"} <= groups
    lines = [
        *_header(recording),
        *_file_lines(recording),
        *_frame_lines(roles),
        *_time_line(recording, roles, (*used, *driven)),
        *(line for group in _GROUPS for line in _group_lines(used, group, roles)),
        *_command_lines(driven),
        *_sensor_lines(roles),
        *_step_line(used),
        *(() if is_whole else _NO_VELOCITY),
        *_omitted_columns(recording, roles, {one.column for one in (*used, *driven)}),
    ]
    least = min((one.confidence for one in motion), default=0)
    return Draft("\n".join(lines) + "\n", least if is_whole and roles.clocks else 0)


def draft_from_preset(recording: Recording, preset: str) -> Draft:
    """Take the whole mapping from a preset that has all its columns in a recording."""
    return Draft("\n".join([*_header(recording), f"extends: {preset}"]) + "\n", SURE_CONFIDENCE)


def _header(recording: Recording) -> list[str]:
    name = ", ".join(Path(one).name for one in recording.source.split(", "))
    return _comment(f"Drafted by `hydrodamp probe` from {name or 'a recording'}; check every line.")


def _comment(text: str) -> list[str]:
    """Return a comment, broken into lines."""
    return [f"# {line}" for line in textwrap.wrap(" ".join(text.split()), _COMMENT_WIDTH)]


def _confidence_comment(one: Guess) -> str:
    """Return the comment behind a line: how sure it is, and why."""
    seen = [each for each in one.evidence if each not in _PLAIN_REASONS]
    why = " ".join("; ".join(seen).split())
    return f"    # {one.confidence} %{f': {why}' if why else ''}"


def select_channels(roles: Roles) -> list[Guess]:
    """Return the channels of the draft: one way to say each thing."""
    sure = [one for one in roles.guesses if one.is_best and one.confidence >= MIN_CONFIDENCE]
    there = [one for one in sure if "." in one.role]
    names = {one.role for one in there}
    parts = {f"attitude.{name}" for name in ATTITUDE.columns}
    angles = {f"attitude.{name}" for name in (*EULER, "heading")}
    out = _roles_to_omit(there, parts, angles) if parts <= names else parts
    out |= {f"{group}.up" for group in ("velocity", "position") if f"{group}.down" in names}
    body, world = ({f"velocity.{name}" for name in way} for way in ("uvw", WORLD_DIRECTIONS))
    out |= (
        _roles_to_omit(there, body, world)
        if {"velocity.north", "velocity.east"} <= names
        else world
    )
    if len(names & {"position.north", "position.east"}) == 1:
        out |= {"position.north", "position.east"}
    if names & {"position.up", "position.down"}:
        out.add("position.depth")
    surest = sorted(there, key=lambda one: one.confidence)
    best = {one.role: one for one in surest if one.role not in out}
    return [one for one in there if best.get(one.role) is one]


def _roles_to_omit(there: Sequence[Guess], ones: set[str], others: set[str]) -> set[str]:
    """Return which of two ways to say a thing to leave out: the second, unless that is surer."""
    first, second = (
        min((one.confidence for one in there if one.role in way), default=0)
        for way in (ones, others)
    )
    return ones if first < min(SURE_CONFIDENCE, second) else others


def _file_lines(recording: Recording) -> Iterator[str]:
    """Say which files make one recording, so that any of them stands for all."""
    if recording.files:
        yield "files:    # read together; * is what names the run"
        yield from (f"  {_quote(name)}: {_quote(file)}" for name, file in recording.files.items())


def _frame_lines(roles: Roles) -> Iterator[str]:
    upright = roles.vertical_axis
    for sign in upright.evidence:
        yield from _comment(sign.message)
    yield f"frame: {upright.body}    # {upright.confidence} %"
    if upright.body == "FLU":
        yield f"world: {roles.world}"


def _time_line(recording: Recording, roles: Roles, used: Sequence[Guess]) -> Iterator[str]:
    """Name the clocks of the topics that are used, those of sensors before that of arrival."""
    if not roles.clocks:
        yield "time: {rate: HERTZ}    # no column counts the time: write how often the rows come"
        return
    there = {one.topic: roles.clocks[one.topic] for one in used if one.topic in roles.clocks}
    there = there or dict(roles.clocks)
    choices: dict[str, str] = {}
    for topic, clock in sorted(there.items(), key=lambda pair: pair[1].column is None):
        is_shared = any(
            clock.column in recording.topic(name).fields and other.column != clock.column
            for name, other in there.items()
        )
        choices.setdefault(_format_clock(topic if is_shared else "", clock), _clock_comment(clock))
    if any(
        clock.column and recording.topic(name).time is not None for name, clock in there.items()
    ):
        choices.setdefault("recorded", "")
    first, *others = choices
    said = f"[{', '.join(choices)}]" if others else first
    yield f"time: {said}{choices[first]}"


def _format_clock(topic: str, clock: TopicClock) -> str:
    """Return a clock as a mapping says it."""
    if clock.rate is not None:
        return f"{{rate: {clock.rate:g}}}"
    if clock.column is None:
        return "recorded"
    stem = f"{topic}." if topic else ""
    column = _quote(stem + clock.column)
    if clock.fraction:
        return f"{{column: {column}, plus: {{{_quote(stem + clock.fraction)}: 1.0e-9}}}}"
    return column if clock.unit == "s" else f"{{column: {column}, unit: {clock.unit}}}"


def _clock_comment(clock: TopicClock) -> str:
    is_said = clock.column is not None or clock.rate is not None
    return f"    # {clock.confidence} %: {clock.evidence}" if is_said else ""


def _group_lines(used: Sequence[Guess], group: str, roles: Roles) -> Iterator[str]:
    inside = [one for one in used if one.role.startswith(f"{group}.")]
    if not inside:
        return
    yield f"{group}:"
    names = [one.role.partition(".")[2] for one in inside]
    for one, name in zip(inside, names, strict=True):
        flag = roles.flags.get(one.topic) if group == "velocity" else None
        yield f"  {name}: {_format_entry(one, flag)}{_confidence_comment(one)}"
    there = {one.role for one in used}
    is_level = "velocity.w" in there and there.isdisjoint(("velocity.p", "velocity.q"))
    if group == "attitude" and ({"roll", "pitch"} & set(names) or (is_level and "qw" not in names)):
        for name in ("roll", "pitch", "yaw"):
            if name not in names and not (name == "yaw" and "heading" in names):
                yield f"  {name}: {{value: 0.0}}    # not recorded: taken as level"
    if group == "velocity" and "north" in names and not {"down", "up"} & set(names):
        yield "  down: {value: 0.0}    # not recorded: taken as level"
    if group == WRENCH.name:
        absent = (name for name in WRENCH.columns if name not in names)
        for name in absent:
            like = [one for one in roles.without_role if re.search(rf"(^|[^A-Za-z]){name}$", one)]
            why = f"`{like[0]}` is left out, see below" if like else "not recorded: taken as none"
            yield f"  {name}: {{value: 0.0}}    # {why}"


def _format_entry(one: Guess, flag: str | None = None) -> str:
    said = [f"column: {_quote(one.column)}"]
    if one.unit is not None:
        said.append(f"unit: {one.unit}")
    if one.sign < 0:
        said.append("sign: -1")
    if one.is_pulse:
        said.append("scale: 0.0025, offset: -3.75")
    if flag is not None:
        said.append(f"where: {_quote(flag)}")
    return _quote(one.column) if len(said) == 1 else f"{{{', '.join(said)}}}"


def _command_lines(found: Sequence[Guess]) -> Iterator[str]:
    if not found:
        return
    yield "commands:"
    for name, one in zip(command_names([one.column for one in found]), found, strict=True):
        if one.unit not in (None, "deg", "cdeg"):
            one = replace(one, unit=None)
        yield f"  {name}: {_format_entry(one)}{_confidence_comment(one)}"


def command_names(columns: Sequence[str]) -> list[str]:
    """Return short names of commands that terms may hold."""
    names: list[str] = []
    for column in columns:
        topic, _, last = column.rpartition(".")
        is_generic = last.partition("[")[0].lower() in _GENERIC
        short = "/".join(topic.split("/")[-2:]) + f".{last}" if is_generic else last
        short = short.removesuffix(".data") if topic else short
        tries = (short, column, *(f"{column}_{k}" for k in range(2, 99)))
        names.append(next(name for one in tries if (name := _valid_name(one)) not in names))
    return names


def _valid_name(text: str) -> str:
    """Return a name that a term may hold."""
    name = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_") or "command"
    name = f"c{name}" if name[0].isdigit() else name
    try:
        check_command_name(name)
    except HydrodampError:
        return f"{name}_command"
    return f"{name}_command" if name in RESERVED or name.lower() in _YAML_KEYWORDS else name


def _sensor_lines(roles: Roles) -> Iterator[str]:
    other = "FLU" if roles.vertical_axis.body == "FRD" else "FRD"
    turned = (("rates", roles.rates.mirrored), ("velocity", roles.velocity.mirrored))
    lines = [f"  {name}: {{axes: {other}}}" for name, is_turned in turned if is_turned]
    yield from ("sensors:    # in other axes than the attitude", *lines) if lines else ()


def _step_line(used: Sequence[Guess]) -> Iterator[str]:
    """Ask for velocities and rates that were not recorded, where there is a pose."""
    names, steps = {one.role for one in used}, list[str]()
    is_placed = bool({"position.north", "position.east"} <= names or names & _VERTICAL)
    if is_placed and names.isdisjoint(f"velocity.{speed}" for speed in _SPEEDS):
        steps.append("velocity_from_position")
    angles = {"attitude.roll", "attitude.pitch", "attitude.qw"}
    wanted = {"r", "p", "q"} if names & angles else {"r"}
    there = any(name.startswith("attitude.") for name in names)
    if there and not {f"velocity.{rate}" for rate in wanted} <= names:
        steps.append("rates_from_attitude")
    if steps:
        is_depth = "velocity_from_position" in steps and "position.north" not in names
        told = "; a depth alone gives w, as of a vehicle that moves straight up and down"
        yield f"steps: [{', '.join(steps)}]    # not recorded, derived{told if is_depth else ''}"


def _omitted_columns(recording: Recording, roles: Roles, used: Collection[str]) -> Iterator[str]:
    """List every column that is not in the draft, with why."""
    reasons: dict[tuple[str, str], list[str]] = {}
    guessed = {one.column: one for one in roles.guesses}
    for topic in recording.topics:
        stem = f"{topic.name}." if topic.name else ""
        clock = roles.clocks.get(topic.name)
        own = (clock.column, clock.fraction) if clock else ()
        for field in {**topic.fields, **topic.texts, **topic.faults}:
            column = f"{stem}{field}"
            if column in used or field in own:
                continue
            plain = "a time" if is_stamp(field) else "no clock beside it or no number in it"
            why = topic.faults.get(field) or roles.without_role.get(column) or plain
            if one := guessed.get(column):
                why = _omission_reason(one, roles)
            elif field not in (*topic.fields, *topic.faults):
                why = "words"
            message, _, last = field.rpartition("[" if field.endswith("]") else ".")
            reasons.setdefault((f"{stem}{message}".rstrip("."), why), []).append(last.rstrip("]"))
    if reasons:
        yield "# Left out:"
    for (message, why), names in reasons.items():
        more = f" and {len(names) - _MAX_NAMES} more" if len(names) > _MAX_NAMES else ""
        listed = f"{' '.join(names[:_MAX_NAMES])}{more} - {why}"
        yield from _comment(f"{message}: {listed}" if message else listed)


def _omission_reason(one: Guess, roles: Roles) -> str:
    """Return why a guess is not in the draft."""
    best = roles.best(one.role)
    if one.role == "flag":
        return "tells good rows from bad"
    if one.confidence < MIN_CONFIDENCE:
        return f"{one.role} perhaps, {one.confidence} %"
    if one.role == "commands":
        return "more commands than a draft lists"
    other = best.column if best is not None and best.column != one.column else "given otherwise"
    return f"{one.role} is {other}"


def _quote(text: str) -> str:
    """Return a YAML scalar that is this text."""
    plain = _PLAIN_SCALAR.fullmatch(text) and text.lower() not in _YAML_KEYWORDS
    return text if plain else json.dumps(text, ensure_ascii=False)
