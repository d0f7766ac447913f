"""Diagnostic figures: Pareto front, errors by horizon, residuals, power."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hydrodamp.basis.term import VELOCITIES
from hydrodamp.errors import MethodError
from hydrodamp.identification.dissipativity import OperatingBox, max_damping_power, power_range
from hydrodamp.identification.fit import Fit
from hydrodamp.report.figures import style
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.replay import HorizonScore, RateUnit
from hydrodamp.validation.compare import Comparison
from hydrodamp.validation.diagnostics import autocorrelations
from hydrodamp.validation.selection import pareto_front, relative_errors

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_COLUMN_MODELS = 14  # models in a figure of one journal column

#: Marker of a row without an error.
_NO_ERROR: dict[str, Any] = {"marker": "x", "markersize": 6.0, "linestyle": "none"}


@style.with_style
def front_figure(comparison: Comparison) -> Figure:
    """Draw relative error against the number of coefficients, with the Pareto front.

    Parameters
    ----------
    comparison : Comparison
        Rows that have not converged are hollow; those without an error are crosses at
        the upper edge.

    Returns
    -------
    figure : Figure
        Models in order of their number of coefficients, with all methods of a model next to
        each other. Errors are on a logarithmic scale. The line is the Pareto front.

    Raises
    ------
    MethodError
        If no row with coefficients has an error, or matplotlib is not installed.
    """
    rows = [row for row in comparison.rows if row.n_coefficients]
    if all(row.rms is None for row in rows):
        raise MethodError("no row with coefficients has an error, so there is no Pareto front")
    sizes = {row.model: row.n_coefficients for row in rows}
    models, methods = sorted(sizes, key=sizes.__getitem__), comparison.methods
    step = min(0.7 / len(methods), 0.2)

    def position(model: str, method: str) -> float:
        return models.index(model) + step * (methods.index(method) - 0.5 * (len(methods) - 1))

    width = style.COLUMN if len(models) <= MAX_COLUMN_MODELS else style.PAGE
    figure = style.new_figure(width, 3.3 + 0.05 * len(methods))
    panel = figure.subplots()
    keys = ((row.model, row.method) for row in comparison.rows)
    errors = dict(zip(keys, relative_errors(comparison), strict=True))
    best = [(row.model, row.method) for row in pareto_front(comparison) if row.n_coefficients]
    across = [position(*key) for key in best]
    line: dict[str, Any] = {"color": style.FAINT, "linewidth": 1.2}
    panel.plot(across, [*map(errors.__getitem__, best)], drawstyle="steps-post", **line)
    looks = style.line_styles([(row.model, row.method) for row in rows])
    for row, look in zip(rows, looks, strict=True):
        at = position(row.model, row.method)
        if row.rms is None:
            edge = panel.get_xaxis_transform()
            panel.plot([at], [1.0], transform=edge, clip_on=False, color=look.colour, **_NO_ERROR)
            continue
        (point,) = panel.plot([at], [errors[row.model, row.method]], **look.points)
        point.set_markerfacecolor(look.colour if row.converged else "white")
    style.error_scale(panel)
    names = [f"{style.escape_text(model, 22)}, {sizes[model]}" for model in models]
    panel.set_xticks(range(len(models)), names, rotation=40.0, ha="right", rotation_mode="anchor")
    panel.set_xlabel("model and number of its coefficients")
    panel.set_ylabel("relative error [% of the motion]")
    markers = {
        row.method: look.points | {"color": style.FAINT}
        for row, look in zip(rows, looks, strict=True)
    }
    entries = [(method, markers[method]) for method in methods if method in markers]
    entries.append(("Pareto front", line))
    hollow = {"color": style.FAINT, "marker": "o", "markerfacecolor": "white", "linestyle": "none"}
    if not all(row.converged for row in rows if row.rms is not None):
        entries.append(("not converged", hollow))
    if diverged := ", ".join(dict.fromkeys(row.model for row in rows if row.rms is None)):
        entries.append((f"diverged or failed: {diverged}", {"color": style.FAINT, **_NO_ERROR}))
    style.legend(figure, entries, columns=1 if diverged else 3)
    return figure


@style.with_style
def horizons_figure(scores: Mapping[tuple[str, str], Sequence[HorizonScore]]) -> Figure:
    """Draw the RMS error at each horizon.

    Parameters
    ----------
    scores : mapping of (model, method) to sequence of HorizonScore
        All on the same log. Horizons are equidistant, in the given order. Where
        a window diverged there is no error; the legend says how many did.

    Returns
    -------
    figure : Figure
        One column wide, errors on a logarithmic scale. Colour is the model, marker and
        dashes are the method.

    Raises
    ------
    MethodError
        If there is no score, units differ, or matplotlib is not installed.
    """
    all_scores = [score for horizons in scores.values() for score in horizons]
    if not all_scores:
        raise MethodError("there is no score at any horizon to draw")
    if len({score.score.rate_unit for score in all_scores}) > 1:
        raise MethodError("all scores of one figure must have the same `rate_unit`")
    figure = style.new_figure(style.COLUMN, 2.4 + 0.13 * len(scores))
    panel = figure.subplots()
    entries = []
    for (pair, horizons), look in zip(scores.items(), style.line_styles(list(scores)), strict=True):
        errors = [score.score.rms or np.nan for score in horizons]
        line = {**look.line, "marker": look.marker}
        panel.plot([score.name for score in horizons], errors, **line)
        share = max(score.diverged_share for score in horizons)
        suffix = f", up to {100.0 * share:.2g} % of windows diverged" if share else ""
        entries.append((f"{' by '.join(pair)}{suffix}", line))
    style.error_scale(panel)
    ends, powers = panel.get_ylim(), range(-9, 10)
    ticks = [float(f"{digit}e{power}") for power in powers for digit in (1, 2, 5)]
    low = max((tick for tick in ticks if tick <= ends[0]), default=ends[0])
    panel.set_ylim(low, min((tick for tick in ticks if tick >= ends[1]), default=ends[1]))
    panel.set_xlabel("prediction horizon")
    panel.set_ylabel(f"RMS error, eq. 24\n[m/s and {all_scores[0].score.rate_unit}/s]")
    style.legend(figure, entries)
    return figure


@style.with_style
def residuals_figure(problem: Problem, fit: Fit) -> Figure:
    """Draw the autocorrelation of the residuals of a fit by axis.

    Residuals are those that :func:`hydrodamp.diagnose` examines: of the weak form, under test
    functions that follow each other and share no sample.

    Parameters
    ----------
    problem : Problem
        Prepared for the terms of the fit.
    fit : Fit
        With coefficients.

    Returns
    -------
    figure : Figure
        One column wide. Correlations of white residuals would stay in the grey band at nineteen
        lags of twenty.

    Raises
    ------
    MethodError
        If the fit has no numbers, the log is too short, or matplotlib is not installed.
    """
    name, look = style.named_style(fit)
    lag, white, (by_axis,) = autocorrelations(problem, [fit.damping])
    figure = style.new_figure(style.COLUMN, 1.05 * -(-len(by_axis) // 2) + 0.63)
    panels = style.panel_grid(figure, len(by_axis), min(2, len(by_axis)), sharey=True)
    for (axis, series), panel in zip(by_axis.items(), panels, strict=True):
        panel.plot(lag, series, **look.line)
        panel.axhspan(-white, white, color=style.SHADE, linewidth=0.0)
        panel.set(xlim=(0.0, None), ylim=(-1.05, 1.05), xlabel="lag [s]")
        panel.set_ylabel(f"${axis}$", rotation=0, va="center", labelpad=8.0)
    figure.supylabel("autocorrelation [1]", fontsize=7.5)
    shade = {"color": style.SHADE, "linewidth": 5.0}
    style.legend(figure, [(name, look.line), ("white residuals, 95 %", shade)])
    return figure


@style.with_style
def power_figure(fit: Fit, box: OperatingBox, rate_unit: RateUnit = "deg") -> Figure:
    """Draw the power that damping puts into the motion over an operating box.

    Parameters
    ----------
    fit : Fit
        With coefficients.
    box : OperatingBox
        Such as :func:`~hydrodamp.identification.dissipativity.operating_box` of a log.
    rate_unit : {"deg", "rad"}
        Unit of angular rates.

    Returns
    -------
    figure : Figure
        One column wide, a panel for each velocity that moves: the line is the middle of
        the power, the band all of it, over the other velocities of the box. Above zero (shaded)
        the damping injects energy, which is not physical. The legend gives the maximum power
        that a search found.

    Raises
    ------
    MethodError
        If the fit has no numbers, the box has no extent, or matplotlib is not installed.
    """
    title, look = style.named_style(fit)
    names = np.array(VELOCITIES)[box.low < box.high].tolist()
    if not names:
        raise MethodError("power is drawn on a box with an extent; got a box of one point")
    figure = style.new_figure(style.COLUMN, 1.05 * -(-len(names) // 2) + 0.63)
    panels = style.panel_grid(figure, len(names), min(2, len(names)), sharey=True)
    for name, panel in zip(names, panels, strict=True):
        velocity, power = power_range(fit.damping, box, name)
        if style.velocity_unit(name, rate_unit) == "deg/s":
            velocity = np.degrees(velocity)
        least, greatest = power.min(axis=1), power.max(axis=1)
        colour = look.colour, style.BAND
        panel.fill_between(velocity, least, greatest, color=colour, linewidth=0.0)
        panel.plot(velocity, greatest, linewidth=0.6, **look.line)
        panel.plot(velocity, np.median(power, axis=1), linewidth=1.1, **look.line)
        panel.axhline(0.0, color=style.FAINT)
        panel.margins(x=0.0)
        panel.set_xlabel(style.velocity_label(name, rate_unit))
    low, high = panels[0].get_ylim()
    high = max(high, 0.12 * (high - low))
    for panel in panels:
        panel.axhspan(0.0, high, color=style.SHADE, linewidth=0.0, zorder=0.5)
    panels[0].set_ylim(low, high)
    figure.supylabel("power into the motion [W]", fontsize=7.5)
    most = max_damping_power(fit.damping, box).power
    style.legend(figure, [(f"{title}: at most {most:.3g} W", look.line)])
    return figure
