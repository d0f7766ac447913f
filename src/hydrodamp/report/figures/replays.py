"""Figures 4 and 5 of the paper: what was measured against what models say, on held-out data."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import VELOCITY_OF
from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError
from hydrodamp.report.figures.apart import SAMPLE, Look, looks_of
from hydrodamp.report.figures.joins import mark_segments
from hydrodamp.report.figures.look import BAND, MEASURED, in_our_look, stacked
from hydrodamp.report.figures.symbols import plain, shortened, shown, velocity_label
from hydrodamp.report.figures.traces import clock, ribbon, trace
from hydrodamp.report.numbers import error_size
from hydrodamp.simulation.replay import Trajectory
from hydrodamp.validation.bands import PredictionBand
from hydrodamp.validation.comparison import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Bands = Mapping[tuple[str, str], PredictionBand]
"""Bands by model and method."""

_ROOM = 0.4
"""How far beyond the range of the measurements a panel reaches, at most, in such ranges."""

_EDGE = 0.6
"""Opacity of a band's edges, by which bands that overlap are told apart."""

_LEGEND = 60
"""Letters of a line of the legend."""


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
    trajectories = [row.trajectory for row in chosen if row.trajectory is not None]
    log, axes = _common(trajectories, known)
    names = [VELOCITY_OF[axis] for axis in axes]
    figure, panels = stacked(len(names), each=0.78, extra=0.75 + 0.13 * len(chosen))
    looks = looks_of([(row.model, row.method) for row in chosen], models)
    for panel, name in zip(panels, names, strict=True):
        _draw(panel, log, name, list(zip(chosen, looks, strict=True)), known)
    mark_segments(panels, log)
    figure.align_ylabels(panels)
    _legend(figure, chosen, looks, known)
    return figure


def _draw(panel: Axes, log: Log, name: str, rows: list[tuple[Row, Look]], bands: Bands) -> None:
    """Draw one velocity of all rows."""
    unit = rows[0][0].score.rate_unit
    measured = shown(log.velocity, name, unit)
    runs = [(one.trajectory, look) for one, look in rows if one.trajectory is not None]
    lines = [(run, shown(run.velocity, name, unit), look) for run, look in runs]
    low, high = _limits(measured, [values for _, values, _ in lines])
    panel.plot(*trace(log, measured), color=MEASURED, linewidth=1.1, zorder=2.5)
    for row, look in rows:
        if (band := bands.get((row.model, row.method))) is not None:
            ends = shown(band.lower, name, unit), shown(band.upper, name, unit)
            area = panel.fill_between(*ribbon(log, *ends), facecolor=(look.colour, BAND))
            area.set(edgecolor=(look.colour, _EDGE), linewidth=0.4)
    for place, (run, values, look) in enumerate(lines):
        (line,) = panel.plot(*trace(log, values), color=look.colour, linestyle=look.linestyle)
        line.set(linewidth=0.8, zorder=3.5 - 0.5 * place / len(lines))
        for time, value in _ends(run, values):
            panel.plot(
                [time],
                [min(max(value, low), high)],
                "x",
                color=look.colour,
                markersize=5.0,
                markeredgewidth=1.2,
                zorder=4.0,
                clip_on=False,
            )
    panel.set_ylim(low, high)
    panel.set_ylabel(velocity_label(name, unit))


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


def _ends(trajectory: Trajectory, values: FloatArray) -> list[tuple[float, float]]:
    """Return the last sample before every divergence."""
    time, lost = clock(trajectory.log), {name for name, _ in trajectory.diverged}
    ends = []
    for segment in trajectory.log.segments:
        part = values[segment.start : segment.stop]
        if segment.name in lost and np.isfinite(part).any():
            last = segment.start + int(np.flatnonzero(np.isfinite(part))[-1])
            ends.append((float(time[last]), float(values[last])))
    return ends


def _limits(measured: FloatArray, replays: list[FloatArray]) -> tuple[float, float]:
    """Return the range of a panel: all that was measured, and of replays what is near it."""
    low, high = float(measured.min()), float(measured.max())
    span = max(high - low, 1e-3 * max(abs(low), abs(high), 1.0))
    values = np.concatenate(replays)
    near = np.clip(values[np.isfinite(values)], low - _ROOM * span, high + _ROOM * span)
    edge = 0.06 * span
    return float(near.min(initial=low)) - edge, float(near.max(initial=high)) + edge


def _legend(figure: Figure, rows: tuple[Row, ...], looks: list[Look], bands: Bands) -> None:
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=MEASURED, linewidth=1.1, label="measured")]
    for row, look in zip(rows, looks, strict=True):
        label = plain(shortened(_said(row, bands), _LEGEND))
        dashes = "none" if row.trajectory is None else look.linestyle
        handles.append(Line2D([], [], color=look.colour, linestyle=dashes, label=label))
    figure.legend(
        handles=handles, loc="outside upper left", ncols=1, labelspacing=0.25, handlelength=SAMPLE
    )


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
