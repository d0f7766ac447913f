"""Replays, figures 4 and 5 of the paper, and the predicted estimates of a dive."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import VELOCITY_OF
from hydrodamp.errors import MethodError
from hydrodamp.experiment_design.result import DivePlan
from hydrodamp.identification.grades import MAX_RELATIVE_HALF_WIDTH, critical_value
from hydrodamp.identification.predicted_error import PredictionBand
from hydrodamp.report.decimation import trace
from hydrodamp.report.figures import style
from hydrodamp.report.table import error_size
from hydrodamp.validation.compare import Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure


POINTS = 1600  # of a line: more than twice the number of pixels of a column
MAX_MARGIN = 0.4  # of a panel beyond the measurements, as a share of their range


@style.with_style
def replays_figure(rows: Iterable[Row], band: PredictionBand | None = None) -> Figure:
    """Draw measured velocities and replays of chosen rows: figures 4 and 5 of the paper.

    Parameters
    ----------
    rows : iterable of Row
        Of one comparison, such as every method of one model; the first lies on top. A
        replay that diverged is drawn as far as it went. A row without a replay is left
        out. Angular rates have the unit of the scores.
    band : PredictionBand, optional
        Of the first of them, on the same log.

    Returns
    -------
    figure : Figure
        One column wide, a panel for each free velocity. Colour is the model, dashes are the
        method. Panels cover the measurements and a margin; replays beyond
        it are cut off.

    Raises
    ------
    MethodError
        If no row has a replay, rows replay different logs, or matplotlib is not
        installed.
    """
    replayed = [(row, row.trajectory) for row in rows if row.trajectory is not None]
    if not replayed:
        raise MethodError(
            "no row has a replay to draw: give at least one whose model was identified"
        )
    first, unit = replayed[0][1], replayed[0][0].score.rate_unit
    log = first.log
    for replayed_log in (*(run.log for _, run in replayed), *([band.log] if band else [])):
        if replayed_log.n != log.n or replayed_log.segments != log.segments:
            raise MethodError(
                f"all replays and bands in one figure must be of the same log; got {log.n} and "
                f"{replayed_log.n} samples"
            )
    looks = style.line_styles([(row.model, row.method) for row, _ in replayed])
    entries = [
        (legend_label(row, band if row is replayed[0][0] else None), look.line)
        for (row, _), look in zip(replayed, looks, strict=True)
    ]
    extra = 0.75 + 0.13 * len(replayed)
    figure, panels = style.stacked_panels(len(first.axes), each=0.78, extra=extra)
    for panel, axis in zip(panels, first.axes, strict=True):
        name = VELOCITY_OF[axis]
        measured = style.shown_velocities(log.velocity, name, unit)
        panel.plot(*trace(log, measured, POINTS), color=style.MEASURED, linewidth=1.1, zorder=2.5)
        replays = [style.shown_velocities(run.velocity, name, unit) for _, run in replayed]
        panel.set_ylim(*_limits(measured, np.concatenate(replays)))
        if band is not None:
            ends = (style.shown_velocities(end, name, unit) for end in (band.lower, band.upper))
            (time, lower), (_, upper) = (trace(log, end, POINTS) for end in ends)
            area = panel.fill_between(time, lower, upper, facecolor=(looks[0].colour, style.BAND))
            area.set(edgecolor=(looks[0].colour, 0.6), linewidth=0.4, zorder=2.9)
        # The first lies on top.
        for values, look in [*zip(replays, looks, strict=True)][::-1]:
            panel.plot(*trace(log, values, POINTS), linewidth=0.8, zorder=3.0, **look.line)
        panel.set_ylabel(style.velocity_label(name, unit))
    style.mark_segments(panels, log)
    figure.align_ylabels(panels)
    style.legend(figure, [("measured", {"color": style.MEASURED, "linewidth": 1.1}), *entries])
    return figure


def _limits(measured: FloatArray, replayed: FloatArray) -> tuple[float, float]:
    """Return the limits of a panel: the measurements, and replays within a margin."""
    low, high = float(measured.min()), float(measured.max())
    span = max(high - low, 1e-3 * max(abs(low), abs(high), 1.0))
    finite = replayed[np.isfinite(replayed)]
    near = np.clip(finite, low - MAX_MARGIN * span, high + MAX_MARGIN * span)
    edge = 0.06 * span
    return float(near.min(initial=low)) - edge, float(near.max(initial=high)) + edge


def legend_label(row: Row, band: PredictionBand | None) -> str:
    """Return the legend entry of a row."""
    name = f"{row.model} by {row.method}"
    if row.rms is None:
        return f"{name}: diverged in {', '.join(segment for segment, _ in row.score.diverged)}"
    band_label = f", {100.0 * band.level:.0f} % band" if band is not None else ""
    return f"{name}, RMS {error_size(row.rms)}{band_label}"


@style.with_style
def prediction_figure(plan: DivePlan) -> Figure:
    """Draw standard errors relative to the coefficients: prior, baseline, this dive.

    Parameters
    ----------
    plan : DivePlan
        From :func:`hydrodamp.plan`.

    Returns
    -------
    figure : Figure
        One row per nonzero coefficient; left of the dashed line it is determined.

    Raises
    ------
    MethodError
        If matplotlib is not installed.
    """
    items = [item for item in plan.predictions if item.value != 0.0]
    figure = style.new_figure(style.PAGE / 2, 0.9 + 0.16 * len(items))
    (panel,) = style.panel_grid(figure, 1, 1)
    rows, entries = np.arange(len(items)), []
    for name, values, marker, colour in (
        ("prior", [item.prior_std_error for item in items], "s", style.FAINT),
        ("baseline of steps", [item.baseline_std_error for item in items], "d", style.SERIES[1]),
        ("this dive", [item.std_error for item in items], "o", style.SERIES[0]),
    ):
        points = [
            (value / abs(item.value), row)
            for value, item, row in zip(values, items, rows, strict=True)
            if value is not None
        ]
        if points:
            line: dict[str, Any] = {"marker": marker, "color": colour, "linestyle": "none"}
            panel.plot(*zip(*points, strict=True), **line)
            entries.append((name, line))
    panel.axvline(MAX_RELATIVE_HALF_WIDTH / critical_value(), color=style.FAINT, linestyle="--")
    panel.set_xscale("log")
    panel.set_yticks(rows, [style.coefficient_symbol(item.label) for item in items])
    panel.invert_yaxis()
    panel.set_xlabel("standard error / coefficient")
    style.legend(figure, entries, columns=3)
    return figure
