"""Figures 4 and 5 of the paper: what was measured against what models say, on held-out data."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import VELOCITY_OF
from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError
from hydrodamp.report.figures.axes import shown, velocity_label
from hydrodamp.report.figures.look import (
    BAND,
    MEASURED,
    Look,
    in_our_look,
    legend,
    looks_of,
    stacked,
)
from hydrodamp.report.figures.traces import clock, mark_segments, trace
from hydrodamp.report.grid import error_size
from hydrodamp.simulation.replay import Trajectory
from hydrodamp.validation.bands import PredictionBand
from hydrodamp.validation.compare import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# How far beyond the range of the measurements a panel reaches, at most, in such ranges.
_ROOM = 0.4

Bands = Mapping[tuple[str, str], PredictionBand]


@in_our_look
def replays_figure(
    rows: Iterable[Row], bands: Bands | None = None, models: Sequence[str] = ()
) -> Figure:
    """Draw measured velocities and replays of chosen rows: figures 4 and 5 of the paper.

    Parameters
    ----------
    rows : iterable of Row
        Of one comparison, such as every method of one model; the first lies on top. A
        replay that diverged is drawn as far as it went; a cross marks the end. A row
        without a replay is named. Angular rates have the unit of the scores.
    bands : mapping of (model, method) to PredictionBand, optional
        Of some of them, on the same log.
    models : sequence of str, optional
        The models that take dashes first, in this order; by default they take them as they
        come, the first a solid line.

    Returns
    -------
    figure : Figure
        One column wide, a panel for each free velocity. Colour is the method, dashes are the
        model. Panels reach to the measurements and somewhat beyond; what leaves them is far
        off.

    Raises
    ------
    MethodError
        If no row has a replay, rows replay different logs, or matplotlib is not
        installed.
    """
    chosen, known = tuple(rows), bands or {}
    looks = looks_of([(row.model, row.method) for row in chosen], models)
    runs = [
        (row.trajectory, look, known.get((row.model, row.method)))
        for row, look in zip(chosen, looks, strict=True)
        if row.trajectory is not None
    ]
    log, axes = _common([run for run, _, _ in runs], known)
    figure, panels = stacked(len(axes), each=0.78, extra=0.75 + 0.13 * len(chosen))
    unit = chosen[0].score.rate_unit
    for panel, name in zip(panels, (VELOCITY_OF[axis] for axis in axes), strict=True):
        measured = shown(log.velocity, name, unit)
        panel.plot(*trace(log, measured), color=MEASURED, linewidth=1.1, zorder=2.5)
        replays = [shown(run.velocity, name, unit) for run, _, _ in runs]
        panel.set_ylim(*_limits(measured, np.concatenate(replays)))
        for place, ((run, look, band), values) in enumerate(zip(runs, replays, strict=True)):
            if band is not None:
                ends = shown(band.lower, name, unit), shown(band.upper, name, unit)
                time, lower, upper = trace(log, *ends)
                area = panel.fill_between(time, lower, upper, facecolor=(look.colour, BAND))
                area.set(edgecolor=(look.colour, 0.6), linewidth=0.4)
            (line,) = panel.plot(*trace(log, values), linewidth=0.8, **look.line)
            line.set_zorder(3.5 - 0.5 * place / len(runs))
            _cross_ends(panel, run, values, look)
        panel.set_ylabel(velocity_label(name, unit))
    mark_segments(panels, log)
    figure.align_ylabels(panels)
    named = [
        (_said(row, known), look.line if row.trajectory else {"linestyle": "none"})
        for row, look in zip(chosen, looks, strict=True)
    ]
    legend(figure, [("measured", {"color": MEASURED, "linewidth": 1.1}), *named])
    return figure


def _common(trajectories: list[Trajectory], bands: Bands) -> tuple[Log, tuple[str, ...]]:
    """Return the log that all replay, and the free axes."""
    if not trajectories:
        raise MethodError(
            "no row has a replay to draw: give at least one whose model was identified"
        )
    first = trajectories[0]
    for log in (*(one.log for one in trajectories), *(band.log for band in bands.values())):
        if log.n != first.log.n or log.segments != first.log.segments:
            raise MethodError(
                "all replays and bands in one figure must be of the same log; got "
                f"{first.log.n} and {log.n} samples"
            )
    return first.log, first.axes


def _limits(measured: FloatArray, replayed: FloatArray) -> tuple[float, float]:
    """Return the range of a panel: all that was measured, and of replays what is near it."""
    low, high = float(measured.min()), float(measured.max())
    span = max(high - low, 1e-3 * max(abs(low), abs(high), 1.0))
    finite = replayed[np.isfinite(replayed)]
    near = np.clip(finite, low - _ROOM * span, high + _ROOM * span)
    edge = 0.06 * span
    return float(near.min(initial=low)) - edge, float(near.max(initial=high)) + edge


def _cross_ends(panel: Axes, run: Trajectory, values: FloatArray, look: Look) -> None:
    """Mark where a replay diverged."""
    low, high = panel.get_ylim()
    for time, value in _ends(run, values):
        (cross,) = panel.plot([time], [min(max(value, low), high)], "x", color=look.colour)
        cross.set(markersize=5.0, markeredgewidth=1.2, zorder=4.0, clip_on=False)


def _ends(run: Trajectory, values: FloatArray) -> Iterator[tuple[float, float]]:
    """Yield the last sample before every divergence."""
    time, lost = clock(run.log), {name for name, _ in run.diverged}
    for segment in run.log.segments:
        known = np.flatnonzero(np.isfinite(values[segment.start : segment.stop]))
        if segment.name in lost and known.size:
            last = segment.start + int(known[-1])
            yield float(time[last]), float(values[last])


def _said(row: Row, bands: Bands) -> str:
    """Return what the legend says of a row."""
    name = f"{row.model} by {row.method}"
    if row.trajectory is None:
        return f"{name}: {row.status.word}, no replay"
    if row.trajectory.diverged:
        lost, count = len(row.trajectory.diverged), len(row.trajectory.log.segments)
        where = f" in {lost} of {count} segments" if count > 1 else ""
        return f"{name}: diverged (cross){where}"
    band = bands.get((row.model, row.method))
    held = f", {100.0 * band.level:.0f} % band" if band is not None else ""
    return f"{name}, RMS {error_size(row.rms)}{held}"
