"""Draft of a mapping file from guessed roles; every line states its confidence."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hydrodamp.basis.term import check_command_name
from hydrodamp.data.channels import ATTITUDE, EULER, RESERVED, WRENCH
from hydrodamp.data.recording import Recording
from hydrodamp.errors import HydrodampError
from hydrodamp.ingest.inspection.columns import TopicClock, is_stamp
from hydrodamp.ingest.inspection.roles import Guess, Roles
from hydrodamp.ingest.mapping.schema import WORLD_DIRECTIONS

#: Confidence [%] below which a guess is omitted, and from which it is preferred.
MIN_CONFIDENCE, SURE_CONFIDENCE = 40, 70

_PLAIN_REASONS = ("name", "name and unit")  # not printed
_GROUPS = ("attitude", "velocity", "position", "specific_force", "wrench")
_SPEEDS = (*"uvw", *WORLD_DIRECTIONS)
_VERTICAL = frozenset(f"position.{name}" for name in ("up", "down", "depth"))
_MAX_NAMES = 12  # columns listed per message and reason
_NO_VELOCITY = (
    "# No velocity, and no pose to derive it from, was found. Name its columns:",
    "# velocity: {u: COLUMN, v: COLUMN, w: COLUMN, p: COLUMN, q: COLUMN, r: COLUMN}",
)
_MAX_COMMANDS = 24  # more are not listed
_COMMENT_WIDTH = 86
_PLAIN_SCALAR = re.compile(r"[A-Za-z_/][\w./ -]*\w|[A-Za-z_]")
_YAML_KEYWORDS = frozenset(("y", "n", "yes", "no", "on", "off", "true", "false", "null", "none"))
_GENERIC = frozenset(["data", "value", "x", "y", "z", "output", "input", "xyz", "channels"])


@dataclass(frozen=True)
class Draft:
    """A mapping file and its confidence [%]."""

    text: str
    confidence: int


def write_draft(recording: Recording, roles: Roles) -> Draft:
    """Write a mapping file from guesses, with a list of omitted columns."""
    used = select_channels(roles)
    commands = [guess for guess in roles.all_of("commands") if guess.confidence >= MIN_CONFIDENCE][
        :_MAX_COMMANDS
    ]
    motion = [guess for guess in used if guess.role.startswith(("velocity.", "attitude."))]
    groups = {guess.role.partition(".")[0] for guess in used}
    is_complete = "velocity" in groups or {"attitude", "position"} <= groups
    lines = [
        *_header(recording),
        *_file_lines(recording),
        *_frame_lines(roles),
        *_time_line(recording, roles, (*used, *commands)),
        *(line for group in _GROUPS for line in _group_lines(used, group, roles)),
        *_command_lines(commands),
        *_sensor_lines(roles),
        *_step_line(used),
        *(() if is_complete else _NO_VELOCITY),
        *_omitted_columns(recording, roles, {guess.column for guess in (*used, *commands)}),
    ]
    confidence = min((guess.confidence for guess in motion), default=0)
    return Draft("\n".join(lines) + "\n", confidence if is_complete and roles.clocks else 0)


def draft_from_preset(recording: Recording, preset: str) -> Draft:
    """Return a draft that extends a preset."""
    return Draft("\n".join([*_header(recording), f"extends: {preset}"]) + "\n", SURE_CONFIDENCE)


def _header(recording: Recording) -> list[str]:
    name = ", ".join(Path(path).name for path in recording.source.split(", "))
    return _comment(f"Drafted by `hydrodamp probe` from {name or 'a recording'}; check every line.")


def _comment(text: str) -> list[str]:
    """Return a comment, broken into lines."""
    return [f"# {line}" for line in textwrap.wrap(" ".join(text.split()), _COMMENT_WIDTH)]


def _confidence_comment(guess: Guess) -> str:
    """Return the comment of a line: confidence and evidence."""
    reasons = [reason for reason in guess.evidence if reason not in _PLAIN_REASONS]
    text = " ".join("; ".join(reasons).split())
    return f"    # {guess.confidence} %{f': {text}' if text else ''}"


def select_channels(roles: Roles) -> list[Guess]:
    """Return the channels of the draft, without redundant ones."""
    sure = [
        guess for guess in roles.guesses if guess.is_best and guess.confidence >= MIN_CONFIDENCE
    ]
    candidates = [guess for guess in sure if "." in guess.role]
    names = {guess.role for guess in candidates}
    quaternion = {f"attitude.{name}" for name in ATTITUDE.columns}
    angles = {f"attitude.{name}" for name in (*EULER, "heading")}
    omitted = _roles_to_omit(candidates, quaternion, angles) if quaternion <= names else quaternion
    omitted |= {f"{group}.up" for group in ("velocity", "position") if f"{group}.down" in names}
    body, world = (
        {f"velocity.{name}" for name in channels} for channels in ("uvw", WORLD_DIRECTIONS)
    )
    omitted |= (
        _roles_to_omit(candidates, body, world)
        if {"velocity.north", "velocity.east"} <= names
        else world
    )
    if len(names & {"position.north", "position.east"}) == 1:
        omitted |= {"position.north", "position.east"}
    if names & {"position.up", "position.down"}:
        omitted.add("position.depth")
    by_confidence = sorted(candidates, key=lambda guess: guess.confidence)
    best = {guess.role: guess for guess in by_confidence if guess.role not in omitted}
    return [guess for guess in candidates if best.get(guess.role) is guess]


def _roles_to_omit(
    candidates: Sequence[Guess], preferred: set[str], alternative: set[str]
) -> set[str]:
    """Return which of two redundant sets to omit: the second, unless its confidence is higher."""
    first, second = (
        min((guess.confidence for guess in candidates if guess.role in roles), default=0)
        for roles in (preferred, alternative)
    )
    return preferred if first < min(SURE_CONFIDENCE, second) else alternative


def _file_lines(recording: Recording) -> Iterator[str]:
    """Yield the names of the files of a recording."""
    if recording.files:
        yield "files:    # read together; * is the name of the run"
        yield from (f"  {_quote(name)}: {_quote(file)}" for name, file in recording.files.items())


def _frame_lines(roles: Roles) -> Iterator[str]:
    upright = roles.vertical_axis
    for sign in upright.evidence:
        yield from _comment(sign.message)
    yield f"frame: {upright.body}    # {upright.confidence} %"
    if upright.body == "FLU":
        yield f"world: {roles.world}"


def _time_line(recording: Recording, roles: Roles, used: Sequence[Guess]) -> Iterator[str]:
    """Yield the clocks of the topics in use, sensor stamps before arrival times."""
    if not roles.clocks:
        yield "time: {rate: HERTZ}    # no column is a clock: enter the sampling rate"
        return
    clocks = {
        guess.topic: roles.clocks[guess.topic] for guess in used if guess.topic in roles.clocks
    }
    clocks = clocks or dict(roles.clocks)
    choices: dict[str, str] = {}
    for topic, clock in sorted(clocks.items(), key=lambda pair: pair[1].column is None):
        is_shared = any(
            clock.column in recording.topic(name).fields and candidate.column != clock.column
            for name, candidate in clocks.items()
        )
        choices.setdefault(_format_clock(topic if is_shared else "", clock), _clock_comment(clock))
    if any(
        clock.column and recording.topic(name).time is not None for name, clock in clocks.items()
    ):
        choices.setdefault("recorded", "")
    first, *alternatives = choices
    text = f"[{', '.join(choices)}]" if alternatives else first
    yield f"time: {text}{choices[first]}"


def _format_clock(topic: str, clock: TopicClock) -> str:
    """Return a clock in the syntax of mappings."""
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
    guesses = [guess for guess in used if guess.role.startswith(f"{group}.")]
    if not guesses:
        return
    yield f"{group}:"
    names = [guess.role.partition(".")[2] for guess in guesses]
    for guess, name in zip(guesses, names, strict=True):
        flag = roles.flags.get(guess.topic) if group == "velocity" else None
        yield f"  {name}: {_format_entry(guess, flag)}{_confidence_comment(guess)}"
    roles_used = {guess.role for guess in used}
    is_level = "velocity.w" in roles_used and roles_used.isdisjoint(("velocity.p", "velocity.q"))
    if group == "attitude" and ({"roll", "pitch"} & set(names) or (is_level and "qw" not in names)):
        for name in ("roll", "pitch", "yaw"):
            if name not in names and not (name == "yaw" and "heading" in names):
                yield f"  {name}: {{value: 0.0}}    # not recorded: assumed level"
    if group == "velocity" and "north" in names and not {"down", "up"} & set(names):
        yield "  down: {value: 0.0}    # not recorded: assumed level"
    if group == WRENCH.name:
        absent = (name for name in WRENCH.columns if name not in names)
        for name in absent:
            similar = [
                guess for guess in roles.without_role if re.search(rf"(^|[^A-Za-z]){name}$", guess)
            ]
            reason = (
                f"`{similar[0]}` is omitted, see below" if similar else "not recorded: assumed zero"
            )
            yield f"  {name}: {{value: 0.0}}    # {reason}"


def _format_entry(guess: Guess, flag: str | None = None) -> str:
    items = [f"column: {_quote(guess.column)}"]
    if guess.unit is not None:
        items.append(f"unit: {guess.unit}")
    if guess.sign < 0:
        items.append("sign: -1")
    if guess.is_pulse:
        items.append("scale: 0.0025, offset: -3.75")
    if flag is not None:
        items.append(f"where: {_quote(flag)}")
    return _quote(guess.column) if len(items) == 1 else f"{{{', '.join(items)}}}"


def _command_lines(guesses: Sequence[Guess]) -> Iterator[str]:
    if not guesses:
        return
    yield "commands:"
    for name, guess in zip(
        command_names([guess.column for guess in guesses]), guesses, strict=True
    ):
        if guess.unit not in (None, "deg", "cdeg"):
            guess = replace(guess, unit=None)
        yield f"  {name}: {_format_entry(guess)}{_confidence_comment(guess)}"


def command_names(columns: Sequence[str]) -> list[str]:
    """Return short names of commands that are valid in terms."""
    names: list[str] = []
    for column in columns:
        topic, _, last = column.rpartition(".")
        is_generic = last.partition("[")[0].lower() in _GENERIC
        short = "/".join(topic.split("/")[-2:]) + f".{last}" if is_generic else last
        short = short.removesuffix(".data") if topic else short
        candidates = (short, column, *(f"{column}_{k}" for k in range(2, 99)))
        names.append(
            next(name for candidate in candidates if (name := _valid_name(candidate)) not in names)
        )
    return names


def _valid_name(text: str) -> str:
    """Return a name that is valid in terms."""
    name = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_") or "command"
    name = f"c{name}" if name[0].isdigit() else name
    try:
        check_command_name(name)
    except HydrodampError:
        return f"{name}_command"
    return f"{name}_command" if name in RESERVED or name.lower() in _YAML_KEYWORDS else name


def _sensor_lines(roles: Roles) -> Iterator[str]:
    body = "FLU" if roles.vertical_axis.body == "FRD" else "FRD"
    mirrored = (("rates", roles.rates.mirrored), ("velocity", roles.velocity.mirrored))
    lines = [f"  {name}: {{axes: {body}}}" for name, is_mirrored in mirrored if is_mirrored]
    yield from ("sensors:    # in other axes than the attitude", *lines) if lines else ()


def _step_line(used: Sequence[Guess]) -> Iterator[str]:
    """Yield the steps that derive velocities and rates from the pose."""
    names, steps = {guess.role for guess in used}, list[str]()
    has_position = bool({"position.north", "position.east"} <= names or names & _VERTICAL)
    if has_position and names.isdisjoint(f"velocity.{speed}" for speed in _SPEEDS):
        steps.append("velocity_from_position")
    angles = {"attitude.roll", "attitude.pitch", "attitude.qw"}
    rates = {"r", "p", "q"} if names & angles else {"r"}
    has_attitude = any(name.startswith("attitude.") for name in names)
    if has_attitude and not {f"velocity.{rate}" for rate in rates} <= names:
        steps.append("rates_from_attitude")
    if steps:
        is_depth = "velocity_from_position" in steps and "position.north" not in names
        remark = "; a depth alone gives w of a vehicle that moves vertically"
        yield f"steps: [{', '.join(steps)}]    # not recorded, derived{remark if is_depth else ''}"


def _omitted_columns(recording: Recording, roles: Roles, used: Collection[str]) -> Iterator[str]:
    """Yield every omitted column with the reason."""
    reasons: dict[tuple[str, str], list[str]] = {}
    guesses = {guess.column: guess for guess in roles.guesses}
    for topic in recording.topics:
        stem = f"{topic.name}." if topic.name else ""
        clock = roles.clocks.get(topic.name)
        clock_fields = (clock.column, clock.fraction) if clock else ()
        for field in {**topic.fields, **topic.texts, **topic.faults}:
            column = f"{stem}{field}"
            if column in used or field in clock_fields:
                continue
            default = "a time" if is_stamp(field) else "no clock or no number"
            reason = topic.faults.get(field) or roles.without_role.get(column) or default
            if guess := guesses.get(column):
                reason = _omission_reason(guess, roles)
            elif field not in (*topic.fields, *topic.faults):
                reason = "words"
            message, _, last = field.rpartition("[" if field.endswith("]") else ".")
            reasons.setdefault((f"{stem}{message}".rstrip("."), reason), []).append(
                last.rstrip("]")
            )
    if reasons:
        yield "# Omitted:"
    for (message, reason), names in reasons.items():
        more = f" and {len(names) - _MAX_NAMES} more" if len(names) > _MAX_NAMES else ""
        listed = f"{' '.join(names[:_MAX_NAMES])}{more} - {reason}"
        yield from _comment(f"{message}: {listed}" if message else listed)


def _omission_reason(guess: Guess, roles: Roles) -> str:
    """Return why a guess is omitted."""
    best = roles.best(guess.role)
    if guess.role == "flag":
        return "marks valid rows"
    if guess.confidence < MIN_CONFIDENCE:
        return f"possibly {guess.role}, {guess.confidence} %"
    if guess.role == "commands":
        return "too many commands"
    alternative = (
        best.column
        if best is not None and best.column != guess.column
        else "given by other columns"
    )
    return f"{guess.role} is {alternative}"


def _quote(text: str) -> str:
    """Return the text as a YAML scalar."""
    plain = _PLAIN_SCALAR.fullmatch(text) and text.lower() not in _YAML_KEYWORDS
    return text if plain else json.dumps(text, ensure_ascii=False)
