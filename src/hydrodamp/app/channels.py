"""Screen 2: columns with role, unit and sign, their series, and the quality of the log."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, cast, get_args, get_type_hints

import numpy as np
from starlette.requests import Request
from starlette.responses import Response

from hydrodamp.app.project import MAPPING, Project
from hydrodamp.app.recordings import (
    Files,
    parse_mapping,
    read_files,
    resolve_content,
)
from hydrodamp.app.series import MAX_COLUMNS
from hydrodamp.app.web import Form, field_value, project_of, render_screen
from hydrodamp.conditioning.consistency import Fix
from hydrodamp.errors import HydrodampError, LogError
from hydrodamp.ingest.inspection.mapping_editor import (
    COMMANDS,
    Assignment,
    Content,
    assign,
    assignments,
    correct,
    format_content,
    parse_content,
    roles,
    set_frame,
    units_of,
)
from hydrodamp.ingest.inspection.probe import topic_facts
from hydrodamp.ingest.mapping.channel_schema import VERTICAL_ALIASES
from hydrodamp.ingest.mapping.log_mapping import default_world, load_content, resolve_extends
from hydrodamp.report.decimation import DecimatedSeries

#: Role of the four components of an attitude in one column.
QUATERNION = "attitude.quaternion"

#: Intervals of a sparkline; its box has this width.
SPARK = 40

#: Channels of the first panel, and of the second.
FIRST_PANELS = (("u", "v", "w"), ("p", "q", "r", "yaw"))


@dataclass(frozen=True)
class Row:
    """A column of a recording with its role and the evidence for it."""

    number: int
    column: str
    assignment: Assignment
    units: list[str]
    evidence: str
    confidence: int | None
    spark: str

    @property
    def unit(self) -> str:
        """The unit of the values as recorded, empty where it is not known."""
        known = self.assignment.unit or next(filter(None, self.units), "")
        return known if self.assignment.role else ""

    @property
    def channels(self) -> list[str]:
        """Names of the channels of the log that the column gives."""
        name = self.assignment.channel
        if name == "quaternion":
            return ["roll", "pitch", "yaw"]
        return [VERTICAL_ALIASES.get(name, (name, 1.0))[0]] if name else []


def show_channels(request: Request, form: Form) -> Response:
    """Return the screen."""
    project = project_of(request)
    files, text = read_files(project), project.text(MAPPING)
    content = displayed_content(project)
    rows = list(list_rows(files, content))
    return render_screen(
        request,
        project,
        "channels",
        facts=list(_facts(project, files)),
        rows=rows,
        roles=roles(),
        panels=_first_panels(rows),
        text=text,
        **_axes(content),
        presets=files.probe.presets,
    )


def _first_panels(rows: list[Row]) -> list[list[str]]:
    """Return the columns of the panels that the page begins with: velocities, rates, commands."""
    roles_of = {row.column: row.assignment.role for row in rows}
    panels = [
        [each for each, role in roles_of.items() if role.partition(".")[2] in names][: len(names)]
        for names in FIRST_PANELS
    ]
    panels.append([each for each, role in roles_of.items() if role == COMMANDS][:4])
    return [panel for panel in panels if panel] or [[row.column] for row in rows[1:3]]


def displayed_content(project: Project) -> Content:
    """Return the content of a mapping, of the draft for a canonical log without channels."""
    try:
        content = resolve_content(project, project.text(MAPPING))
    except HydrodampError:  # the checks say what is wrong
        return {}
    files = read_files(project)
    if set(content) <= {"steps"} and files.is_canonical:
        return {**parse_content(files.probe.draft.text, MAPPING), **content}
    return content


def _facts(project: Project, files: Files) -> Iterator[str]:
    """Yield a sentence on each recording: format, topics, rate and gaps."""
    logs = project.arguments.logs
    for path, recording, clocks in zip(logs, files.recordings, files.clocks, strict=False):
        facts = [topic_facts(topic, clocks.get(topic.name)) for topic in recording.topics]
        topics = [each for each in facts if each.rate is not None]
        rates = ", ".join(
            f"{each.name or 'table'} {each.n} rows at {each.rate:.3g} Hz"
            + (f", longest gap {each.longest_gap:.3g} s" if each.longest_gap else "")
            for each in topics[:6]
        )
        more = f" and {len(topics) - 6} more topics" if len(topics) > 6 else ""
        yield f"{path}: {recording.format}. {rates}{more}".rstrip(". ") + "."
        yield from recording.notes[:5]


def list_rows(files: Files, content: Content) -> Iterator[Row]:
    """Yield the columns, those with a role first; numbers are those of the recording."""
    aliases = _real_names(files, content)
    real = {alias: column for column, alias in aliases.items()}
    assigned = {real.get(each.column, each.column): each for each in assignments(content)}
    guesses = {each.column: each for each in files.probe.roles.guesses if each.is_best}
    ordered = sorted(enumerate(files.series), key=lambda each: each[1] not in assigned)
    for index, column in ordered[:MAX_COLUMNS]:
        chosen = assigned.get(column, Assignment(aliases.get(column, column), ""))
        guess = guesses.get(column)
        reason = "" if chosen.role else files.probe.roles.without_role.get(column, "")
        evidence = "; ".join(guess.evidence) if guess else reason
        yield Row(
            index, column, chosen, _units(chosen), evidence,
            guess.confidence if guess else None, _sparkline(files.series[column]),
        )  # fmt: skip


def _sparkline(series: DecimatedSeries) -> str:
    """Return the points of a series in a box of SPARK by 1."""
    time, values = series.between(-np.inf, np.inf, SPARK)
    inside = np.isfinite(values)
    if not inside.any():
        return ""
    time, values = time[inside], values[inside]
    x = SPARK * (time - time[0]) / (np.ptp(time) or 1.0)
    y = 1.0 - (values - values.min()) / (np.ptp(values) or 1.0)
    return " ".join(f"{a:.1f},{b:.2f}" for a, b in zip(x.tolist(), y.tolist(), strict=True))


def _units(assignment: Assignment) -> list[str]:
    """Return the units of a role, with that of the mapping in whatever spelling."""
    units = units_of(assignment.role)
    return units if assignment.unit in units else [*units, assignment.unit]


def _real_names(files: Files, content: Content) -> dict[str, str]:
    """Return the names that columns have in the mapping, by the topics that it names."""
    topics = content.get("topics")
    names: dict[str, str] = {}
    for alias, options in topics.items() if isinstance(topics, dict) else ():
        listed = options if isinstance(options, list) else [options]
        for column in files.series:
            for topic in listed:
                if column.startswith(f"{topic}."):
                    names.setdefault(column, f"{alias}.{column.removeprefix(f'{topic}.')}")
    return names


def _write(request: Request, form: Form, text: str, note: str = "") -> Response:
    """Write the mapping and return the parts of the page that depend on it."""
    project = project_of(request)
    before = {row.number: row for row in list_rows(read_files(project), displayed_content(project))}
    project.write(field_value(form, "version"), {MAPPING: text})
    content = displayed_content(project)
    changed = [
        row for row in list_rows(read_files(project), content) if row != before.get(row.number)
    ]
    return render_screen(
        request,
        project,
        "channels",
        "channels_change.html.j2",
        note=note,
        rows=changed,
        roles=roles(),
        text=text,
        **_axes(content),
    )


def _axes(content: Content) -> dict[str, str]:
    """Return the axes of body and world of a mapping."""
    frame = str(content.get("frame") or "FRD")
    return {"frame": frame, "world": str(content.get("world") or default_world(content))}


def _content(project: Project) -> Content:
    return parse_content(project.text(MAPPING), MAPPING)


def _own_content(project: Project) -> Content:
    """Return the content of the mapping; the channels of a canonical log become its own."""
    content = _content(project)
    return content if set(content) - {"steps"} else displayed_content(project)


def change_column(request: Request, form: Form) -> Response:
    """Set role, unit and sign of a column."""
    project = project_of(request)
    role, unit = field_value(form, "role"), field_value(form, "unit")
    known = {each for group in roles().values() for each in group}
    if role not in known and role != QUATERNION:
        raise LogError(f"there is no role `{role}`")
    content, displayed = _own_content(project), displayed_content(project)
    sign = -1 if field_value(form, "sign") == "-1" else 1
    known_units = {each.unit for each in assignments(displayed)}
    unit = unit if unit in {*units_of(role), *known_units} else ""
    new = Assignment(field_value(form, "column"), role, unit, sign)
    displaced = [
        each.column
        for each in assignments(displayed)
        if each.role == role not in ("", COMMANDS) and each.column != new.column
    ]
    note = f"{role} had the column {displaced[0]}, which is not used now." if displaced else ""
    return _write(request, form, format_content(assign(content, new, displayed)), note)


def change_frame(request: Request, form: Form) -> Response:
    """Set the axes of body and world."""
    project = project_of(request)
    frame, world = field_value(form, "frame", "FRD"), field_value(form, "world")
    allowed = ("NED",) if frame == "FRD" else ("NWU", "ENU")
    world = world if world in allowed else allowed[0]
    return _write(request, form, format_content(set_frame(_content(project), frame, world)))


def apply_fix(request: Request, form: Form) -> Response:
    """Apply the correction of an issue: a cleaning step, unit, sign, delay, axes or omission."""
    project, kind = project_of(request), field_value(form, "kind", "step")
    if kind not in get_args(get_type_hints(Fix)["kind"]):
        raise LogError(f"there is no correction `{kind}`")
    fix = Fix(cast(Any, kind), field_value(form, "step"))
    displayed, channels = displayed_content(project), field_value(form, "channel").split()
    changed = correct(_own_content(project), fix, channels, displayed)
    return _write(request, form, format_content(changed))


def apply_preset(request: Request, form: Form) -> Response:
    """Take the mapping of a preset."""
    project, name = project_of(request), field_value(form, "preset")
    if name not in {each.name for each in read_files(project).probe.presets}:
        raise LogError(f"the preset `{name}` does not match the log")
    content, path = load_content(name)
    resolved = resolve_extends(content, path) if isinstance(content, dict) else {}
    return _write(request, form, format_content(resolved))


def change_text(request: Request, form: Form) -> Response:
    """Write the text of the mapping if it is one."""
    project, text = project_of(request), field_value(form, "text").replace("\r\n", "\n")
    parse_mapping(project, text)  # raises its faults before anything is written
    return _write(request, form, text)
