"""Series of plots: columns and channels in an interval of time, and the effect of a step."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from hydrodamp.app.project import MAPPING
from hydrodamp.app.recordings import make_log, read_files, read_log
from hydrodamp.app.web import Form, number, project_of
from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.data.attitude import euler_from_quaternion
from hydrodamp.data.channels import EULER, POSITION
from hydrodamp.data.log import Log
from hydrodamp.ingest.inspection.mapping_editor import add_step, format_content, parse_content
from hydrodamp.report.decimation import DecimatedSeries, encode_times, encode_values
from hydrodamp.report.provenance import horizontal_track

#: Points of a plot, columns that are listed, and points of a plot of two channels.
MAX_POINTS, MAX_COLUMNS, MAX_PAIRS = 1200, 400, 3000

#: Channels of a preview, and its samples on either side of the first change.
MAX_PREVIEWS, PREVIEW_SAMPLES = 6, 100


def column_series(request: Request, form: Form) -> Response:
    """Return the extremes of columns in an interval of time."""
    files = read_files(project_of(request))
    chosen = request.query_params.getlist("column") or [*files.series][:MAX_COLUMNS]
    series = {name: files.series[name] for name in chosen if name in files.series}
    return _answer(request, series, files.extent, files.starts)


def column_pair(request: Request, form: Form) -> Response:
    """Return a column against another in an interval of time; without columns, the track."""
    names = request.query_params.getlist("column")
    if not names:
        return track(request, form)
    series = read_files(project_of(request)).series
    x, y = (series[name] for name in (*names, names[0])[:2] if name in series)
    return _answer_pair(request, x.time, x.values, np.interp(x.time, y.time, y.values))


def log_series(request: Request, form: Form) -> Response:
    """Return velocities and commands of the log in an interval of time."""
    log = read_log(project_of(request))
    channels = log_channels(log)
    names = request.query_params.getlist("column") or [*channels]
    series = {
        name: DecimatedSeries.of(log.elapsed, channels[name]) for name in names if name in channels
    }
    starts = log.elapsed[log.bounds[:, 0]].tolist()
    return _answer(request, series, (0.0, float(log.elapsed[-1])), starts)


def track(request: Request, form: Form) -> Response:
    """Return the horizontal track of the log in an interval of time."""
    log = read_log(project_of(request))
    if horizontal_track(log) is None or log.position is None:
        return JSONResponse({"text": "The log has no position: give columns the roles of one."})
    north, east, _ = log.position.T
    return _answer_pair(request, log.elapsed, east, north)


def _answer_pair(request: Request, time: FloatArray, x: FloatArray, y: FloatArray) -> Response:
    """Return every k-th pair of an interval of time."""
    inside = (time >= number(request, "start", -np.inf)) & (time <= number(request, "end", np.inf))
    rows = np.flatnonzero(inside)
    rows = rows[:: max(-(-len(rows) // MAX_PAIRS), 1)]
    return JSONResponse({
        "t": encode_times(time[rows]), "x": encode_values(x[rows]), "y": encode_values(y[rows]),
    })  # fmt: skip


def _answer(
    request: Request,
    series: Mapping[str, DecimatedSeries],
    extent: tuple[float, float],
    starts: list[float],
) -> Response:
    """Return the points of series in the interval of a query, by default in all of their time."""
    start, end = number(request, "start", extent[0]), number(request, "end", extent[1])
    n = int(min(max(number(request, "n", MAX_POINTS / 2), 1), MAX_POINTS))
    return JSONResponse({
        "start": extent[0],
        "end": extent[1],
        "marks": starts[1:],
        "series": {name: encode(*each.between(start, end, n)) for name, each in series.items()},
    })  # fmt: skip


def encode(time: FloatArray, values: FloatArray) -> dict[str, object]:
    """Return the times and values of a plot as a document."""
    return {"x": encode_times(time), "y": encode_values(values)}


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
    channels = _velocities(log)
    if log.attitude is not None:
        euler = np.degrees(euler_from_quaternion(log.attitude))
        channels |= dict(zip(EULER, euler.T, strict=True))
    if log.position is not None:
        channels |= dict(zip(POSITION.columns, log.position.T, strict=True))
    return channels | _commands(log)


def _velocities(log: Log) -> dict[str, FloatArray]:
    return {name: log.velocity[:, VELOCITIES.index(name)] for name in log.velocity_names}


def _commands(log: Log) -> dict[str, FloatArray]:
    return dict(zip(log.command_names, log.commands.T, strict=True))
