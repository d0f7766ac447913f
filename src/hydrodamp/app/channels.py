"""Screen 2: columns with role, unit and sign, their series, and the quality of the log."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from hydrodamp.app.commands import probe_command
from hydrodamp.app.decimation import DecimatedSeries
from hydrodamp.app.mapping_editor import (
    COMMANDS,
    Assignment,
    Content,
    add_step,
    assign,
    assignments,
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
    resolve_content,
)
from hydrodamp.app.web import Form, field_value, number, project_of, render, render_screen
from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.data.attitude import euler_from_quaternion
from hydrodamp.data.log import Log
from hydrodamp.errors import HydrodampError, LogError
from hydrodamp.ingest.inspection.columns import find_clocks
from hydrodamp.ingest.inspection.draft_files import recommended_step
from hydrodamp.ingest.inspection.probe import Inspection, topic_facts
from hydrodamp.ingest.inspection.quality_report import QualityReport
from hydrodamp.ingest.mapping.channel_schema import VERTICAL_ALIASES
from hydrodamp.ingest.mapping.log_mapping import default_world, load_content, resolve_extends

#: Points of a plot, and columns that are plotted at once.
MAX_POINTS, MAX_COLUMNS = 1200, 400

#: Samples of a preview on either side of the first change.
PREVIEW_SAMPLES = 100

#: Role of the four components of an attitude in one column.
QUATERNION = "attitude.quaternion"

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
    def channels(self) -> list[str]:
        """Names of the channels of the log that the column gives."""
        name = self.assignment.channel
        if name == "quaternion":
            return ["roll", "pitch", "yaw"]
        return [VERTICAL_ALIASES.get(name, (name, 1.0))[0]] if name else []


def show_channels(request: Request, form: Form) -> Response:
    """Return the screen."""
    project = project_of(request)
    version, files, text = project.version, read_files(project), project.text(MAPPING)
    content = _displayed_content(project, text)
    return render_screen(
        project,
        "channels",
        version,
        probe_command(project),
        facts=list(_facts(project, files)),
        rows=list(_rows(files, content)),
        roles=roles(),
        targets=DROP_TARGETS,
        text=text,
        **_axes(content),
        presets=files.probe.presets,
    )


def _displayed_content(project: Project, text: str) -> Content:
    """Return the content of a mapping, of the draft for a canonical log without channels."""
    try:
        content = resolve_content(project, text)
    except HydrodampError:  # the checks say what is wrong
        return {}
    files = read_files(project)
    if set(content) <= {"steps"} and files.is_canonical:
        return {**parse_content(files.probe.draft.text, MAPPING), **content}
    return content


def show_checks(request: Request, form: Form) -> Response:
    """Return the quality report of the log, and the issues of each column."""
    project = project_of(request)
    text, fault, inspection = project.text(MAPPING), "", None
    try:
        inspection = inspect_project(project)
    except HydrodampError as error:
        fault = str(error)
    report = None if inspection is None else inspection.report
    issues = [] if report is None else [(each, recommended_step(each)) for each in report.issues]
    by_channel = _issues_by_channel(report)
    rows = _rows(read_files(project), _displayed_content(project, text))
    return render(
        "checks.html.j2",
        project=project,
        fault=fault or ("" if inspection is None else inspection.reason),
        report=report,
        issues=issues,
        light=_light(report),
        rows=[
            (row, [text for name in row.channels for text in by_channel.get(name, [])])
            for row in rows
        ],
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
    for path, recording in zip(project.arguments.logs, files.recordings, strict=False):
        clocks = find_clocks(recording)
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


def _rows(files: Files, content: Content) -> Iterator[Row]:
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
            guess.confidence if guess else None,
        )  # fmt: skip


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


def _write(project: Project, form: Form, text: str, note: str = "") -> Response:
    """Write the mapping and return the parts of the page that depend on it."""
    before = {row.number: row for row in _rows(read_files(project), _content(project)[1])}
    project.write(field_value(form, "version"), {MAPPING: text})
    version, content = project.version, _displayed_content(project, text)
    changed = [row for row in _rows(read_files(project), content) if row != before.get(row.number)]
    return render(
        "channels_change.html.j2",
        project=project,
        version=version,
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


def _content(project: Project) -> tuple[Content, Content]:
    """Return the content of the mapping, and what the page shows of it."""
    text = project.text(MAPPING)
    return parse_content(text, MAPPING), _displayed_content(project, text)


def change_column(request: Request, form: Form) -> Response:
    """Set role, unit and sign of a column."""
    project = project_of(request)
    role, unit = field_value(form, "role"), field_value(form, "unit")
    known = {each for group in roles().values() for each in group}
    if role not in known and role != QUATERNION:
        raise LogError(f"there is no role `{role}`")
    content, displayed = _content(project)
    if not set(content) - {"steps"}:  # a canonical log: its channels become those of the mapping
        content = displayed
    sign = -1 if field_value(form, "sign") == "-1" else 1
    known_units = {unit for each in assignments(displayed) for unit in (each.unit,)}
    unit = unit if unit in {*units_of(role), *known_units} else ""
    new = Assignment(field_value(form, "column"), role, unit, sign)
    displaced = [
        each.column
        for each in assignments(displayed)
        if each.role == role not in ("", COMMANDS) and each.column != new.column
    ]
    note = f"{role} had the column {displaced[0]}, which is not used now." if displaced else ""
    return _write(project, form, format_content(assign(content, new, displayed)), note)


def change_frame(request: Request, form: Form) -> Response:
    """Set the axes of body and world."""
    project = project_of(request)
    frame, world = field_value(form, "frame", "FRD"), field_value(form, "world")
    allowed = ("NED",) if frame == "FRD" else ("NWU", "ENU")
    world = world if world in allowed else allowed[0]
    return _write(project, form, format_content(set_frame(_content(project)[0], frame, world)))


def apply_step(request: Request, form: Form) -> Response:
    """Add a cleaning step."""
    project = project_of(request)
    content = add_step(_content(project)[0], field_value(form, "step"))
    return _write(project, form, format_content(content))


def apply_preset(request: Request, form: Form) -> Response:
    """Take the mapping of a preset."""
    project, name = project_of(request), field_value(form, "preset")
    if name not in {each.name for each in read_files(project).probe.presets}:
        raise LogError(f"the preset `{name}` does not match the log")
    content, path = load_content(name)
    resolved = resolve_extends(content, path) if isinstance(content, dict) else {}
    return _write(project, form, format_content(resolved))


def change_text(request: Request, form: Form) -> Response:
    """Write the text of the mapping if it is one."""
    project, text = project_of(request), field_value(form, "text").replace("\r\n", "\n")
    parse_mapping(project, text)  # raises its faults before anything is written
    return _write(project, form, text)


def column_series(request: Request, form: Form) -> Response:
    """Return the extremes of columns in an interval of time."""
    files = read_files(project_of(request))
    chosen = request.query_params.getlist("column") or [*files.series][:MAX_COLUMNS]
    first, last = files.extent
    start, end = number(request, "start", first), number(request, "end", last)
    n = int(min(max(number(request, "n", MAX_POINTS / 2), 1), MAX_POINTS))
    series = {
        name: encode(*files.series[name].between(start, end, n))
        for name in chosen
        if name in files.series
    }
    return JSONResponse({"start": first, "end": last, "series": series})


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
    content = add_step(_content(project)[0], query.get("step", ""))
    after = make_log(project, format_content(content))
    channels = log_channels(before), log_channels(after)
    names = [name for name in query.get("channel", "").split() if name in channels[0]]
    changed = [name for name in channels[0] if _differs(name, *channels)]
    chosen = [name for name in names if name in changed] or changed or names
    n = MAX_POINTS // 4

    def _around(name: str) -> tuple[float, float]:
        """Return an interval around the first samples that change."""
        if len(before.elapsed) != len(after.elapsed):
            return 0.0, np.inf
        changes = np.flatnonzero(channels[0][name] != channels[1].get(name))
        first = int(changes[0]) if len(changes) else 0
        last = min(first + PREVIEW_SAMPLES, before.n - 1)
        moments = before.elapsed[[max(first - PREVIEW_SAMPLES, 0), last]]
        return float(moments[0]), float(moments[1])

    pairs = {
        name: [encode(*DecimatedSeries.of(log.elapsed, each[name]).between(*_around(name), n))
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
