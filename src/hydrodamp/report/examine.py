"""What the training log says of the chosen row, asked after the fits, and each picture of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.basis.atoms import VELOCITIES
from hydrodamp.data.log import Log
from hydrodamp.errors import HydrodampError
from hydrodamp.identification.dissipativity import TAIL, max_damping_power, operating_box
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.identifiability import Identifiability, grade_fit
from hydrodamp.identification.residuals import diagnose
from hydrodamp.report.figures.diagnostics import (
    correlation_figure,
    excitation_figure,
    front_figure,
    horizons_figure,
    power_figure,
    residuals_figure,
)
from hydrodamp.report.figures.series import commands_figure, replays_figure, velocities_figure
from hydrodamp.report.figures.style import figure_bytes
from hydrodamp.report.files import Findings, Picture, chosen_row
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.simulation.replay import RateUnit, horizon_scores
from hydrodamp.validation.bands import PredictionBand, prediction_band
from hydrodamp.validation.compare import Comparison, Row
from hydrodamp.validation.selection import error_of
from hydrodamp.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: What to do where there are no pictures.
MISSING = (
    'The pictures need the package matplotlib: pip install "hydrodamp[report]", then run the '
    "command again."
)

# Longest step of a band's replay [s], how many steps times coefficients take a second or so for
# it, and rows in one picture.
_STEP, _WORK, _TOGETHER = 0.05, 4e6, 4

#: Name and caption of a picture still to be drawn, and how.
Sketch = tuple[str, str | Callable[[], str], Callable[[], "Figure"]]


def examine(comparison: Comparison, vehicle: Vehicle, train: Log) -> Findings:
    """Grade the coefficients of the chosen row, band its replay and draw its pictures."""
    row, grades, band, not_graded = chosen_row(comparison), None, None, []
    sketches: list[Sketch] = []
    if row is not None:
        problem = prepare(vehicle, train, row.fit.model)
        try:
            grades = grade_fit(problem, row.fit) if row.n_coefficients else None
        except HydrodampError as error:
            not_graded = [_sentence("What the log determines is not known", error)]
        band = _band(vehicle, row)
        sketches += _of_replays(comparison, vehicle, row, band)
        sketches += _of_fit(problem, row.fit, grades, comparison.rate_unit)
    sketches += (
        (
            "estimation-velocities",
            "What the models were estimated from. A velocity that hardly moves teaches nothing of "
            "its damping.",
            lambda: velocities_figure(train, comparison.rate_unit),
        ),
        (
            "estimation-actuation",
            "What drove the vehicle over the same time, and how it lay.",
            lambda: commands_figure(train),
        ),
    )
    pictures, not_drawn = draw_pictures(sketches) if find_spec("matplotlib") else ((), (MISSING,))
    return Findings(grades, band, pictures, (*not_drawn, *not_graded))


def _band(vehicle: Vehicle, row: Row) -> PredictionBand | None:
    """Return the band of a replay, where there are standard errors and it is quickly made."""
    run, covariance = row.trajectory, row.fit.damping.covariance
    if run is None or run.attitude != "measured" or covariance is None:
        return None
    work = max(run.log.n, run.log.duration / _STEP) * len(covariance)
    if not 0.0 < work <= _WORK or not np.isfinite(covariance).all():
        return None
    known = row.fit.uncertainty
    freedom = np.inf if known is None else known.degrees_of_freedom
    problem = prepare(vehicle, run.log, row.fit.model)
    with np.errstate(over="ignore", invalid="ignore"):  # a replay that runs away has no band
        return prediction_band(problem, row.fit.damping, degrees_of_freedom=freedom)


def draw_pictures(sketches: Iterable[Sketch]) -> tuple[tuple[Picture, ...], tuple[str, ...]]:
    """Draw sketches; of one that cannot be drawn, return the reason."""
    pictures: list[Picture] = []
    not_drawn: list[str] = []
    for name, caption, draw in sketches:
        try:
            figure, said = draw(), caption if isinstance(caption, str) else caption()
        except HydrodampError as error:
            not_drawn.append(_sentence(name.capitalize(), error))
        else:
            width, height = (round(96 * inches) for inches in figure.get_size_inches())
            pictures.append(Picture(name, said, width, height, figure_bytes(figure, "svg")))
    return tuple(pictures), tuple(not_drawn)


def _sentence(what: str, error: HydrodampError) -> str:
    return f"{what}: {error}".rstrip(".") + "."


def _of_replays(
    comparison: Comparison, vehicle: Vehicle, row: Row, band: PredictionBand | None
) -> Iterator[Sketch]:
    """Return the pictures of errors and replays."""
    run, unit, best = row.trajectory, comparison.rate_unit, best_of_each_method(comparison, row)
    if len(comparison.rows) > 1:
        yield (
            "front",
            "RMS error and size: the line joins the rows that no other row beats in both.",
            lambda: front_figure(comparison),
        )
    if run is None:
        return
    yield (
        "horizons",
        "RMS error over the time since the replay last saw a measurement. Short horizons are what "
        "an observer needs, the whole run is what a simulator needs.",
        lambda: horizons_figure(
            {
                (one.model, one.method): horizon_scores(
                    vehicle, one.fit.damping, run.log, attitude=run.attitude, rate_unit=unit
                )
                for one in best
            }
        ),
    )
    yield (
        "replays",
        "Measured against replayed: the chosen row, and the row of every other method with the "
        f"lowest error.{f' {said_of_band(row)}' if band else ''}",
        lambda: replays_figure(best, band),
    )


def _of_fit(
    problem: Problem, fit: Fit, grades: Identifiability | None, rate_unit: RateUnit
) -> Iterator[Sketch]:
    """Return the pictures of the chosen fit."""
    if grades is not None:
        yield (
            "excitation",
            "Left, how much of the response of each axis is predicted on stretches held out "
            "(dashed: the least that counts); right, how well each coefficient is determined. Do "
            "not read single coefficients of an axis that is not predicted, for want of motion or "
            "of the right terms.",
            lambda: excitation_figure(grades),
        )
    yield (
        "correlation",
        "Of two coefficients whose errors are correlated, the sum or the difference is known "
        "better than each of them. Each pair is a square, and lines divide the axes.",
        lambda: correlation_figure(fit),
    )
    yield (
        "residuals",
        partial(_said_of_residuals, problem, fit),
        lambda: residuals_figure(problem, fit),
    )
    yield (
        "power",
        partial(_said_of_power, problem, fit),
        lambda: power_figure(fit, operating_box(problem), rate_unit),
    )


def _said_of_residuals(problem: Problem, fit: Fit) -> str:
    """Return whether residuals are coloured, and what to see in their picture."""
    said = diagnose(problem, fit.damping)
    if not any("autocorrelated" in one for one in said):
        said = ("Residuals are white, as far as a test sees.", *said)
    seen = "White ones stay in the grey band; where they leave it, the model lacks something."
    return " ".join((*said, seen))


def _said_of_power(problem: Problem, fit: Fit) -> str:
    """Return whether damping drives the vehicle, where most, and what the box is."""
    power, velocity = max_damping_power(fit.damping, operating_box(problem))
    place = ", ".join(
        f"{name} {value:.2g}" for name, value in zip(VELOCITIES, velocity, strict=True) if value
    )
    said = (
        f"The damping drives the vehicle above zero (shaded), with {power:.3g} W at most, at "
        f"{place} (m/s, rad/s). Water cannot do that, and a simulation may run away there."
        if power > 0.0
        else "The damping takes power wherever in the box a search looked, as water does."
    )
    return (
        f"{said} The box is that of the estimation data but for {100.0 * TAIL:g} % of the samples "
        "at either end of each velocity, a quarter wider."
    )


def best_of_each_method(comparison: Comparison, first: Row) -> tuple[Row, ...]:
    """Return a row, then the one with the lowest error of every other method."""
    best = {first.method: first}
    for row in sorted(comparison.rows, key=error_of):
        if row.rms is not None:
            best.setdefault(row.method, row)
    return tuple(best.values())[:_TOGETHER]


def said_of_band(row: Row) -> str:
    """Return what is said of the band of a row."""
    return (
        f"Shaded, of {row.model} by {row.method}: where 95 % of the replays would run at each "
        "moment if the coefficients erred as their standard errors say, to first order. Neither "
        "the noise of the measurements nor what the model's form cannot express is in the band."
    )
