"""Data of the interactive time series of a page: replays, and any channels of a log."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import AXES
from hydrodamp.data.log import Log
from hydrodamp.identification.predicted_error import PredictionBand
from hydrodamp.report.decimation import clock, encode_times, encode_values, trace
from hydrodamp.report.figures import style
from hydrodamp.report.pictures import band_caption
from hydrodamp.report.table import percent
from hydrodamp.validation.compare import Comparison, Row

MAX_REPLAYS = 32  # replays drawn, those with the lowest errors
MAX_VALUES = 600_000  # values of all series together, 1.6 MB as text
MAX_POINTS = 20_000  # points of one series
LINE_WIDTH = 1.5  # px
MAX_MARGIN = 4.5  # of a panel beyond the measurements, as a share of their range


class Panel(NamedTuple):
    """Channels by name, and the ends of a band; of replays, the first channel is measured."""

    label: str
    channels: dict[str, FloatArray]
    band: tuple[FloatArray, ...] = ()
    is_downward: bool = False
    is_replay: bool = False


def series_document(log: Log, panels: Sequence[Panel]) -> dict[str, Any]:
    """Return the document of panels over the time of a log."""
    lines = (len(each.channels) * (1 + each.is_replay) + len(each.band) for each in panels)
    n_points = min(MAX_VALUES // max(sum(lines), 1), MAX_POINTS)
    time = clock(log)

    def encode(values: FloatArray) -> dict[str, object]:
        return encode_values(trace(log, values, n_points)[1])

    def encode_panel(panel: Panel) -> dict[str, object]:
        first, *_ = panel.channels.values()
        span = MAX_MARGIN * float(np.nanmax(first) - np.nanmin(first))
        limits = [float(np.nanmin(first)) - span, float(np.nanmax(first)) + span]
        return {
            "label": panel.label,
            "downward": panel.is_downward,
            "limits": limits if panel.is_replay and span > 0.0 else None,
            "names": [*panel.channels],
            "series": [encode(values) for values in panel.channels.values()],
            "residuals": [encode(values - first) for values in panel.channels.values()]
            if panel.is_replay
            else None,
            "band": [encode(end) for end in panel.band],
        }

    moments = trace(log, time, n_points)[0]
    segments = [
        {"name": each.name, "start": time[each.start], "stop": time[each.stop - 1]}
        for each in log.segments
    ]
    return {
        "time": encode_times(moments),
        "segments": segments,
        "palette": style.SERIES,
        "lines": [],
        "band": None,
        "panels": [*map(encode_panel, panels)],
        "is_thinned": len(moments) < log.n + len(segments) - 1,
        "left_out": 0,
    }


def replay_series(
    comparison: Comparison, rows: Sequence[Row], band: PredictionBand | None = None
) -> dict[str, Any] | None:
    """Return the document of measured and replayed velocities, rows in order of preference."""
    runs = [(row, row.trajectory) for row in rows if row.trajectory is not None]
    if not runs:
        return None
    best_runs, log, unit = runs[:MAX_REPLAYS], runs[0][1].log, comparison.rate_unit

    def name_of(row: Row) -> str:
        return f"{row.model} by {row.method}" if len(comparison.methods) > 1 else row.model

    ends = () if band is None else (band.lower, band.upper)

    def panel(name: str) -> Panel:
        def convert(velocity: FloatArray) -> FloatArray:
            return style.shown_velocities(velocity, name, unit)

        channels = {"measured": convert(log.velocity)} | {
            f"{name_of(row)}{_fit(row.score.fit_by_axis[name])}": convert(run.velocity)
            for row, run in best_runs
        }
        label = f"{name} [{style.velocity_unit(name, unit)}]"
        return Panel(label, channels, tuple(map(convert, ends)), is_replay=True)

    panels = [*map(panel, runs[0][0].score.rms_by_axis), *recorded_panels(log)]
    looks = style.line_styles([(row.model, row.method) for row, _ in best_runs])
    colours = style.model_colours(comparison.models)  # those of the table, whatever is shown
    first = runs[0][0]
    return series_document(log, panels) | {
        "lines": [
            {
                "label": f"{name_of(row)}{_fit(_mean_fit(row))}",
                "model": row.model,
                "colour": colours[row.model],
                "dashes": [round(LINE_WIDTH * length, 1) for length in look.dashes],
            }
            for (row, _), look in zip(best_runs, looks, strict=True)
        ],
        "band": band
        and {
            "label": f"{100.0 * band.level:.0f} % band of {name_of(first)}",
            "model": first.model,
            "caption": band_caption(first),
            "colour": colours[first.model],
        },
        "left_out": len(runs) - len(best_runs),
    }


def _fit(fit: float | None) -> str:
    return "" if fit is None else f", {percent(fit)} %"


def _mean_fit(row: Row) -> float | None:
    """Return the mean fit over the velocities [%]."""
    fits = [fit for fit in row.score.fit_by_axis.values() if fit is not None]
    return float(np.mean(fits)) if fits else None


def recorded_panels(log: Log) -> Iterator[Panel]:
    """Yield actuation and depth; commands of one order of magnitude share a panel."""
    groups: dict[tuple[int, int], dict[str, FloatArray]] = {}
    for name in log.command_names:
        values = log.command(name)
        size = int(np.floor(np.log10(np.abs(values).max(initial=0.0) or 1.0)))
        full = sum(len(group) for (size_class, _), group in groups.items() if size_class == size)
        groups.setdefault((size, full // len(style.SERIES)), {})[name] = values
    for group in groups.values():
        label = next(iter(group)) if len(group) == 1 else "commands"
        yield Panel(f"{label} [as recorded]", group)
    if log.propulsion_ratio is not None:
        yield Panel("propulsion ratio [1]", {"eta": log.propulsion_ratio})
    if log.wrench is not None:
        for letters, label in (("XYZ", "force [N]"), ("KMN", "moment [N m]")):
            columns = {letter: log.wrench[:, AXES.index(letter)] for letter in letters}
            moving = {name: values for name, values in columns.items() if values.any()}
            if moving:
                yield Panel(label, moving)
    if log.position is not None:
        yield Panel("depth [m]", {"depth": log.position[:, 2]}, is_downward=True)
