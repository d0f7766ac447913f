"""Screen 2: columns with role, unit and sign, their series, and the quality of the log."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from hydrodamp.app.commands import probe_command
from hydrodamp.app.decimation import DecimatedSeries
from hydrodamp.app.mapping_editor import (
    COMMANDS,
    Assignment,
    add_step,
    assign,
    assignments,
    command_name,
    format_content,
    parse_content,
    roles,
    set_frame,
    units_of,
)
from hydrodamp.app.project import MAPPING, Project
from hydrodamp.app.recordings import (
    Files,
    inspect_project,
    make_log,
    parse_mapping,
    read_files,
    read_log,
)
from hydrodamp.app.web import Form, field_value, project_of, render, render_screen
from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.data.attitude import euler_from_quaternion
from hydrodamp.data.log import Log
from hydrodamp.errors import HydrodampError
from hydrodamp.ingest.inspection.draft_files import recommended_step
from hydrodamp.ingest.inspection.probe import Inspection
from hydrodamp.ingest.inspection.quality_report import QualityReport
from hydrodamp.ingest.mapping.channel_schema import VERTICAL_ALIASES
from hydrodamp.ingest.mapping.log_mapping import load_content, resolve_extends

#: Points of a plot, and columns that are plotted at once.
MAX_POINTS, MAX_COLUMNS = 1200, 400

#: Groups onto which a column can be dragged.
DROP_TARGETS = (
    *(f"velocity.{name}" for name in VELOCITIES),
    *(f"attitude.{name}" for name in ("roll", "pitch", "yaw")),
    *(f"position.{name}" for name in ("north", "east", "down", "depth")),
    "commands",
    "time",
)


@dataclass(frozen=True)
class Row:
    """A column of a recording with its role and the evidence for it."""

    number: int
    column: str
    assignment: Assignment
    units: list[str]
    evidence: str
    confidence: int | None

    @property
    def channel(self) -> str:
        """Name of the channel of the log, empty without one."""
        role = self.assignment.role
        name = role.rpartition(".")[2]
        alias = VERTICAL_ALIASES.get(name, (name, 1.0))[0]
        return command_name(self.column, {}) if role == COMMANDS else alias


def show_channels(request: Request, form: Form) -> Response:
    """Return the screen."""
    project = project_of(request)
    return render_screen(project, "channels", probe_command(project), **_variables(project))


def _variables(project: Project) -> dict[str, Any]:
    """Return what depends on the mapping alone, without its checks."""
    files, text = read_files(project), project.text(MAPPING)
    content: dict[str, Any] = {}
    with suppress(HydrodampError):  # the checks say what is wrong
        content = parse_content(text, MAPPING)
    return {
        "facts": list(_facts(project, files)),
        "rows": list(_rows(files, content)),
        "roles": roles(),
        "targets": DROP_TARGETS,
        "text": text,
        "frame": str(content.get("frame") or "FRD"),
        "world": str(content.get("world") or ""),
        "presets": files.probe.presets,
    }


def show_checks(request: Request, form: Form) -> Response:
    """Return the quality report of the log, and the issues of each column."""
    project = project_of(request)
    text, fault, inspection = project.text(MAPPING), "", None
    content: dict[str, Any] = {}
    try:
        content = parse_content(text, MAPPING)
        inspection = inspect_project(project)
    except HydrodampError as error:
        fault = str(error)
    report = None if inspection is None else inspection.report
    issues = [] if report is None else [(each, recommended_step(each)) for each in report.issues]
    return render(
        "checks.html.j2",
        project=project,
        fault=fault or ("" if inspection is None else inspection.reason),
        report=report,
        issues=issues,
        light=_light(report),
        rows=list(_rows(read_files(project), content)),
        by_channel=_issues_by_channel(report),
        vertical=[] if report is None else [*_describe_depth(inspection), report.frame],
    )


def _light(report: QualityReport | None) -> str:
    if report is None or report.missing:
        return "red"
    return "green" if report.is_usable else "amber"


def _issues_by_channel(report: QualityReport | None) -> dict[str, list[str]]:
    channels: dict[str, list[str]] = {}
    for issue in () if report is None else report.issues:
        for name in issue.channel.split():
            channels.setdefault(name, []).append(f"{issue.problem}: {issue.evidence}")
    return channels


def _describe_depth(inspection: Inspection | None) -> Iterator[str]:
    """Yield how far down the log goes by its mapping."""
    log = None if inspection is None else inspection.log
    if log is not None and log.position is not None:
        down = log.position[:, 2] - log.position[0, 2]
        moment = float(log.elapsed[int(np.argmax(np.abs(down)))])
        yield (
            f"By this mapping the vehicle goes from {down.min():+.2g} m to {down.max():+.2g} m "
            f"down from its start, farthest at {moment:.4g} s."
        )


def _facts(project: Project, files: Files) -> Iterator[str]:
    """Yield a sentence on each recording: format, topics, rate and gaps."""
    for path, recording in zip(project.arguments.logs, files.recordings, strict=True):
        topics = [each for each in files.probe.topics if each.rate is not None]
        rates = ", ".join(
            f"{each.name or 'table'} {each.n} rows at {each.rate:.3g} Hz"
            + (f", longest gap {each.longest_gap:.3g} s" if each.longest_gap else "")
            for each in topics[:6]
        )
        more = f" and {len(topics) - 6} more topics" if len(topics) > 6 else ""
        yield f"{path}: {recording.format}. {rates}{more}".rstrip(". ") + "."
        yield from recording.notes[:5]


def _rows(files: Files, content: dict[str, Any]) -> Iterator[Row]:
    """Yield the columns, those with a role first; numbers are those of the recording."""
    names = _real_names(files, content)
    assigned = {names.get(each.column, each.column): each for each in assignments(content)}
    guesses = {each.column: each for each in files.probe.roles.guesses if each.is_best}
    columns = [*enumerate(files.series)][:MAX_COLUMNS]
    for number, column in sorted(columns, key=lambda each: each[1] not in assigned):
        chosen = assigned.get(column, Assignment(column, ""))
        guess = guesses.get(column)
        reason = "" if chosen.role else files.probe.roles.without_role.get(column, "")
        evidence = "; ".join(guess.evidence) if guess else reason
        yield Row(
            number, column, chosen._replace(column=column), units_of(chosen.role), evidence,
            guess.confidence if guess else None,
        )  # fmt: skip


def _real_names(files: Files, content: dict[str, Any]) -> dict[str, str]:
    """Return the columns of the recordings by their names with the topics of the mapping."""
    topics = content.get("topics")
    names: dict[str, str] = {}
    for alias, options in topics.items() if isinstance(topics, dict) else ():
        listed = [options] if isinstance(options, str) else options or []
        for column in files.series:
            for topic in listed:
                if column.startswith(f"{topic}."):
                    names.setdefault(f"{alias}.{column.removeprefix(f'{topic}.')}", column)
    return names


def _render_change(project: Project) -> Response:
    """Return the fragment that depends on the mapping."""
    return render(
        "channels_change.html.j2",
        project=project,
        version=project.version,
        **_variables(project),
    )


def _write(project: Project, form: Form, text: str) -> Response:
    parse_mapping(text)  # raises its faults before anything is written
    project.write(field_value(form, "version"), {MAPPING: text})
    return _render_change(project)


def change_column(request: Request, form: Form) -> Response:
    """Set role, unit and sign of a column."""
    project = project_of(request)
    role, unit = field_value(form, "role"), field_value(form, "unit")
    unit = unit if unit in units_of(role) else ""
    new = Assignment(
        field_value(form, "column"), role, unit, -1 if field_value(form, "sign") == "-1" else 1
    )
    content = assign(_content(project), new)
    project.write(field_value(form, "version"), {MAPPING: format_content(content)})
    return _render_change(project)


def change_frame(request: Request, form: Form) -> Response:
    """Set the axes of body and world."""
    project = project_of(request)
    frame, world = field_value(form, "frame", "FRD"), field_value(form, "world")
    allowed = ("NED",) if frame == "FRD" else ("NWU", "ENU")
    world = world if world in allowed else allowed[0]
    return _write(project, form, format_content(set_frame(_content(project), frame, world)))


def apply_step(request: Request, form: Form) -> Response:
    """Add a cleaning step."""
    project = project_of(request)
    return _write(
        project, form, format_content(add_step(_content(project), field_value(form, "step")))
    )


def apply_preset(request: Request, form: Form) -> Response:
    """Take the mapping of a preset."""
    project, name = project_of(request), field_value(form, "preset")
    if name not in {each.name for each in read_files(project).probe.presets}:
        raise HydrodampError(f"the preset `{name}` does not match the log")
    content, path = load_content(name)
    resolved = resolve_extends(content, path) if isinstance(content, dict) else {}
    return _write(project, form, format_content(resolved))


def change_text(request: Request, form: Form) -> Response:
    """Write the text of the mapping."""
    text = field_value(form, "text").replace("\r\n", "\n")
    return _write(project_of(request), form, text)


def _content(project: Project) -> dict[str, Any]:
    return parse_content(project.text(MAPPING), MAPPING)


def column_series(request: Request, form: Form) -> Response:
    """Return the extremes of columns in an interval of time."""
    files, query = read_files(project_of(request)), request.query_params
    chosen = query.getlist("column") or [*files.series][:MAX_COLUMNS]
    series = {name: files.series[name] for name in chosen if name in files.series}
    spans = [each.time[[0, -1]] for each in series.values() if len(each.time)]
    extent = (min(a for a, _ in spans), max(b for _, b in spans)) if spans else (0.0, 1.0)
    start, end = float(query.get("start", extent[0])), float(query.get("end", extent[1]))
    n = min(int(query.get("n", MAX_POINTS // 2)), MAX_POINTS)
    return JSONResponse({
        "start": float(extent[0]),
        "end": float(extent[1]),
        "series": {name: encode(*each.between(start, end, n)) for name, each in series.items()},
    })  # fmt: skip


def encode(time: FloatArray, values: FloatArray) -> dict[str, str]:
    """Return times (float64) and values (float32) in base 64."""
    return {
        "x": base64.b64encode(np.ascontiguousarray(time, "<f8").tobytes()).decode("ascii"),
        "y": base64.b64encode(np.ascontiguousarray(values, "<f4").tobytes()).decode("ascii"),
    }


def preview_step(request: Request, form: Form) -> Response:
    """Return the channels of an issue before and after a cleaning step."""
    project, query = project_of(request), request.query_params
    before = read_log(project)
    content = add_step(_content(project), query.get("step", ""))
    after = make_log(project, format_content(content))
    channels = log_channels(before), log_channels(after)
    names = [name for name in query.get("channel", "").split() if name in channels[0]]
    changed = [name for name in channels[0] if _differs(name, *channels)]
    chosen = [name for name in names if name in changed] or changed or names
    n = MAX_POINTS // 4
    pairs = {
        name: [encode(*DecimatedSeries.of(log.elapsed, each[name]).between(0.0, np.inf, n))
               for log, each in zip((before, after), channels, strict=True)]
        for name in chosen[:6]
        if name in channels[1]
    }  # fmt: skip
    return JSONResponse({"series": pairs})


def _differs(name: str, before: dict[str, FloatArray], after: dict[str, FloatArray]) -> bool:
    return name not in after or not np.array_equal(before[name], after[name], equal_nan=True)


def log_channels(log: Log) -> dict[str, FloatArray]:
    """Return the channels of a log by name, angles in degrees."""
    channels = {name: log.velocity[:, VELOCITIES.index(name)] for name in log.velocity_names}
    if log.attitude is not None:
        euler = np.degrees(euler_from_quaternion(log.attitude))
        channels |= dict(zip(("roll", "pitch", "yaw"), euler.T, strict=True))
    if log.position is not None:
        channels |= dict(zip(("north", "east", "down"), log.position.T, strict=True))
    return channels | dict(zip(log.command_names, log.commands.T, strict=True))
