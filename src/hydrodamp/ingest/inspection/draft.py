"""Draft of a mapping file from guessed roles; every line states its confidence."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hydrodamp.data.channels import ATTITUDE, EULER, WRENCH
from hydrodamp.data.recording import Recording
from hydrodamp.ingest.inspection.columns import is_stamp
from hydrodamp.ingest.inspection.coordinates import NORTH_EAST
from hydrodamp.ingest.inspection.draft_clock import time_line
from hydrodamp.ingest.inspection.draft_names import command_names, format_source, quote_name
from hydrodamp.ingest.inspection.equivalent_commands import find_equivalent_columns
from hydrodamp.ingest.inspection.guess import Guess
from hydrodamp.ingest.inspection.roles import Roles
from hydrodamp.ingest.mapping.channel_schema import COORDINATES, PATH_VELOCITY, WORLD_DIRECTIONS

#: Confidence [%] below which a guess is omitted, and from which it is preferred.
MIN_CONFIDENCE, SURE_CONFIDENCE = 40, 70

_PLAIN_REASONS = ("name", "name and unit")  # not printed
_GROUPS = ("attitude", "velocity", "position", "specific_force", "wrench")
_BODY, _WORLD = (
    frozenset(f"velocity.{name}" for name in names) for names in ("uvw", WORLD_DIRECTIONS)
)
_RECORDED_VELOCITY = _BODY | _WORLD | {"velocity.course"}
_QUATERNION, _ANGLES = (
    frozenset(f"attitude.{name}" for name in names)
    for names in (ATTITUDE.columns, (*EULER, "heading"))
)
_PATH = frozenset(f"velocity.{name}" for name in PATH_VELOCITY)
_GEOGRAPHIC, _HORIZONTAL = map(frozenset, (COORDINATES, NORTH_EAST))
_TILTS = ("attitude.roll", "attitude.pitch", "attitude.qw")
_LEVEL = "not recorded: assumed level"
_VERTICAL = frozenset(("position.up", "position.down", "position.depth"))
_MAX_NAMES = 12  # columns listed per message and reason
_NO_VELOCITY = (
    "# No velocity, and no pose to derive it from, was found. Name its columns:",
    "# velocity: {u: COLUMN, v: COLUMN, w: COLUMN, p: COLUMN, q: COLUMN, r: COLUMN}",
)
_MAX_COMMANDS = 24  # more are not listed
_COMMENT_WIDTH = 86


@dataclass(frozen=True)
class Draft:
    """A mapping file and its confidence [%]."""

    text: str
    confidence: int


def write_draft(recording: Recording, roles: Roles) -> Draft:
    """Write a mapping file from guesses, with a list of omitted columns."""
    used = select_channels(roles)
    commands = [item for item in roles.all_of("commands") if item.confidence >= MIN_CONFIDENCE]
    columns = {guess.column for guess in commands}
    equivalent = find_equivalent_columns(recording, roles.clocks, columns)
    commands = [item for item in commands if item.column not in equivalent][:_MAX_COMMANDS]
    sources = {guess.role for guess in used if guess.role.startswith(("velocity.", "attitude."))}
    if not sources & _RECORDED_VELOCITY:  # derived from the position
        sources |= _GEOGRAPHIC
    motion = [guess for guess in used if guess.role in sources]
    groups = {guess.role.partition(".")[0] for guess in used}
    is_complete = "velocity" in groups or {"attitude", "position"} <= groups
    lines = [
        *_header(recording),
        *_file_lines(recording),
        *_frame_lines(roles),
        time_line(recording, roles, (*used, *commands)),
        *(line for group in _GROUPS for line in _group_lines(used, group, roles)),
        *_command_lines(commands),
        *_sensor_lines(roles),
        *_step_line(used),
        *(() if is_complete else _NO_VELOCITY),
        *_omitted_columns(
            recording, roles, {guess.column for guess in (*used, *commands)}, equivalent
        ),
    ]
    confidence = min((guess.confidence for guess in motion), default=0)
    return Draft("\n".join(lines) + "\n", confidence if is_complete and roles.clocks else 0)


def draft_from_preset(recording: Recording, preset: str) -> Draft:
    """Return a draft that extends a preset."""
    return Draft("\n".join([*_header(recording), f"extends: {preset}"]) + "\n", SURE_CONFIDENCE)


def _header(recording: Recording) -> list[str]:
    name = ", ".join(Path(path).name for path in recording.source.split(", ")) or "a recording"
    return _comment(f"Drafted by `hydrodamp probe` from {name}; check every line.")


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
    candidates = [
        guess
        for guess in roles.guesses
        if guess.is_best and guess.confidence >= MIN_CONFIDENCE and "." in guess.role
    ]
    names = {guess.role for guess in candidates}
    omitted = {*_QUATERNION}
    if names >= _QUATERNION:
        omitted = _roles_to_omit(candidates, _QUATERNION, _ANGLES)
    omitted |= {f"{group}.up" for group in ("velocity", "position") if f"{group}.down" in names}
    has_world = {"velocity.north", "velocity.east"} <= names
    omitted |= _roles_to_omit(candidates, _BODY, _WORLD) if has_world else _WORLD
    if has_world or "velocity.u" in names or "velocity.speed" not in names:
        omitted |= _PATH
    else:  # without a course the speed is u
        omitted |= _BODY if "velocity.course" in names else set()
    omitted |= _GEOGRAPHIC if names >= _HORIZONTAL or not names >= _GEOGRAPHIC else _HORIZONTAL
    if len(names & _HORIZONTAL) == 1:
        omitted |= _HORIZONTAL
    if names & {"position.up", "position.down"}:
        omitted.add("position.depth")
    by_confidence = sorted(candidates, key=lambda guess: guess.confidence)
    best = {guess.role: guess for guess in by_confidence if guess.role not in omitted}
    return [guess for guess in candidates if best.get(guess.role) is guess]


def _roles_to_omit(
    guesses: Sequence[Guess], preferred: frozenset[str], alternative: frozenset[str]
) -> set[str]:
    """Return which of two redundant sets to omit: the second, unless its confidence is higher."""
    first, second = (
        min((guess.confidence for guess in guesses if guess.role in roles), default=0)
        for roles in (preferred, alternative)
    )
    return {*(preferred if first < min(SURE_CONFIDENCE, second) else alternative)}


def _file_lines(recording: Recording) -> Iterator[str]:
    """Yield the names of the files of a recording."""
    if recording.files:
        yield "files:    # read together; * is the name of the run"
        yield from (
            f"  {quote_name(name)}: {quote_name(file)}" for name, file in recording.files.items()
        )


def _frame_lines(roles: Roles) -> Iterator[str]:
    upright = roles.vertical_axis
    for sign in upright.evidence:
        yield from _comment(sign.message)
    yield f"frame: {upright.body}    # {upright.confidence} %"
    if upright.body == "FLU":
        yield f"world: {roles.world}"


def _group_lines(used: Sequence[Guess], group: str, roles: Roles) -> Iterator[str]:
    guesses = {
        guess.role.partition(".")[2]: guess for guess in used if guess.role.startswith(f"{group}.")
    }
    if not guesses:
        return
    yield f"{group}:"
    for name, guess in guesses.items():
        flag = roles.flags.get(guess.topic) if group == "velocity" else None
        yield f"  {name}: {_format_entry(guess, flag)}{_confidence_comment(guess)}"
    roles_used = {guess.role for guess in used}
    is_level = "velocity.w" in roles_used and roles_used.isdisjoint(("velocity.p", "velocity.q"))
    absent: dict[str, str] = {}
    if {"roll", "pitch"} & {*guesses} or (is_level and "qw" not in guesses):
        angles = EULER[:2] if "heading" in guesses else EULER
        absent = dict.fromkeys(angles if group == "attitude" else (), _LEVEL)
    is_horizontal = group == "velocity" and {*guesses} & {"north", "course"}
    if is_horizontal and "up" not in guesses and not roles_used.isdisjoint(_TILTS):
        absent = {"down": _LEVEL}
    for name in WRENCH.columns if group == WRENCH.name else ():
        similar = [item for item in roles.without_role if re.search(rf"(^|[^A-Za-z]){name}$", item)]
        omitted = f"`{similar[0]}` is omitted, see below" if similar else ""
        absent[name] = omitted or "not recorded: assumed zero"
    for name, reason in absent.items():
        if name not in guesses:
            yield f"  {name}: {{value: 0.0}}    # {reason}"


def _format_entry(guess: Guess, flag: str | None = None) -> str:
    items = {"unit": guess.unit, "sign": "-1" if guess.sign < 0 else None}
    if guess.is_pulse:
        items |= {"scale": "0.0025", "offset": "-3.75"}
    items |= {"offset": f"{guess.offset:.10g}"} if guess.offset else {}
    items["where"] = None if flag is None else quote_name(flag)
    return format_source(quote_name(guess.column), items)


def _command_lines(guesses: Sequence[Guess]) -> Iterator[str]:
    names = command_names([guess.column for guess in guesses])
    yield from ("commands:",) if guesses else ()
    for name, guess in zip(names, guesses, strict=True):
        unit = guess.unit if guess.unit in ("deg", "cdeg") else None
        yield f"  {name}: {_format_entry(replace(guess, unit=unit))}{_confidence_comment(guess)}"


def _sensor_lines(roles: Roles) -> Iterator[str]:
    body = "FLU" if roles.vertical_axis.body == "FRD" else "FRD"
    mirrored = {"rates": roles.rates.mirrored, "velocity": roles.velocity.mirrored}
    if any(mirrored.values()):
        yield "sensors:    # in other axes than the attitude"
    yield from (f"  {name}: {{axes: {body}}}" for name in mirrored if mirrored[name])


def _step_line(used: Sequence[Guess]) -> Iterator[str]:
    """Yield the steps that derive velocities and rates from the pose."""
    names, steps = {guess.role for guess in used}, list[str]()
    has_position = names >= _HORIZONTAL or names >= _GEOGRAPHIC or names & _VERTICAL
    if has_position and not names & _RECORDED_VELOCITY:
        steps.append("velocity_from_position")
    rates = "pqr" if names & {"attitude.roll", "attitude.pitch", "attitude.qw"} else "r"
    has_attitude = any(name.startswith("attitude.") for name in names)
    if has_attitude and not {f"velocity.{rate}" for rate in rates} <= names:
        steps.append("rates_from_attitude")
    if steps:
        is_depth = "velocity_from_position" in steps and "position.north" not in names
        remark = "; a depth alone gives w of a vehicle that moves vertically"
        yield f"steps: [{', '.join(steps)}]    # not recorded, derived{remark if is_depth else ''}"


def _omitted_columns(
    recording: Recording, roles: Roles, used: Collection[str], equivalent: Mapping[str, str]
) -> Iterator[str]:
    """Yield every omitted column with the reason."""
    reasons: dict[tuple[str, str], list[str]] = {}
    guesses = {guess.column: guess for guess in roles.guesses}
    for topic in recording.topics:
        stem = f"{topic.name}." if topic.name else ""
        clock = roles.clocks.get(topic.name)
        clock_fields = (clock.column, *clock.plus) if clock else ()
        for field in {**topic.fields, **topic.texts, **topic.faults}:
            column = f"{stem}{field}"
            if column in used or field in clock_fields:
                continue
            default = "a time" if is_stamp(field) else "no clock or no number"
            reason = topic.faults.get(field) or roles.without_role.get(column) or default
            if guess := guesses.get(column):
                reason = equivalent.get(column) or _omission_reason(guess, roles)
            elif field not in (*topic.fields, *topic.faults):
                reason = "words"
            message, _, last = field.rpartition("[" if field.endswith("]") else ".")
            group = f"{stem}{message}".rstrip("."), reason
            reasons.setdefault(group, []).append(last.rstrip("]"))
    yield from ("# Omitted:",) if reasons else ()
    for (message, reason), names in reasons.items():
        more = f" and {len(names) - _MAX_NAMES} more" if len(names) > _MAX_NAMES else ""
        listed = f"{' '.join(names[:_MAX_NAMES])}{more} - {reason}"
        yield from _comment(f"{message}: {listed}" if message else listed)


def _omission_reason(guess: Guess, roles: Roles) -> str:
    """Return why a guess is omitted."""
    if guess.role == "flag":
        return "marks valid rows"
    if guess.confidence < MIN_CONFIDENCE:
        return f"possibly {guess.role}, {guess.confidence} %"
    if guess.role == "commands":
        return "too many commands"
    best = roles.best(guess.role)
    is_other = best is not None and best.column != guess.column
    return f"{guess.role} is {best.column if best and is_other else 'given by other columns'}"
