"""How the errors of coefficients hang together."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit
from hydrodamp.report.correlated import correlated_pairs, correlation
from hydrodamp.report.figures.look import COLUMN, PAGE, in_our_look, settle, sheet
from hydrodamp.report.figures.symbols import coefficient_symbol, plain, shortened

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_NAMED = 48
"""Coefficients whose names are written; of more, axes alone."""

_ONE_COLUMN = 40
"""Coefficients that one column of a journal holds."""

_TOLD = 3
"""Pairs named above the figure, at most."""

_LETTERS = 14
"""Letters of the title to the inch."""


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
        A square a pair, in the order of the model, axes divided by lines; the most
        correlated pairs are named. Coefficients without an error of their own, such as
        those of columns that are zero, are left grey.

    Raises
    ------
    MethodError
        If the fit has no covariance, or matplotlib is not installed.
    """
    covariance = fit.damping.covariance
    if covariance is None or not fit.model.n_coefficients:
        raise MethodError(
            f"'{fit.model.key}' by '{fit.method}' has no covariance, so no correlation can be "
            "drawn: use a method that gives one"
        )
    width = COLUMN if fit.model.n_coefficients <= _ONE_COLUMN else 0.75 * PAGE
    figure = sheet(width, 1.12 * width)
    panel = figure.subplots()
    panel.set_facecolor("#d9d9d9")
    # Few squares are drawn dot by dot, many are left to the viewer, as one dot a square.
    drawn = "nearest" if fit.model.n_coefficients <= _ONE_COLUMN else "none"
    image = panel.imshow(
        correlation(covariance), cmap="RdBu_r", vmin=-1.0, vmax=1.0, interpolation=drawn
    )
    _name(panel, fit)
    bar = figure.colorbar(image, ax=panel, location="bottom", shrink=0.8, aspect=30, pad=0.02)
    bar.set_label("correlation [1]")
    bar.ax.tick_params(labelsize=7.0)
    panel.set_title(_title(fit, covariance, int(width * _LETTERS)), loc="left")
    return figure


def _name(panel: Axes, fit: Fit) -> None:
    """Write names where they can be read, and divide axes by lines."""
    n, labels = fit.model.n_coefficients, fit.model.labels
    ends = np.cumsum([len(terms) for terms in fit.model.terms])
    panel.grid(visible=False)
    for end in sorted({*ends.tolist()} - {0, n}):
        panel.axhline(end - 0.5, color="#222222", linewidth=0.6)
        panel.axvline(end - 0.5, color="#222222", linewidth=0.6)
    settle(panel)
    if n <= _NAMED:
        symbols = [coefficient_symbol(label) for label in labels]
        panel.set_xticks(range(n), symbols, rotation=90)
        panel.set_yticks(range(n), symbols)
        panel.tick_params(length=0.0, pad=1.5, labelsize=7.0 if n <= 24 else 5.5)
        return
    axes = [axis for axis in range(6) if fit.model.terms[axis]]
    middles = [ends[axis] - 0.5 * len(fit.model.terms[axis]) - 0.5 for axis in axes]
    panel.set_xticks(middles, [f"${AXES[axis]}$" for axis in axes])
    panel.set_yticks(middles, [f"${AXES[axis]}$" for axis in axes])
    panel.tick_params(length=0.0)


def _title(fit: Fit, covariance: FloatArray, letters: int) -> str:
    """Return the fit, and its most correlated pairs."""
    labels, said, room = fit.model.labels, [], letters - len("most correlated: ")
    for i, j, value in correlated_pairs(covariance)[:_TOLD]:
        room -= len(f"{labels[i]} {labels[j]} -0.00, ")
        if room >= 0:
            symbols = f"{coefficient_symbol(labels[i])} {coefficient_symbol(labels[j])}"
            said.append(f"{symbols} ${value:+.2f}$")
    most = f"\nmost correlated: {', '.join(said)}" if said else ""
    return f"{plain(shortened(f'{fit.model.key} by {fit.method}', letters))}{most}"
