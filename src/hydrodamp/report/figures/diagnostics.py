"""Diagnostic figures: Pareto front, horizons, identifiability, residuals, power, correlation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hydrodamp.basis.term import AXES, VELOCITIES
from hydrodamp.errors import MethodError
from hydrodamp.identification.dissipativity import OperatingBox, max_damping_power, power_range
from hydrodamp.identification.fit import Fit, correlation
from hydrodamp.identification.grades import MIN_R_SQUARED, Grade
from hydrodamp.identification.identifiability import Identifiability
from hydrodamp.models.model import DampingModel
from hydrodamp.report.figures import style
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.replay import HorizonScore, RateUnit
from hydrodamp.validation.compare import Comparison
from hydrodamp.validation.diagnostics import autocorrelations
from hydrodamp.validation.selection import pareto_front, relative_errors

if TYPE_CHECKING:
    from matplotlib.axes import Axes
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
    if any(row.rms is None for row in rows):
        entries.append(("no error: diverged or failed", {"color": style.FAINT, **_NO_ERROR}))
    style.legend(figure, entries, columns=3)
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
    panel.set_xlabel("prediction horizon")
    panel.set_ylabel(f"RMS error, eq. 24\n[m/s and {all_scores[0].score.rate_unit}/s]")
    style.legend(figure, entries)
    return figure


# Colour and hatching: from dark (determined) to light.
_GRADES = {
    Grade.DETERMINED: ("#0072B2", ""),
    Grade.MINOR: ("#5ea5d3", "...."),
    Grade.WEAK: ("#b9dbef", "////"),
    Grade.NOT_DETERMINED: ("#d0d0d0", ""),
}
_BAR = {"height": 0.62, "edgecolor": "#4d4d4d"}


@style.with_style
def excitation_figure(identifiability: Identifiability) -> Figure:
    """Draw how far each axis is excited, and how well its coefficients are determined.

    Parameters
    ----------
    identifiability : Identifiability
        Of :func:`hydrodamp.identifiability`.

    Returns
    -------
    figure : Figure
        To the left the share of the response to motion that is predicted on stretches
        held out, with the least share that counts as excited; to the right how many
        coefficients have which grade, with the rank.

    Raises
    ------
    MethodError
        If the model has no coefficient, or matplotlib is not installed.
    """
    rows, key = identifiability.axes, identifiability.model.key
    if not rows:
        raise MethodError(f"model '{key}' has no coefficient: there is nothing to draw")
    axes = [f"${axis.axis}$" for axis in rows]
    figure = style.new_figure(style.COLUMN, 0.28 * len(axes) + 1.0)
    excited_panel, grade_panel = figure.subplots(1, 2, sharey=True, width_ratios=(1.0, 1.15))
    colours = ["#8c8c8c" if axis.excited else "#ffffff" for axis in rows]
    bars = excited_panel.barh(axes, [axis.r_squared for axis in rows], color=colours, **_BAR)
    for bar, axis in zip(bars, rows, strict=True):
        label = f"{100.0 * axis.r_squared:.0f} %{'' if axis.excited else ', not predicted'}"
        excited_panel.text(0.03, bar.get_y() + 0.31, label, va="center", fontsize=6.5)
    excited_panel.axvline(MIN_R_SQUARED, color=style.FAINT, linewidth=0.9, linestyle="--")
    excited_panel.set_xlim(0.0, 1.0)
    excited_panel.set_xlabel("predicted share of\nthe response [1]")
    start = np.zeros(len(axes))
    for grade, (colour, hatch) in _GRADES.items():
        counts = np.array([axis.count(grade) for axis in rows], dtype=float)
        bars = grade_panel.barh(axes, counts, left=start, color=colour, hatch=hatch, **_BAR)
        bars.set_label(grade.word)
        start += counts
    ranks = [f"rank {axis.rank}" for axis in rows]
    grade_panel.bar_label(bars, ranks, padding=2.0, fontsize=6.5)
    grade_panel.set_xlim(0.0, 1.32 * start.max())
    grade_panel.locator_params(axis="x", integer=True, nbins=5)
    grade_panel.set_xlabel(f"coefficients by grade,\n{style.escape_text(key, 24)}")
    grade_panel.invert_yaxis()
    for panel in (excited_panel, grade_panel):
        panel.grid(visible=False, axis="y")
        panel.tick_params(axis="y", length=0.0)
    figure.legend(loc="outside upper right", ncols=4, handlelength=1.0)
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
        Such as :func:`hydrodamp.operating_box` of a log.
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


CELL_SIZE = 0.125  # in; side of a square with a readable label
LABEL_WIDTH = 0.75  # in; width of the labels

# Coefficients whose names fit the page.
MAX_NAMED = int((style.PAGE - LABEL_WIDTH) / CELL_SIZE)


@style.with_style
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
        Squares of coefficients without a standard error, such as those of zero regressors,
        are grey.

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
    width = min(max(n * CELL_SIZE + LABEL_WIDTH, style.COLUMN), style.PAGE)
    figure = style.new_figure(width, 1.06 * width)
    panel = figure.subplots()
    below = np.tri(n, k=-1, dtype=bool)
    panel.imshow(np.ma.masked_array(np.full((n, n), 0.35), ~below), cmap="Greys", vmin=0, vmax=1)
    correlations = np.ma.masked_invalid(np.where(below, correlation(covariance), np.nan))
    image = panel.imshow(correlations, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    panel.grid(visible=False)
    panel.spines[:].set_visible(False)
    panel.tick_params(length=0.0, pad=1.5)
    _divide(panel, model)
    if n <= MAX_NAMED:
        symbols = [style.coefficient_symbol(label) for label in model.labels]
        panel.set_xticks(range(n), symbols, rotation=90.0)
        panel.set_yticks(range(n), symbols)
    bar = figure.colorbar(image, ax=panel, location="bottom", shrink=0.7, aspect=35, pad=0.02)
    bar.set_ticks([-1.0, -0.5, 0.0, 0.5, 1.0])
    bar.set_label("correlation of errors [1]")
    panel.set_title(style.escape_text(f"{model.key} by {fit.method}", int(14 * width)))
    return figure


def _divide(panel: Axes, model: DampingModel) -> None:
    """Separate axes by lines, and label them along the diagonal."""
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
