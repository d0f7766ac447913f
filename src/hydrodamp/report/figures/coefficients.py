"""Coefficients with their intervals, method beside method."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.uncertainty.intervals import reach
from hydrodamp.models.model import DampingModel
from hydrodamp.report.figures.apart import colour_of, mark_of
from hydrodamp.report.figures.look import COLUMN, FAINT, PAGE, in_our_look, settle, sheet
from hydrodamp.report.figures.scales import SignedScale
from hydrodamp.report.figures.symbols import coefficient_symbol, plain, shortened, wrench_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

_TALLEST = 5.0
"""Height of all coefficients below each other, from which on three axes stand abreast [in]."""

_LINE = 0.12
"""Height of a coefficient [in]; more where methods stand side by side."""

_DECADES = 5
"""Powers of ten told apart to either side of zero."""

_BEYOND = 3.0
"""How many times the greatest coefficient a panel reaches; a longer interval leaves it."""


@in_our_look
def coefficients_figure(fits: Iterable[Fit], level: float = 0.95) -> Figure:
    """Draw the coefficients of a model with their intervals.

    Parameters
    ----------
    fits : iterable of Fit
        Of one model by some methods. One without covariance is drawn as points; one
        without numbers is named. Coefficients that the data do not tell apart are hollow.
    level : float
        Share of repetitions in which an interval is to hold what is sought.

    Returns
    -------
    figure : Figure
        A panel an axis. The scale is logarithmic to both sides of a stretch about zero,
        where it is linear: an interval that crosses zero says that not even the sign is
        known. Units differ from term to term: newtons, for K M N newton metres, over the
        units of the term, in SI.

    Raises
    ------
    MethodError
        If no fit has numbers, fits are of different models, or matplotlib is not
        installed.
    """
    chosen = tuple(fits)
    usable = [fit for fit in chosen if fit.status.usable]
    if not usable:
        raise MethodError("no fit has coefficients to draw: give at least one that was identified")
    model = usable[0].model
    if any(fit.model.labels != model.labels for fit in usable):
        keys = ", ".join(dict.fromkeys(fit.model.key for fit in usable))
        raise MethodError(f"all fits of one figure must be of one model; got {keys}")
    figure, panels = _panels(model, len(usable))
    ticks = 2 if figure.get_figwidth() == COLUMN else 1
    ends = np.cumsum([0, *map(len, model.terms)]).tolist()
    for axis, panel in panels.items():
        part = slice(ends[axis], ends[axis + 1])
        for place, fit in enumerate(usable):
            offset = (place - 0.5 * (len(usable) - 1)) * min(0.8 / len(usable), 0.28)
            _draw(panel, fit, part, offset, level)
        values = np.concatenate([fit.damping.coefficients[part] for fit in usable])
        _finish(panel, AXES[axis], model.labels[part], values, ticks)
    handles = [_handle(fit, level) for fit in chosen]
    figure.legend(handles=handles, loc="outside upper left", labelspacing=0.25)
    return figure


def _panels(model: DampingModel, methods: int) -> tuple[Figure, dict[int, Axes]]:
    """Return a panel for each axis with terms: below each other, or three beside each other."""
    counts = {axis: len(terms) for axis, terms in enumerate(model.terms) if terms}
    line = _LINE * max(1.0, 0.5 * methods)
    if line * model.n_coefficients <= _TALLEST:
        rows, columns, width = len(counts), 1, COLUMN
        heights = list(counts.values())
    else:
        columns, width = 3, PAGE
        rows = -(-len(counts) // columns)
        sizes = list(counts.values())
        heights = [max(sizes[row * columns : (row + 1) * columns]) for row in range(rows)]
    figure = sheet(width, line * sum(heights) + 0.35 * rows + 0.5 + 0.13 * methods)
    grid = figure.subplots(rows, columns, squeeze=False, height_ratios=[n + 1 for n in heights])
    spare = iter(grid.ravel())
    panels = dict(zip(counts, spare, strict=False))
    for empty in spare:
        empty.remove()
    return figure, panels


def _draw(panel: Axes, fit: Fit, part: slice, offset: float, level: float) -> None:
    """Draw some coefficients of a fit, from the top downward."""
    values = fit.damping.coefficients[part]
    half = _half_widths(fit, level)
    places = np.arange(len(values)) + offset
    colour, tied = colour_of(fit.method), {label for group in fit.aliased for label in group}
    hollow = np.array([label in tied for label in fit.model.labels[part]], dtype=bool)
    if half is not None:
        panel.hlines(
            places,
            values - half[part],
            values + half[part],
            color=colour,
            linewidth=1.1,
            zorder=2.5,
        )
    for some, face in ((~hollow, colour), (hollow, "white")):
        panel.plot(
            values[some],
            places[some],
            linestyle="none",
            marker=mark_of(fit.method),
            markersize=3.2,
            color=colour,
            markerfacecolor=face,
            markeredgewidth=0.7,
            zorder=3.0,
        )


def _half_widths(fit: Fit, level: float) -> FloatArray | None:
    """Return half the width of each interval; None where the method gives no covariance."""
    covariance, known = fit.damping.covariance, fit.uncertainty
    if covariance is None:
        return None
    times = reach(level) if known is None else known.reach(level)
    return times * np.sqrt(np.diag(covariance))


def _handle(fit: Fit, level: float) -> Line2D:
    from matplotlib.lines import Line2D

    return Line2D(
        [],
        [],
        color=colour_of(fit.method),
        marker=mark_of(fit.method) if fit.status.usable else "",
        linestyle="-" if fit.damping.covariance is not None else "none",
        linewidth=1.1,
        label=plain(_said(fit, level)),
    )


def _said(fit: Fit, level: float) -> str:
    name = shortened(f"{fit.model.key} by {fit.method}", 40)
    if not fit.status.usable:
        return f"{name}: {fit.status.word}"
    if fit.damping.covariance is None:
        return f"{name}, no intervals"
    white = "" if fit.uncertainty is not None else " for white residuals"
    return f"{name}, {100.0 * level:.3g} % intervals{white}"


def _finish(panel: Axes, axis: str, labels: Sequence[str], values: FloatArray, ticks: int) -> None:
    panel.set_yticks(range(len(labels)), [coefficient_symbol(label) for label in labels])
    panel.set_ylim(len(labels) - 0.4, -0.6)
    panel.axvline(0.0, color=FAINT, linewidth=0.8)
    panel.set_title(f"${axis}$ [{wrench_unit(axis)} per unit of the term]", loc="left", pad=2.0)
    SignedScale.of(values, beyond=_BEYOND, decades=_DECADES).along(panel, "x", ticks)
    panel.tick_params(axis="y", length=0.0)
    settle(panel)
