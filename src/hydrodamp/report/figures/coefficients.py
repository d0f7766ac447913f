"""Coefficients with their intervals, and the correlation of their errors."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

from hydrodamp.basis.atoms import AXES
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit, correlation
from hydrodamp.models.model import DampingModel
from hydrodamp.report.figures.axes import coefficient_symbol, signed_scale, wrench_unit
from hydrodamp.report.figures.look import (
    COLUMN,
    FAINT,
    PAGE,
    Look,
    abreast,
    drawn_fits,
    in_our_look,
    legend,
    plain,
    sheet,
)
from hydrodamp.report.fit_tables import half_widths

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Height of a coefficient of one method [in].
_LINE = 0.12

# Powers of ten to either side of zero, and how many times the greatest coefficient a panel
# reaches; a longer interval leaves it.
_DECADES = 5
_BEYOND = 3.0

_HOLLOW: dict[str, Any] = {"markersize": 3.2, "markerfacecolor": "white", "markeredgewidth": 0.7}


@in_our_look
def coefficients_figure(fits: Iterable[Fit]) -> Figure:
    """Draw the coefficients of a model with their 95 % intervals.

    Parameters
    ----------
    fits : iterable of Fit
        Of one model by some methods; those without numbers are left out. One without
        covariance is drawn as points. Coefficients that the data cannot separate are hollow.

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
    drawn = drawn_fits(fits)
    model, n = drawn[0][1].model, len(drawn)
    if any(fit.model.labels != model.labels for _, fit, _ in drawn):
        keys = ", ".join(dict.fromkeys(fit.model.key for _, fit, _ in drawn))
        raise MethodError(f"all fits of one figure must be of one model; got {keys}")
    figure, panels = _panels(model, n)
    ends = np.cumsum([0, *map(len, model.terms)]).tolist()
    for axis, panel in panels.items():
        part = slice(ends[axis], ends[axis + 1])
        symbols = [coefficient_symbol(label) for label in model.labels[part]]
        for place, (_, fit, look) in enumerate(drawn):
            offset = (place - 0.5 * (n - 1)) * min(0.8 / n, 0.28)
            values, across = fit.damping.coefficients[part], offset + np.arange(len(symbols))
            half = half_widths(fit)[part]
            panel.errorbar(values, across, xerr=half, linewidth=1.1, markersize=3.2, **look.points)
            tied = np.isin(model.labels[part], list(chain.from_iterable(fit.aliased)))
            panel.plot(values[tied], across[tied], **look.points, **_HOLLOW)
        values = np.concatenate([fit.damping.coefficients[part] for _, fit, _ in drawn])
        signed_scale(panel, values, _BEYOND, _DECADES)
        panel.set_yticks(range(len(symbols)), symbols)
        panel.set_ylim(len(symbols) - 0.4, -0.6)
        panel.tick_params(axis="y", length=0.0)
        panel.axvline(0.0, color=FAINT, linewidth=0.8)
        panel.set_title(f"${AXES[axis]}$ [{wrench_unit(AXES[axis])} per unit of the term]")
    legend(figure, [_entry(*one) for one in drawn])
    return figure


def _panels(model: DampingModel, methods: int) -> tuple[Figure, dict[int, Axes]]:
    """Return a panel for each axis with terms, three beside each other."""
    counts = {axis: len(terms) for axis, terms in enumerate(model.terms) if terms}
    sizes, columns = list(counts.values()), min(3, len(counts))
    heights = [max(sizes[k : k + columns]) + 1 for k in range(0, len(sizes), columns)]
    line = _LINE * max(1.0, 0.5 * methods)
    height = line * sum(heights) + 0.3 * len(heights) + 0.4 + 0.13 * methods
    figure = sheet(max(COLUMN, PAGE * columns / 3), height)
    panels = abreast(figure, len(counts), columns, height_ratios=heights)
    return figure, dict(zip(counts, panels, strict=True))


def _entry(name: str, fit: Fit, look: Look) -> tuple[str, dict[str, Any]]:
    """Return what the legend says of a fit, and how."""
    if fit.damping.covariance is None:
        return f"{name}, no intervals", look.points
    white = "" if fit.uncertainty is not None else " for white residuals"
    return f"{name}, 95 % intervals{white}", {**look.points, "linestyle": "-"}


# Side of a square whose name can be written beside it, and room for the names [in].
_CELL = 0.125
_BESIDE = 0.75

# Coefficients beyond which the names do not fit the page.
_MOST_NAMED = int((PAGE - _BESIDE) / _CELL)


@in_our_look
def correlation_figure(fit: Fit) -> Figure:
    """Draw the correlation of the errors of coefficients.

    Parameters
    ----------
    fit : Fit
        With covariance.

    Returns
    -------
    figure : Figure
        A triangle with a square a pair, in the order of the model, axes divided by lines. It
        grows with the model until it takes the page; beyond, only axes are named.
        Squares of coefficients without an error of their own, such as those of columns that
        are zero, are grey.

    Raises
    ------
    MethodError
        If the fit has no covariance, or matplotlib is not installed.
    """
    model, covariance = fit.model, fit.damping.covariance
    if covariance is None or not model.n_coefficients:
        raise MethodError(
            f"'{model.key}' by '{fit.method}' has no covariance, so no correlation can be "
            "drawn: use a method that gives one"
        )
    n = model.n_coefficients
    width = min(max(n * _CELL + _BESIDE, COLUMN), PAGE)
    figure = sheet(width, 1.06 * width)
    panel = figure.subplots()
    below = np.tri(n, k=-1, dtype=bool)
    panel.imshow(np.ma.masked_array(np.full((n, n), 0.35), ~below), cmap="Greys", vmin=0, vmax=1)
    found = np.ma.masked_invalid(np.where(below, correlation(covariance), np.nan))
    image = panel.imshow(found, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    panel.grid(visible=False)
    panel.spines[:].set_visible(False)
    panel.tick_params(length=0.0, pad=1.5)
    _divide(panel, model)
    if n <= _MOST_NAMED:
        symbols = [coefficient_symbol(label) for label in model.labels]
        panel.set_xticks(range(n), symbols, rotation=90.0)
        panel.set_yticks(range(n), symbols)
    bar = figure.colorbar(image, ax=panel, location="bottom", shrink=0.7, aspect=35, pad=0.02)
    bar.set_ticks([-1.0, -0.5, 0.0, 0.5, 1.0])
    bar.set_label("correlation of errors [1]")
    panel.set_title(plain(f"{model.key} by {fit.method}", int(14 * width)))
    return figure


def _divide(panel: Axes, model: DampingModel) -> None:
    """Divide axes by lines, and write them along the diagonal."""
    start = 0
    for axis, terms in zip(AXES, model.terms, strict=True):
        end, n = start + len(terms) - 0.5, model.n_coefficients - 0.5
        if terms:
            panel.plot([-0.5, end, end], [end, end, n], color="#222222", linewidth=0.6)
            middle = start + 0.5 * len(terms) - 0.5
            panel.annotate(f"${axis}$", (middle, middle), (4.0, 3.0), textcoords="offset points")
        start += len(terms)
    panel.set_xticks([])
    panel.set_yticks([])
