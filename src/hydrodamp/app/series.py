"""Series of plots: columns and channels in an interval of time, and the effect of a step."""

from __future__ import annotations

import base64

import numpy as np
from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from hydrodamp.app.decimation import DecimatedSeries
from hydrodamp.app.mapping_editor import add_step, format_content, parse_content
from hydrodamp.app.project import MAPPING
from hydrodamp.app.recordings import make_log, read_files, read_log
from hydrodamp.app.web import Form, number, project_of
from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.data.attitude import euler_from_quaternion
from hydrodamp.data.log import Log

#: Points of a plot, and columns that are plotted at once.
MAX_POINTS, MAX_COLUMNS = 1200, 400

#: Channels of a preview, and its samples on either side of the first change.
MAX_PREVIEWS, PREVIEW_SAMPLES = 6, 100


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
    document = {"start": first, "end": last, "marks": files.starts[1:], "series": series}
    return JSONResponse(document)


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
    content = add_step(parse_content(project.text(MAPPING), MAPPING), query.get("step", ""))
    after = make_log(project, format_content(content))
    channels = log_channels(before), log_channels(after)
    names = [name for name in query.get("channel", "").split() if name in channels[0]]
    changed = [name for name in channels[0] if _differs(name, *channels)]
    chosen = [name for name in names if name in changed] or changed or names
    n = MAX_POINTS // 4

    def changed_interval(name: str) -> tuple[float, float]:
        """Return an interval around the first samples that change."""
        if len(before.elapsed) != len(after.elapsed):
            return 0.0, np.inf
        changes = np.flatnonzero(channels[0][name] != channels[1].get(name))
        first = int(changes[0]) if len(changes) else 0
        last = min(first + PREVIEW_SAMPLES, before.n - 1)
        moments = before.elapsed[[max(first - PREVIEW_SAMPLES, 0), last]]
        return float(moments[0]), float(moments[1])

    pairs = {}
    for name in chosen[:MAX_PREVIEWS]:
        if name in channels[1]:
            span = changed_interval(name)
            series = (
                DecimatedSeries.of(log.elapsed, each[name])
                for log, each in zip((before, after), channels, strict=True)
            )
            pairs[name] = [encode(*each.between(*span, n)) for each in series]
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


def log_series(request: Request, form: Form) -> Response:
    """Return the velocities and commands of the log, in an interval of time."""
    log = read_log(project_of(request))
    end = float(log.elapsed[-1])
    span = number(request, "start", 0.0), number(request, "end", end)
    channels = log_channels(log)
    series = {
        name: encode(
            *DecimatedSeries.of(log.elapsed, channels[name]).between(*span, MAX_POINTS // 2)
        )
        for name in (*log.velocity_names, *log.command_names)
    }
    marks = [float(log.elapsed[segment.start]) for segment in log.segments[1:]]
    return JSONResponse({"start": 0.0, "end": end, "marks": marks, "series": series})
