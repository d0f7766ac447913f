"""How an adaptive identifier came to its estimate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES, VELOCITIES
from hydrodamp.errors import MethodError
from hydrodamp.identification.adaptive import History
from hydrodamp.models.damping import Damping
from hydrodamp.report.figures.axes import coefficient_symbol, shown, signed_scale, velocity_unit
from hydrodamp.report.figures.look import FAINT, SERIES, in_our_look, stacked
from hydrodamp.report.figures.traces import Bins

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Joins and new passes marked; more would hide the lines.
_MOST_JOINS = 12

# A step longer than this many usual ones leads to another segment.
_LEAP = 5.0

# Share of the velocity errors within the panel: what is beyond is the start.
_USUAL = 0.995

# Points of a line, of which a panel has many.
_POINTS = 500


@in_our_look
def history_figure(history: History, reference: Damping | None = None) -> Figure:
    """Draw coefficients and velocity errors of an adaptive identifier over its steps.

    Parameters
    ----------
    history : History
        Of :meth:`hydrodamp.AdaptiveIdentifier.history`.
    reference : Damping, optional
        Values to compare with, such as those of least squares or the true ones: a point at
        the right end for every coefficient that is named.

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
    places = {
        axis: [k for k, label in enumerate(history.labels) if label.startswith(f"{axis}_")]
        for axis in AXES
    }
    axes = [axis for axis in AXES if places[axis]]
    figure, panels = stacked(len(axes) + 2, each=1.0)
    known = {} if reference is None else reference.as_dict()
    for axis, panel in zip(axes, panels, strict=False):
        _coefficients(panel, time, history, places[axis], known)
        panel.set_ylabel(f"${axis}$\ncoefficients [SI]")
    _errors(panels[-2], time, history.velocity_error, VELOCITIES[:3])
    _errors(panels[-1], time, history.velocity_error, VELOCITIES[3:])
    for panel in panels:
        for join in joins if len(joins) <= _MOST_JOINS else ():
            panel.axvline(join, color=FAINT, linewidth=0.6, linestyle=":")
        if panel.get_legend_handles_labels()[0]:
            panel.legend(loc="upper left", bbox_to_anchor=(1.02, 1.05), handlelength=0.8)
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


def _coefficients(
    panel: Axes, time: FloatArray, history: History, places: list[int], known: dict[str, float]
) -> None:
    values = history.coefficients[:, places]
    # More powers of ten about zero would make much of small swings.
    signed_scale(panel, "y", values, beyond=1.5, decades=1, ticks=2)
    low, high = panel.get_ylim()
    order = np.argsort(np.ptp(values, axis=0))[::-1].tolist()
    for place in order[len(SERIES) :]:
        (line,) = panel.plot(*_line(time, values[:, place]), color="#c4c4c4", linewidth=0.5)
        line.set(zorder=1.5, rasterized=True)  # hundreds of these would make a file of megabytes
    for place, colour in zip(sorted(order[: len(SERIES)]), SERIES, strict=False):
        label = history.labels[places[place]]
        panel.plot(*_line(time, values[:, place]), color=colour, label=coefficient_symbol(label))
        if low <= known.get(label, np.inf) <= high:
            panel.plot(time[-1:], [known[label]], "<", color=colour, clip_on=False)


def _errors(panel: Axes, time: FloatArray, errors: FloatArray, names: tuple[str, ...]) -> None:
    columns = {
        name: shown(errors, name) for name in names if errors[:, VELOCITIES.index(name)].any()
    }
    for (name, values), colour in zip(columns.items(), SERIES, strict=False):
        panel.plot(*_line(time, values), color=colour, linewidth=0.6, label=f"${name}$")
    panel.set_ylabel(f"error\n[{velocity_unit(names[0])}]")
    if columns:
        reach = 1.2 * float(np.quantile(np.abs(list(columns.values())), _USUAL))
        panel.set_ylim(-max(reach, 1e-12), max(reach, 1e-12))


def _line(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    bins = Bins.over([(0, len(time))], _POINTS)
    return bins.times(time), bins.values(values)
