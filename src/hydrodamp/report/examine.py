"""What the training log says of the chosen row, asked after the fits, and each picture of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from importlib.util import find_spec
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hydrodamp.data.log import Log
from hydrodamp.errors import HydrodampError, MethodError
from hydrodamp.identification.adaptive import AdaptiveIdentifier
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.grades import Identifiability, graded
from hydrodamp.identification.methods import METHODS
from hydrodamp.identification.power import TAIL, operating_box
from hydrodamp.report.figures.coefficients import coefficients_figure, correlation_figure
from hydrodamp.report.figures.diagnostics import (
    excitation_figure,
    history_figure,
    power_figure,
    residuals_figure,
)
from hydrodamp.report.figures.look import figure_bytes
from hydrodamp.report.figures.scores import front_figure, horizons_figure
from hydrodamp.report.figures.series import commands_figure, replays_figure, velocities_figure
from hydrodamp.report.files import Findings, Picture, chosen_row
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.simulation.replay import AttitudeSource
from hydrodamp.simulation.score import HorizonScores, horizon_scores
from hydrodamp.validation.bands import PredictionBand, prediction_band
from hydrodamp.validation.choice import error_of
from hydrodamp.validation.compare import Comparison, Row
from hydrodamp.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: What to do where there are no pictures.
MISSING = (
    'The pictures need the package matplotlib: pip install "hydrodamp[report]", then run the '
    "command again."
)

# Longest step of a band's replay [s], and how many steps times coefficients take a second or so
# for a band and for a history, of which so many steps are drawn.
_STEP = 0.05
_WORK_OF_BAND, _WORK_OF_HISTORY = 4e6, 1e8
_STEPS_KEPT = 3000

# Rows in one picture.
_TOGETHER = 4


class Sketch(NamedTuple):
    """A picture still to be drawn."""

    name: str
    title: str
    caption: str
    draw: Callable[[], Figure]


def drawable() -> bool:
    """Tell whether what pictures need is installed."""
    return find_spec("matplotlib") is not None


def examine(comparison: Comparison, vehicle: Vehicle, train: Log) -> Findings:
    """Grade the coefficients of the chosen row, band its replay and draw its pictures."""
    row, grades, band, not_graded = chosen_row(comparison), None, None, []
    sketches: list[Sketch] = []
    if row is not None:
        problem = prepare(vehicle, train, row.fit.model)
        try:
            grades = graded(problem, row.fit) if row.n_coefficients else None
        except HydrodampError as error:
            not_graded = [_sentence(f"What the log determines is not known: {error}")]
        band = _band(vehicle, row)
        sketches += _of_row(comparison, vehicle, problem, row, grades, band)
    sketches += _of_logs(comparison, vehicle, train)
    pictures, not_drawn = painted(sketches) if drawable() else ((), (MISSING,))
    return Findings(grades, band, pictures, (*not_drawn, *not_graded))


def _band(vehicle: Vehicle, row: Row) -> PredictionBand | None:
    """Return the band of a replay, where there are standard errors and it is quickly made."""
    run, covariance = row.trajectory, row.fit.damping.covariance
    if run is None or run.attitude != "measured" or covariance is None:
        return None
    steps = max(run.log.n, run.log.duration / _STEP)
    work = steps * len(covariance)
    if not 0.0 < work <= _WORK_OF_BAND or not np.isfinite(covariance).all():
        return None
    known = row.fit.uncertainty
    freedom = np.inf if known is None else known.degrees_of_freedom
    problem = prepare(vehicle, run.log, row.fit.model)
    with np.errstate(over="ignore", invalid="ignore"):  # a replay that runs away has no band
        return prediction_band(problem, row.fit.damping, degrees_of_freedom=freedom, max_step=_STEP)


def painted(sketches: Iterable[Sketch]) -> tuple[tuple[Picture, ...], tuple[str, ...]]:
    """Draw sketches; of one that cannot be drawn, return the reason."""
    pictures: list[Picture] = []
    not_drawn: list[str] = []
    for name, title, caption, draw in sketches:
        try:
            figure = draw()
        except HydrodampError as error:
            not_drawn.append(_sentence(f"{title}: {error}"))
        else:
            width, height = (round(96 * inches) for inches in figure.get_size_inches())
            drawing = figure_bytes(figure, "svg")
            pictures.append(Picture(name, title, caption, width, height, drawing))
    return tuple(pictures), tuple(not_drawn)


def _sentence(text: str) -> str:
    """Return what an error says as a sentence."""
    return f"{text[0].upper()}{text[1:].rstrip('.')}."


def _of_row(
    comparison: Comparison,
    vehicle: Vehicle,
    problem: Problem,
    row: Row,
    grades: Identifiability | None,
    band: PredictionBand | None,
) -> Iterator[Sketch]:
    """Return the pictures of the chosen row and of what it is compared with."""
    fit, models = row.fit, (row.model, *comparison.models)
    if len(comparison.rows) > 1:
        yield Sketch(
            "front",
            "Error and size",
            "The line joins the rows that no other row beats in both error and size.",
            lambda: front_figure(comparison),
        )
    if row.trajectory is not None:
        best = best_of_each_method(comparison, row)
        yield Sketch(
            "horizons",
            "Error growth with horizon",
            "RMS error over the time since the replay last saw a measurement. Short horizons are "
            "what an observer needs, the whole run is what a simulator needs.",
            lambda: horizons_figure(_by_horizon(comparison, vehicle, best), models),
        )
        yield Sketch(
            "replays",
            "Measured against replayed",
            "The chosen row, and the row of every other method with the lowest error."
            + (f" {said_of_band(row)}" if band else ""),
            lambda: replays_figure(best, {(row.model, row.method): band} if band else None, models),
        )
    if grades is not None:
        yield Sketch(
            "excitation",
            "Excitation by axis",
            "Left, how much of the response is predicted on stretches held out (dashed: the least "
            "that counts); right, how well each coefficient is determined. Do not read single "
            "coefficients of an axis that is not predicted, for want of motion or of the right "
            "terms.",
            lambda: excitation_figure(grades),
        )
    same = [one.fit for one in comparison.rows if one.model == row.model and one is not row]
    yield Sketch(
        "coefficients",
        "Coefficients",
        "With 95 % intervals where they are known; one across zero leaves the sign open.",
        lambda: coefficients_figure([fit, *(one for one in same if one.status.usable)][:_TOGETHER]),
    )
    yield Sketch(
        "correlation",
        "Correlation of coefficients",
        "Of two coefficients whose errors are correlated, the sum or the difference is known "
        "better than each of them. Each pair is a square, and lines divide the axes.",
        lambda: correlation_figure(fit),
    )
    yield Sketch(
        "residuals",
        "Residuals",
        "White residuals stay in the grey band. On an axis where they leave it, the model lacks "
        "something, and intervals for white residuals would be too narrow; a peak in the spectrum "
        "(right) is motion that the model does not follow.",
        lambda: residuals_figure(problem, [fit]),
    )
    yield Sketch(
        "power",
        "Power over the operating box",
        "Above zero (shaded) the damping drives the vehicle, which water cannot do: a simulation "
        f"may run away there. The box is that of the estimation data but for {100.0 * TAIL:g} % of "
        "the samples at either end of each velocity, a quarter wider.",
        lambda: power_figure([fit], operating_box(problem), comparison.rate_unit),
    )


def _of_logs(comparison: Comparison, vehicle: Vehicle, train: Log) -> Iterator[Sketch]:
    """Return the pictures that there are without any choice too."""
    yield Sketch(
        "estimation-velocities",
        "Estimation data: velocities",
        "What the models were estimated from. A velocity that hardly moves teaches nothing of its "
        "damping.",
        lambda: velocities_figure(train, comparison.rate_unit),
    )
    yield Sketch(
        "estimation-actuation",
        "Estimation data: actuation",
        "What drove the vehicle over the same time, and how it lay.",
        lambda: commands_figure(train),
    )
    for key in comparison.methods:
        method = METHODS[key].value() if key in METHODS else None
        if isinstance(method, AdaptiveIdentifier):
            fit = min((row for row in comparison.rows if row.method == key), key=error_of).fit
            yield Sketch(
                f"history-{key}",
                f"Adaptive history of {fit.model.key} by {key}",
                "The estimate over all passes through the estimation data; a curve that still "
                "climbs in the end has not settled.",
                partial(_history, method, vehicle, train, fit),
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


def _by_horizon(
    comparison: Comparison, vehicle: Vehicle, rows: Iterable[Row]
) -> dict[tuple[str, str], HorizonScores]:
    """Return the errors of the replays of some rows, restarted every so often."""
    attitude: AttitudeSource = "simulated" if comparison.attitude == "simulated" else "measured"
    unit = comparison.rate_unit
    return {
        (row.model, row.method): horizon_scores(
            vehicle, row.fit.damping, row.trajectory.log, attitude=attitude, rate_unit=unit
        )
        for row in rows
        if row.trajectory is not None
    }


def _history(method: AdaptiveIdentifier, vehicle: Vehicle, train: Log, fit: Fit) -> Figure:
    steps = train.n * method.passes
    by_hand = "draw it with `hd.history_figure(method.history(problem, model))`"
    if fit.provenance.get("settings") not in (None, repr(method)):
        raise MethodError(f"it was made with other settings than '{fit.method}' has; {by_hand}")
    if float(steps) * fit.model.n_coefficients > _WORK_OF_HISTORY:
        raise MethodError(
            f"{method.passes} passes through {train.n} samples with {fit.model.n_coefficients} "
            f"coefficients take too long to be repeated here; {by_hand}"
        )
    problem = prepare(vehicle, train, fit.model)
    history = method.history(problem, fit.model, every=max(steps // _STEPS_KEPT, 1))
    if not np.all(np.isfinite(history.coefficients)):
        raise MethodError("the estimate ran away, so there is no curve to draw")
    return history_figure(history)
