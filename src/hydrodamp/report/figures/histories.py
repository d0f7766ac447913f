"""How an adaptive identifier came to its estimate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.errors import MethodError
from hydrodamp.identification.online.adaptive import History
from hydrodamp.models.damping import Damping
from hydrodamp.report.figures.look import COLUMN, FAINT, SERIES, in_our_look, settle, sheet
from hydrodamp.report.figures.scales import SignedScale
from hydrodamp.report.figures.symbols import coefficient_symbol, shown, velocity_unit
from hydrodamp.report.figures.traces import min_max_pairs

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LETTERS = 48
"""Letters of a legend of one line, with three for each stroke."""

_MOST_JOINS = 12
"""Joins and new passes marked; more would hide the lines."""

_DECADES = 1
"""Powers of ten told apart to either side of zero: more make much of small swings."""

_BEYOND = 1.5
"""How many times the greatest coefficient a panel reaches."""

_USUAL = 0.995
"""Share of the velocity errors within the panel: what is beyond is the start."""

_PAIRS = 250
"""Bins of a line, of which a panel has many."""

_LEAP = 5.0
"""A step longer than this many usual ones leads to another segment."""


@in_our_look
def history_figure(history: History, reference: Damping | None = None) -> Figure:
    """Draw coefficients and velocity errors of an adaptive identifier over its steps.

    Parameters
    ----------
    history : History
        Of :meth:`hydrodamp.identification.online.adaptive.AdaptiveIdentifier.history`.
    reference : Damping, optional
        Values to compare with, such as those of least squares or the true ones: a dash at
        the right for every coefficient that is named.

    Returns
    -------
    figure : Figure
        One column wide: a panel for each axis with coefficients, at most six that moved
        farthest in colour, the others grey; below them the velocity errors, estimated
        minus measured. Coefficients stand on a logarithmic scale to both sides of a
        linear stretch about zero. Joins and new passes are dotted where they are few.

    Raises
    ------
    MethodError
        If the history is empty, or matplotlib is not installed.
    """
    if not len(history.time) or not history.labels:
        raise MethodError("the history has no step or no coefficient, so there is nothing to draw")
    time, joins = _clock(history.time)
    groups = _by_axis(history.labels)
    figure = sheet(COLUMN, 1.0 * len(groups) + 0.85 * 2 + 0.5)
    heights = [1.2] * len(groups) + [1.0, 1.0]
    panels = list(figure.subplots(len(heights), 1, sharex=True, height_ratios=heights))
    for (axis, places), panel in zip(groups.items(), panels, strict=False):
        _coefficients(panel, time, history, places, reference)
        panel.set_ylabel(f"${axis}$\ncoefficients [SI]")
    _errors(panels[-2], time, history.velocity_error, VELOCITIES[:3])
    _errors(panels[-1], time, history.velocity_error, VELOCITIES[3:])
    for panel in panels:
        for join in joins if len(joins) <= _MOST_JOINS else ():
            panel.axvline(join, color=FAINT, linewidth=0.6, linestyle=":")
        settle(panel)
    panels[-1].set_xlim(0.0, max(float(time[-1]), 1e-9))
    panels[-1].set_xlabel("time adapted, segments and passes end to end [s]")
    figure.align_ylabels(panels)
    return figure


def _clock(time: FloatArray) -> tuple[FloatArray, list[float]]:
    """Return a clock that only runs on, and where it was set back or leapt."""
    steps = np.diff(time)
    usual = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else 1.0
    leaps = (steps <= 0.0) | (steps > _LEAP * usual)
    running = np.concatenate([[0.0], np.cumsum(np.where(leaps, usual, steps))])
    return running, running[1:][leaps].tolist()


def _by_axis(labels: tuple[str, ...]) -> dict[str, list[int]]:
    """Return the places of the coefficients of each axis that has some."""
    groups: dict[str, list[int]] = {}
    for place, label in enumerate(labels):
        groups.setdefault(label.partition("_")[0], []).append(place)
    return groups


def _coefficients(
    panel: Axes, time: FloatArray, history: History, places: list[int], reference: Damping | None
) -> None:
    values = history.coefficients[:, places]
    scale = SignedScale.of(values, beyond=_BEYOND, decades=_DECADES)
    scale.along(panel, "y")
    order = np.argsort(np.ptp(values, axis=0))[::-1].tolist()
    known = {} if reference is None else reference.as_dict()
    named = _nameable(order, [history.labels[place] for place in places])
    for place in set(order) - set(named):
        (line,) = panel.plot(*_line(time, values[:, place]), color="#c4c4c4", linewidth=0.5)
        line.set(zorder=1.5, rasterized=True)  # hundreds of these would make a file of megabytes
    for place, colour in zip(named, SERIES, strict=False):
        label = history.labels[places[place]]
        panel.plot(*_line(time, values[:, place]), color=colour, label=coefficient_symbol(label))
        if label in known and scale.low <= known[label] <= scale.high:
            panel.annotate(
                "",
                (1.0, known[label]),
                (1.025, known[label]),
                xycoords=("axes fraction", "data"),
                arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 1.5},
                annotation_clip=False,
            )
    panel.legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 0.97),
        ncols=len(SERIES),
        borderpad=0.0,
        handlelength=0.8,
        columnspacing=0.8,
    )


def _nameable(order: list[int], labels: list[str]) -> list[int]:
    """Return the first places whose names one line holds, in the model's order."""
    ends = np.cumsum([len(labels[place]) + 3 for place in order])
    count = min(max(int(np.count_nonzero(ends <= _LETTERS)), 1), len(SERIES))
    return sorted(order[:count])


def _errors(panel: Axes, time: FloatArray, errors: FloatArray, names: tuple[str, ...]) -> None:
    columns = {name: shown(errors, name) for name in names if shown(errors, name).any()}
    for (name, values), colour in zip(columns.items(), SERIES, strict=False):
        panel.plot(*_line(time, values), color=colour, linewidth=0.6, label=f"${name}$")
    panel.set_ylabel(f"error\n[{velocity_unit(names[0])}]")
    if columns:
        sizes = np.abs(np.column_stack(list(columns.values())))
        reach = max(1.2 * float(np.quantile(sizes, _USUAL)), 1e-12)
        panel.set_ylim(-reach, reach)
        panel.legend(
            loc="lower left", bbox_to_anchor=(0.0, 0.97), ncols=3, borderpad=0.0, handlelength=0.8
        )


def _line(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    kept = min_max_pairs(values, _PAIRS)
    return time[kept], values[kept]
