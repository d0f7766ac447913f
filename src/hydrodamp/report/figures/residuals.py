"""What models leave over: correlated in time or white, and at which frequencies."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.basis.axes import AXES
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.rows.support import chosen_support
from hydrodamp.identification.rows.weak_equations import WeakEquations
from hydrodamp.identification.trust.residual_series import (
    ResidualSeries,
    left_over,
    series,
    white_reach,
)
from hydrodamp.report.figures.apart import SAMPLE, Look, looks_of
from hydrodamp.report.figures.look import COLUMN, FAINT, in_our_look, settle, sheet
from hydrodamp.report.figures.symbols import plain, shortened
from hydrodamp.simulation.problem import Problem

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LEAST = 1e-6
"""Least density shown, as a share of the greatest of its axis."""


@in_our_look
def residuals_figure(problem: Problem, fits: Iterable[Fit], support: float | None = None) -> Figure:
    """Draw autocorrelation and spectrum of what fits leave over, axis by axis.

    Residuals are those that :func:`hydrodamp.identification.trust.diagnostics.diagnose`
    examines: of the weak form, under test functions that follow each other and share no
    sample.

    Parameters
    ----------
    problem : Problem
        Prepared for the terms of all fits.
    fits : iterable of Fit
        Those without numbers are left out.
    support : float, optional
        Length of the test functions [s]; by default as :class:`WeakEquations` chooses it.

    Returns
    -------
    figure : Figure
        One column wide. Colour is the method, dashes are the model. Correlations of white
        residuals would stay in the grey band at nineteen lags of twenty.

    Raises
    ------
    MethodError
        If no fit has numbers, the log is too short, or matplotlib is not installed.
    """
    usable = [fit for fit in fits if fit.status.usable and fit.model.n_coefficients]
    if not usable:
        raise MethodError("no fit has coefficients, so there are no residuals to draw")
    length = chosen_support(problem).length if support is None else support
    rows = WeakEquations(length, overlap=1, windows=()).rows(problem)
    left = [left_over(rows, fit.damping) for fit in usable]
    axes = [axis for axis in range(6) if any(fit.model.terms[axis] for fit in usable)]
    figure = sheet(COLUMN, 0.72 * len(axes) + 0.9 + 0.13 * len(usable))
    panels = figure.subplots(len(axes), 2, sharex="col", squeeze=False)
    looks = looks_of([(fit.model.key, fit.method) for fit in usable])
    for axis, (lags, spectrum) in zip(axes, panels, strict=True):
        for one, fit, look in zip(left, usable, looks, strict=True):
            if fit.model.terms[axis]:
                _draw(lags, spectrum, series(one[:, axis], rows.segment, length), look)
        _finish(lags, spectrum, AXES[axis], white_reach(rows.n))
    panels[-1, 0].set_xlabel("lag [s]")
    panels[-1, 1].set_xlabel("frequency [Hz]")
    panels[0, 0].set_title("autocorrelation\n[1]", loc="left")
    panels[0, 1].set_title("power density\n[N²/Hz, (N m)²/Hz]", loc="left")
    _legend(figure, usable, looks)
    return figure


def _draw(lags: Axes, spectrum: Axes, found: ResidualSeries, look: Look) -> None:
    colour, dashes = look.colour, look.linestyle
    lags.plot(found.lag, found.correlation, color=colour, linestyle=dashes)
    seen = found.density > 0.0
    spectrum.plot(found.frequency[seen], found.density[seen], color=colour, linestyle=dashes)


def _finish(lags: Axes, spectrum: Axes, axis: str, white: float) -> None:
    lags.axhspan(-white, white, color="#dcdcdc", linewidth=0.0, zorder=0.5)
    lags.axhline(0.0, color=FAINT, linewidth=0.5)
    lags.set_xlim(left=0.0)
    lags.set_ylim(-0.65, 1.05)
    lags.set_ylabel(f"${axis}$", rotation=0, va="center", labelpad=8.0)
    spectrum.set_yscale("log")
    spectrum.set_xlim(left=0.0)
    _decades(spectrum)
    for panel in (lags, spectrum):
        settle(panel)


def _decades(panel: Axes) -> None:
    """Let a panel reach from a power of ten to another, and write no others."""
    densities = np.concatenate([np.asarray(line.get_ydata()) for line in panel.lines])
    if not len(densities):
        return
    high = float(np.ceil(np.log10(densities.max())))
    low = float(np.floor(np.log10(max(densities.min(), _LEAST * densities.max()))))
    high += low == high
    panel.set_ylim(10.0**low, 10.0**high)
    step = -(-int(high - low) // 3)
    panel.set_yticks(10.0 ** np.arange(low, high + 1, step))
    panel.set_yticks([], minor=True)


def _legend(figure: Figure, fits: list[Fit], looks: list[Look]) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Line2D | Patch] = [
        Line2D([], [], color=look.colour, linestyle=look.linestyle, label=_said(fit))
        for fit, look in zip(fits, looks, strict=True)
    ]
    handles.append(Patch(facecolor="#dcdcdc", edgecolor="none", label="white residuals, 95 %"))
    figure.legend(handles=handles, loc="outside upper left", labelspacing=0.25, handlelength=SAMPLE)


def _said(fit: Fit) -> str:
    return plain(shortened(f"{fit.model.key} by {fit.method}", 44))
