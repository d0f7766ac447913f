"""What each further coefficient buys: RMS error against the number of coefficients."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hydrodamp.errors import MethodError
from hydrodamp.report.figures.apart import colour_of, mark_of
from hydrodamp.report.figures.look import COLUMN, FAINT, in_our_look, settle, sheet
from hydrodamp.report.figures.scales import round_ticks
from hydrodamp.report.figures.spacing import Columns, columns_of, limits_of, pushed_apart
from hydrodamp.report.figures.symbols import plain, shortened
from hydrodamp.validation.comparison import Comparison, Row
from hydrodamp.validation.front import front

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_NAME = 22
"""Letters of a model's name."""

_APART = 0.034
"""Least distance of two names, as a share of the width."""

_ROW = 0.04
"""Height of a row of the lane for rows without an error, as a share of the panel's."""

_LANE = 0.3
"""Height of the whole lane at most."""


@in_our_look
def front_figure(comparison: Comparison) -> Figure:
    """Draw RMS error against the number of coefficients, with the front.

    Parameters
    ----------
    comparison : Comparison
        Rows that have not settled are hollow; those without an error stand in a lane at
        the top, as crosses.

    Returns
    -------
    figure : Figure
        One column wide, both scales logarithmic. The line joins the rows that no other
        beats in both. Models are named above their columns; those of the same number of
        coefficients stand side by side.

    Raises
    ------
    MethodError
        If there are no rows with coefficients, or matplotlib is not installed.
    """
    rows = [row for row in comparison.rows if row.n_coefficients]
    if not rows:
        raise MethodError("the comparison has no row with coefficients, so there is no front")
    figure = sheet(COLUMN, 3.7 + 0.07 * len(comparison.methods))
    panel = figure.subplots()
    panel.set_xscale("log")
    panel.set_yscale("log")
    lane = _lane_of(rows)
    low, high, top = _limits([row.rms for row in rows if row.rms is not None], lane)
    panel.set_ylim(low, top)
    round_ticks(panel.yaxis, low, high)
    best = [row for row in front(comparison) if row.n_coefficients]
    columns = columns_of(rows)
    panel.plot(
        [_column(row, columns) for row in best],
        [row.rms or 0.0 for row in best],
        drawstyle="steps-post",
        color=FAINT,
        linewidth=1.2,
        zorder=2.0,
    )
    for row in rows:
        _mark(panel, row, _column(row, columns), lane)
    _draw_lane(panel, lane)
    _name_models(panel, columns)
    panel.set_xlabel("number of coefficients")
    panel.set_ylabel(f"RMS error, eq. 24 [m/s and {comparison.rate_unit}/s]")
    settle(panel)
    _legend(figure, rows)
    return figure


Lane = dict[str, float]
"""Height of the row of each method that has rows without an error, as a share."""


def _lane_of(rows: Sequence[Row]) -> Lane:
    lost = dict.fromkeys(row.method for row in rows if row.rms is None)
    row = _row(len(lost))
    return {method: 1.0 - row * (place + 0.6) for place, method in enumerate(lost)}


def _row(rows: int) -> float:
    """Return the height of a row of the lane, lower where there are many."""
    return min(_ROW, _LANE / max(rows, 1))


def _limits(errors: Sequence[float], lane: Lane) -> tuple[float, float, float]:
    """Return the range of the errors, and where it ends with the lane above."""
    seen = [error for error in errors if error > 0.0] or [1.0]
    low, high = min(seen) / 1.5, max(seen) * 1.5
    share = 1.0 - _row(len(lane)) * (len(lane) + 0.5)
    return low, high, low * (high / low) ** (1.0 / share)


def _column(row: Row, columns: Columns) -> float:
    return columns[row.n_coefficients, row.model]


def _mark(panel: Axes, row: Row, column: float, lane: Lane) -> None:
    colour = colour_of(row.method)
    if row.rms is None:
        panel.plot(
            [column],
            [lane[row.method]],
            "x",
            color=colour,
            markersize=4.0,
            markeredgewidth=1.2,
            transform=panel.get_xaxis_transform(),
            zorder=3.0,
        )
        return
    panel.plot(
        [column],
        [max(row.rms, panel.get_ylim()[0])],
        mark_of(row.method),
        color=colour,
        markerfacecolor=colour if row.settled else "white",
        markersize=4.5,
        markeredgewidth=0.9,
        zorder=3.0,
    )


def _draw_lane(panel: Axes, lane: Lane) -> None:
    """Set the lane of the rows without an error apart from the scale."""
    if not lane:
        return
    from matplotlib.patches import Rectangle

    height = _row(len(lane)) * (len(lane) + 0.2)
    box = Rectangle((0.0, 1.0 - height), 1.0, height, transform=panel.transAxes)
    box.set(facecolor="#efefef", edgecolor="none", zorder=0.5)
    panel.add_patch(box)
    middle = 1.0 - 0.5 * height
    style: dict[str, Any] = {"fontsize": 6.0, "color": FAINT, "va": "center"}
    panel.text(0.01, middle, "no error", transform=panel.transAxes, **style)


def _name_models(panel: Axes, columns: Columns) -> None:
    """Write the models above their columns, pushed apart where they meet."""
    limits = limits_of(size for size, _ in columns)
    panel.set_xlim(*limits)
    first, last = np.log(limits)
    at = [float((np.log(column) - first) / (last - first)) for column in columns.values()]
    moved = pushed_apart(at, _APART)
    for (_, name), column, place, aside in zip(columns, columns.values(), at, moved, strict=True):
        panel.annotate(
            plain(shortened(name, _NAME)),
            (place, 1.0),
            xycoords="axes fraction",
            xytext=(aside, 1.05),
            textcoords="axes fraction",
            rotation=90,
            ha="center",
            va="bottom",
            fontsize=6.5,
            arrowprops={
                "arrowstyle": "-",
                "color": FAINT,
                "linewidth": 0.5,
                "shrinkA": 0,
                "shrinkB": 0,
            },
            annotation_clip=False,
        )
        panel.axvline(column, color="#e4e4e4", linewidth=0.5, zorder=0.6)
    panel.grid(visible=False, axis="x", which="both")
    round_ticks(panel.xaxis, *limits)


def _legend(figure: Figure, rows: Sequence[Row]) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D(
            [],
            [],
            color=colour_of(key),
            marker=mark_of(key),
            linestyle="none",
            label=plain(shortened(key, 20)),
        )
        for key in dict.fromkeys(row.method for row in rows)
    ]
    handles.append(Line2D([], [], color=FAINT, linewidth=1.2, label="front"))
    if any(row.rms is not None and not row.settled for row in rows):
        handles.append(
            Line2D(
                [],
                [],
                color=FAINT,
                marker="o",
                markerfacecolor="white",
                linestyle="none",
                label="not settled",
            )
        )
    figure.legend(handles=handles, loc="outside lower center", ncols=3, labelspacing=0.3)
