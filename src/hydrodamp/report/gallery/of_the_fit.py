"""Pictures of one fit: what the log determines, what errs together, what is left over."""

from __future__ import annotations

from collections.abc import Iterator

from hydrodamp.identification.dissipation.operating_box import TAIL, operating_box
from hydrodamp.identification.dissipation.power import worst_power
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.grades import Grade, Identifiability
from hydrodamp.identification.residuals import diagnose
from hydrodamp.report.correlated import ALIKE, Pair, correlated_pairs
from hydrodamp.report.figures.coefficients import correlation_figure
from hydrodamp.report.figures.diagnostics import excitation_figure, power_figure, residuals_figure
from hydrodamp.report.gallery.picture import Drawn, Sketch
from hydrodamp.report.gallery.words import listed
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.score import RateUnit

_PAIRS = 5
"""Correlated pairs named in a caption; the figure lists more."""


def sketches_of_fit(
    problem: Problem, fit: Fit, grades: Identifiability | None, rate_unit: RateUnit
) -> Iterator[Sketch]:
    """Return the pictures of a fit."""
    if grades is not None:
        known = grades
        yield Sketch("excitation", "Excitation by axis", lambda: _excitation(known))
    yield Sketch("correlation", "Correlation of coefficients", lambda: _correlation(fit))
    yield Sketch("residuals", "Residuals", lambda: _residuals(problem, fit))
    yield Sketch("power", "Power over the operating box", lambda: _power(problem, fit, rate_unit))


def _excitation(found: Identifiability) -> Drawn:
    quiet = [one.axis for one in found.axes if not one.excited]
    said = (
        f"The response is not predicted on {listed(quiet)}, for want of motion or of the right "
        "terms: no coefficient there is to be read alone, whatever the model as a whole predicts."
        if quiet
        else "The response is predicted on every axis with coefficients."
    )
    bars = "; ".join(
        f"{one.axis} {100.0 * one.share:.0f} %, "
        + ", ".join(f"{one.count(grade)} {grade.word}" for grade in Grade)
        for one in found.axes
    )
    return Drawn(
        excitation_figure(found),
        f"{said} Left, how much of the response is predicted on stretches held out (dashed: the "
        f"least that counts); right, how well each coefficient of {found.model.key} is determined.",
        f"Bars by axis, the predicted share of the response and coefficients by grade: {bars}.",
    )


def _correlation(fit: Fit) -> Drawn:
    figure = correlation_figure(fit)
    covariance, labels = fit.damping.covariance, fit.model.labels
    pairs = [] if covariance is None else correlated_pairs(covariance)
    named = [f"{labels[i]} with {labels[j]} ({value:+.2f})" for i, j, value in pairs[:_PAIRS]]
    most = f"; the most correlated are {listed(named)}" if named else ""
    return Drawn(
        figure,
        f"{_tied(pairs)}{most}. Each pair of coefficients is a square; a dark, framed one is such "
        "a pair, and the letters stand beside their axes.",
        f"Triangle of the correlations of {len(labels)} coefficients of {fit.model.key} by "
        f"{fit.method}, axes divided by lines{most}.",
    )


def _tied(pairs: list[Pair]) -> str:
    """Return how many pairs err together."""
    count = sum(abs(pair.correlation) >= ALIKE for pair in pairs)
    if not count:
        return f"No pair of coefficients errs together beyond {ALIKE:g}"
    if count == 1:
        return (
            f"1 pair of coefficients errs together beyond {ALIKE:g} and is known better together "
            "than apart"
        )
    return (
        f"{count} pairs of coefficients err together beyond {ALIKE:g} and are known better "
        "together than apart"
    )


def _residuals(problem: Problem, fit: Fit) -> Drawn:
    figure = residuals_figure(problem, [fit])
    axes = diagnose(problem, fit.model, fit.damping).axes
    coloured = [one.axis for one in axes if one.coloured]
    said = (
        f"On {listed(coloured)} neighbours err alike: the model lacks something there, and "
        "intervals made for white residuals would be too narrow."
        if coloured
        else "On no axis do neighbours err alike more than white residuals would."
    )
    sizes = ", ".join(f"{one.axis} {one.rms:.3g} {_unit(one.axis)}" for one in axes)
    return Drawn(
        figure,
        f"{said} White residuals would stay in the grey band; a peak in the spectrum (right) is "
        "motion that the model does not follow.",
        f"Autocorrelation and power spectrum of what {fit.model.key} by {fit.method} leaves over, "
        f"a row an axis; root mean squares are {sizes}.",
    )


def _power(problem: Problem, fit: Fit, rate_unit: RateUnit) -> Drawn:
    box = operating_box(problem)
    figure = power_figure([fit], box, rate_unit)
    worst = worst_power(fit.damping, box)
    said = (
        f"Somewhere in the box the damping drives the vehicle, by up to {worst.power:.3g} W, "
        "which water cannot: a simulation may run away there."
        if worst.power > 0.0
        else "Everywhere in the box that was searched the damping takes power, as water does."
    )
    return Drawn(
        figure,
        f"{said} The box is that of the estimation data but for {100.0 * TAIL:g} % of the samples "
        "at either end of each velocity, a quarter wider; above zero (shaded) power goes into the "
        "motion.",
        f"Power of {fit.model.key} by {fit.method} over each velocity, the middle as a line and "
        f"its range as a band; the box is {box}; the greatest power found is {worst.power:.3g} W.",
    )


def _unit(axis: str) -> str:
    return "N" if axis in "XYZ" else "N m"
