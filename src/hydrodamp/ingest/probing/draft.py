"""A mapping file drafted from guesses: short, explicit, every line with its confidence."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hydrodamp.basis.atoms import check_command_name
from hydrodamp.data.channels import ATTITUDE, EULER, RESERVED
from hydrodamp.data.recording import Recording
from hydrodamp.errors import HydrodampError
from hydrodamp.ingest.probing.roles import Guess, Roles

#: Confidence [%] below which a guess is left out.
LEAST = 40

_PLAIN_REASONS = ("name", "name and unit")  # go without saying
_GROUPS = ("attitude", "velocity", "position", "specific_force")
_COMMANDS = 24  # more are no draft, but a list
_WIDTH = 86
_PLAIN = re.compile(r"[A-Za-z_/][\w./ -]*\w|[A-Za-z_]")
_WORDS = frozenset(("y", "n", "yes", "no", "on", "off", "true", "false", "null", "none"))
_GENERIC = frozenset(["data", "value", "x", "y", "z", "output", "input", "xyz", "channels"])


@dataclass(frozen=True)
class Draft:
    """A mapping file, and how far to trust it."""

    text: str
    confidence: int


def draft(recording: Recording, roles: Roles) -> Draft:
    """Write a mapping file from guesses."""
    used, name = _used(roles), Path(recording.source).name
    motion = [one for one in used if one.role.startswith(("velocity.", "attitude."))]
    has_velocity = any(one.role.startswith("velocity.") for one in motion)
    lines = [
        *_told(f"Drafted by `hydrodamp probe` from {name or 'a recording'}; check every line."),
        *_files(recording),
        *_axes(roles),
        *_time(recording, roles, used),
        *(line for group in _GROUPS for line in _group(used, group, roles)),
        *_commands(roles),
        *_sensors(roles),
        *_steps(used),
    ]
    least = min((one.confidence for one in motion), default=0)
    return Draft("\n".join(lines) + "\n", least if has_velocity else 0)


def _told(text: str) -> list[str]:
    """Return a comment, broken into lines."""
    return [f"# {line}" for line in textwrap.wrap(" ".join(text.split()), _WIDTH)]


def _sure(one: Guess) -> str:
    """Return the comment behind a line: how sure it is, and why."""
    seen = [each for each in one.evidence if each not in _PLAIN_REASONS]
    why = " ".join("; ".join(seen).split())
    return f"    # {one.confidence} %{f': {why}' if why else ''}"


def _used(roles: Roles) -> list[Guess]:
    """Return the channels of the draft: one way to say each thing."""
    sure = [one for one in roles.guesses if one.chosen and one.confidence >= LEAST]
    there = [one for one in sure if "." in one.role]
    names = {one.role for one in there}
    parts = {f"attitude.{name}" for name in ATTITUDE.columns}
    out = {f"attitude.{name}" for name in (*EULER, "heading")} if parts <= names else parts
    if "attitude.yaw" in names:
        out.add("attitude.heading")
    lone = len(names & {"velocity.north", "velocity.east"}) < 2
    if lone or names & {"velocity.u", "velocity.v"}:
        out |= {f"velocity.{name}" for name in ("north", "east", "down", "up")}
    if len(names & {"position.north", "position.east"}) == 1:
        out |= {"position.north", "position.east"}
    if names & {"position.up", "position.down"}:
        out.add("position.depth")
    return [one for one in there if one.role not in out]


def _files(recording: Recording) -> Iterator[str]:
    """Say which files make one recording, so that any of them stands for all."""
    if recording.files:
        yield "files:    # read together; * is what names the run"
        yield from (f"  {_quoted(name)}: {_quoted(file)}" for name, file in recording.files.items())


def _axes(roles: Roles) -> Iterator[str]:
    upright = roles.upright
    for sign in upright.signs:
        yield from _told(sign.told)
    yield f"frame: {upright.body}    # {upright.confidence} %"
    if upright.body == "FLU":
        yield f"world: {roles.world}"


def _time(recording: Recording, roles: Roles, used: Sequence[Guess]) -> Iterator[str]:
    if given := roles.all_of("time"):
        first = given[0]
        own = roles.clocks[first.topic].column if len(given) > 1 else None
        column = own or first.column
        yield f"time: {{column: {_quoted(column)}, unit: {first.unit}}}{_sure(first)}"
        return
    stamped = any("header.stamp" in recording.topic(one.topic).fields for one in used)
    yield "time: [header.stamp, recorded]" if stamped else "time: recorded"


def _group(used: Sequence[Guess], group: str, roles: Roles) -> Iterator[str]:
    inside = [one for one in used if one.role.startswith(f"{group}.")]
    if not inside:
        return
    yield f"{group}:"
    names = [one.role.partition(".")[2] for one in inside]
    for one, name in zip(inside, names, strict=True):
        flag = roles.flags.get(one.topic) if group == "velocity" else None
        yield f"  {name}: {_entry(one, flag)}{_sure(one)}"
    if group == "attitude" and {"roll", "pitch"} & set(names):
        for name in ("roll", "pitch", "yaw"):
            if name not in names and not (name == "yaw" and "heading" in names):
                yield f"  {name}: {{value: 0.0}}    # not recorded: taken as level"


def _entry(one: Guess, flag: str | None = None) -> str:
    said = [f"column: {_quoted(one.column)}"]
    if one.unit is not None:
        said.append(f"unit: {one.unit}")
    if one.sign < 0:
        said.append("sign: -1")
    if flag is not None:
        said.append(f"where: {_quoted(flag)}")
    return _quoted(one.column) if len(said) == 1 else f"{{{', '.join(said)}}}"


def _commands(roles: Roles) -> Iterator[str]:
    found = [one for one in roles.all_of("commands") if one.confidence >= LEAST][:_COMMANDS]
    if not found:
        return
    yield "commands:"
    for name, one in zip(command_names([one.column for one in found]), found, strict=True):
        if one.unit not in (None, "deg", "cdeg"):
            one = replace(one, unit=None)
        yield f"  {name}: {_entry(one)}{_sure(one)}"


def command_names(columns: Sequence[str]) -> list[str]:
    """Return short names of commands that terms may hold."""
    names: list[str] = []
    for column in columns:
        topic, _, last = column.rpartition(".")
        is_generic = last.partition("[")[0].lower() in _GENERIC
        short = "/".join(topic.split("/")[-2:]) + f".{last}" if is_generic else last
        short = short.removesuffix(".data") if topic else short
        tries = (short, column, *(f"{column}_{k}" for k in range(2, 99)))
        names.append(next(name for one in tries if (name := _allowed(one)) not in names))
    return names


def _allowed(text: str) -> str:
    """Return a name that a term may hold."""
    name = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_") or "command"
    name = f"c{name}" if name[0].isdigit() else name
    try:
        check_command_name(name)
    except HydrodampError:
        return f"{name}_command"
    return f"{name}_command" if name in RESERVED or name.lower() in _WORDS else name


def _sensors(roles: Roles) -> Iterator[str]:
    other = "FLU" if roles.upright.body == "FRD" else "FRD"
    turned = (("rates", roles.rates.mirrored), ("velocity", roles.way.mirrored))
    lines = [f"  {name}: {{axes: {other}}}" for name, is_turned in turned if is_turned]
    yield from ("sensors:    # in other axes than the attitude", *lines) if lines else ()


def _steps(used: Sequence[Guess]) -> Iterator[str]:
    """Ask for rates that were not recorded, where there is an attitude."""
    names = {one.role for one in used}
    angles = {"attitude.roll", "attitude.pitch", "attitude.qw"}
    wanted = {"r", "p", "q"} if names & angles else {"r"}
    there = any(name.startswith("attitude.") for name in names)
    if there and not {f"velocity.{rate}" for rate in wanted} <= names:
        yield "steps: [rates_from_attitude]    # rates were not recorded"


def _quoted(text: str) -> str:
    """Return a YAML scalar that is this text."""
    plain = _PLAIN.fullmatch(text) and text.lower() not in _WORDS
    return text if plain else json.dumps(text, ensure_ascii=False)
