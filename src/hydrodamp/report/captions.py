"""Each picture of a report with what to see in it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError
from hydrodamp.identification.adaptive import AdaptiveIdentifier
from hydrodamp.identification.fit import CORRELATED, Fit, correlated_pairs
from hydrodamp.identification.grades import Identifiability
from hydrodamp.identification.methods import METHODS
from hydrodamp.identification.power import TAIL, operating_box, worst_power
from hydrodamp.identification.residuals import diagnose
from hydrodamp.report.figures.axes import wrench_unit
from hydrodamp.report.figures.coefficients import coefficients_figure, correlation_figure
from hydrodamp.report.figures.diagnostics import (
    excitation_figure,
    history_figure,
    power_figure,
    residuals_figure,
)
from hydrodamp.report.figures.scores import front_figure, horizons_figure
from hydrodamp.report.figures.series import commands_figure, replays_figure, velocities_figure
from hydrodamp.report.findings import models_of
from hydrodamp.report.grid import error_size
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.simulation.replay import AttitudeSource
from hydrodamp.simulation.score import RateUnit, horizon_scores
from hydrodamp.validation.bands import PredictionBand
from hydrodamp.validation.choice import front
from hydrodamp.validation.compare import Comparison, Row
from hydrodamp.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Rows in one picture, correlated pairs in a caption, and names of segments in one.
_TOGETHER = 4
_PAIRS = 5
_NAMED = 6

# Steps of a history at most, and steps times coefficients that take a second or so.
_STEPS_KEPT = 3000
_WORK = 1e8

#: A figure and its caption.
Drawn = tuple["Figure", str]


class Sketch(NamedTuple):
    """A picture still to be drawn."""

    name: str
    title: str
    draw: Callable[[], Drawn]
    print_only: bool = False


def sketches_of_row(
    comparison: Comparison,
    vehicle: Vehicle,
    problem: Problem,
    row: Row,
    grades: Identifiability | None,
    band: PredictionBand | None,
) -> Iterator[Sketch]:
    """Return the pictures of the chosen row and of what it is compared with."""
    fit, best = row.fit, best_of_each_method(comparison, row)
    others = [one.fit for one in comparison.rows if one.model == row.model and one is not row]
    fits = [fit, *(one for one in others if one.status.usable)][:_TOGETHER]
    if len(comparison.rows) > 1:
        yield Sketch("front", "Error and size", partial(_front, comparison))
    if row.trajectory is not None:
        draw = partial(_horizons, comparison, vehicle, best)
        yield Sketch("horizons", "Error growth with horizon", draw)
        draw = partial(_replays, comparison, best, row.trajectory.log, band)
        yield Sketch("replays", "Measured against replayed", draw, print_only=True)
    if grades is not None:
        yield Sketch("excitation", "Excitation by axis", partial(_excitation, grades))
    yield Sketch("coefficients", "Coefficients", partial(_coefficients, fits), print_only=True)
    yield Sketch("correlation", "Correlation of coefficients", partial(_correlation, fit))
    yield Sketch("residuals", "Residuals", partial(_residuals, problem, fit))
    draw = partial(_power, problem, fit, comparison.rate_unit)
    yield Sketch("power", "Power over the operating box", draw)


def sketches_of_logs(
    comparison: Comparison, vehicle: Vehicle, train: Log, chosen: Row | None
) -> Iterator[Sketch]:
    """Return the pictures that there are without any choice too."""
    draw = partial(_velocities, train, comparison.rate_unit)
    yield Sketch("estimation-velocities", "Estimation data: velocities", draw)
    draw = partial(_actuation, train)
    yield Sketch("estimation-actuation", "Estimation data: actuation", draw)
    for key in comparison.methods:
        method = METHODS[key].value() if key in METHODS else None
        if isinstance(method, AdaptiveIdentifier):
            row = _best(row for row in comparison.rows if row.method == key)
            reference = _reference(comparison, row, chosen)
            draw = partial(_history, method, vehicle, train, row.fit, reference)
            yield Sketch(f"history-{key}", f"Adaptive history of {row.model} by {key}", draw)


def best_of_each_method(comparison: Comparison, first: Row) -> tuple[Row, ...]:
    """Return a row, then the one with the lowest error of every other method."""
    scored = [row for row in comparison.rows if row.rms is not None and row.method != first.method]
    methods = dict.fromkeys(row.method for row in sorted(scored, key=_error))
    best = [_best(row for row in scored if row.method == method) for method in methods]
    return (first, *best)[:_TOGETHER]


def said_of_band(name: str) -> str:
    """Return what a caption says of the band of a row."""
    return (
        f"Shaded, of {name}: where 95 % of the replays would run at each moment if the "
        "coefficients erred as their standard errors say, to first order. Neither the noise of "
        "the measurements nor what the model's form cannot express is in the band."
    )


def _front(comparison: Comparison) -> Drawn:
    best = [row for row in front(comparison) if row.n_coefficients]
    steps = [f"{_name(row)} ({row.n_coefficients}: {error_size(row.rms)})" for row in best]
    said = f" From the smallest to the most exact: {', then '.join(steps)}." if steps else ""
    words = f"The line joins the rows that no other row beats in both error and size.{said}"
    return front_figure(comparison), words


def _horizons(comparison: Comparison, vehicle: Vehicle, rows: Sequence[Row]) -> Drawn:
    attitude: AttitudeSource = "simulated" if comparison.attitude == "simulated" else "measured"
    unit, scores, said = comparison.rate_unit, {}, []
    for row in rows:
        if row.trajectory is not None:
            found = horizon_scores(
                vehicle, row.fit.damping, row.trajectory.log, attitude=attitude, rate_unit=unit
            )
            scores[row.model, row.method] = found
            errors = [f"{one.name} {error_size(one.score.rms)}" for one in found.scores]
            said.append(f"{_name(row)}: {', '.join(errors)}")
    return (
        horizons_figure(scores, models_of(comparison, rows[0])),
        "RMS error over the time since the replay last saw a measurement. Short horizons are what "
        f"an observer needs, the whole run is what a simulator needs. {'; '.join(said)}.",
    )


def _replays(
    comparison: Comparison, rows: Sequence[Row], log: Log, band: PredictionBand | None
) -> Drawn:
    bands = {} if band is None else {(rows[0].model, rows[0].method): band}
    shared = comparison.provenance.get("overlap")
    what = "Data that were also fitted" if shared else "Held-out data"
    shaded = "" if band is None else f" {said_of_band(_name(rows[0]))}"
    names = listed([_name(row) for row in rows])
    return (
        replays_figure(rows, bands, models_of(comparison, rows[0])),
        f"{what}, {_extent(log)}: measured, and replayed by {names}.{shaded}",
    )


def _excitation(found: Identifiability) -> Drawn:
    quiet = [one.axis for one in found.axes if not one.excited]
    said = (
        f"The response is not predicted on {listed(quiet)}, for want of motion or of the right "
        "terms: do not read single coefficients of these axes."
        if quiet
        else "The response is predicted on every axis with coefficients."
    )
    return (
        excitation_figure(found),
        f"{said} Left, how much of the response is predicted on stretches held out (dashed: the "
        f"least that counts); right, how well each coefficient of {found.model.key} is determined.",
    )


def _coefficients(fits: Sequence[Fit]) -> Drawn:
    return (
        coefficients_figure(fits),
        f"Coefficients of {fits[0].model.key} by {listed([fit.method for fit in fits])}, with 95 % "
        "intervals where they are known; an interval across zero leaves the sign open.",
    )


def _correlation(fit: Fit) -> Drawn:
    figure, labels = correlation_figure(fit), fit.model.labels
    pairs = [] if fit.damping.covariance is None else correlated_pairs(fit.damping.covariance)
    count = sum(abs(pair.correlation) >= CORRELATED for pair in pairs)
    number = f"{count} pairs of coefficients have" if count != 1 else "1 pair of coefficients has"
    named = [f"{labels[i]} with {labels[j]} ({value:+.2f})" for i, j, value in pairs[:_PAIRS]]
    most = f" The most correlated are {listed(named)}." if named else ""
    return (
        figure,
        f"{number} errors correlated beyond {CORRELATED:g}: their sum or difference is known "
        f"better than each of them.{most} Each pair is a square, and lines divide the axes.",
    )


def _residuals(problem: Problem, fit: Fit) -> Drawn:
    figure = residuals_figure(problem, [fit])
    axes = diagnose(problem, fit.model, fit.damping).axes
    coloured = [one.axis for one in axes if one.coloured]
    said = (
        f"Residuals on {listed(coloured)} are correlated in time: the model lacks something there, "
        "and intervals for white residuals would be too narrow."
        if coloured
        else "Residuals are white on every axis, as far as the test sees."
    )
    sizes = listed([f"{one.axis} {one.rms:.3g} {wrench_unit(one.axis)}" for one in axes])
    return (
        figure,
        f"{said} White residuals would stay in the grey band; a peak in the spectrum (right) is "
        f"motion that the model does not follow. Root mean squares are {sizes}.",
    )


def _power(problem: Problem, fit: Fit, rate_unit: RateUnit) -> Drawn:
    box = operating_box(problem)
    worst = worst_power(fit.damping, box).power
    said = (
        f"Somewhere in the box the damping drives the vehicle, by up to {worst:.3g} W, which water "
        "cannot do: a simulation may run away there."
        if worst > 0.0
        else "Everywhere in the box that was searched the damping takes power, as water does."
    )
    return (
        power_figure([fit], box, rate_unit),
        f"{said} The box is that of the estimation data but for {100.0 * TAIL:g} % of the samples "
        f"at either end of each velocity, a quarter wider: {box}. Above zero (shaded) power goes "
        "into the motion.",
    )


def _velocities(log: Log, rate_unit: RateUnit) -> Drawn:
    return (
        velocities_figure(log, rate_unit),
        f"What the models were estimated from: {_extent(log)}. A velocity that hardly moves "
        "teaches nothing of its damping.",
    )


def _actuation(log: Log) -> Drawn:
    names = f": the commands {listed(log.command_names)}" if log.command_names else ""
    return commands_figure(log), f"What drove the vehicle over the same time{names}; how it lay."


def _history(
    method: AdaptiveIdentifier, vehicle: Vehicle, train: Log, fit: Fit, reference: Fit | None
) -> Drawn:
    steps, passes = train.n * method.passes, method.passes
    by_hand = "draw it with `hd.history_figure(method.history(problem, model))`"
    if fit.provenance.get("settings") not in (None, repr(method)):
        raise MethodError(f"it was made with other settings than '{fit.method}' has; {by_hand}")
    if float(steps) * fit.model.n_coefficients > _WORK:
        raise MethodError(
            f"{passes} passes through {train.n} samples with {fit.model.n_coefficients} "
            f"coefficients take too long to be repeated here; {by_hand}"
        )
    problem = prepare(vehicle, train, fit.model)
    history = method.history(problem, fit.model, every=max(steps // _STEPS_KEPT, 1))
    if not np.all(np.isfinite(history.coefficients)):
        raise MethodError("the estimate ran away, so there is no curve to draw")
    points = "" if reference is None else f" Triangles are the values by {reference.method}."
    return (
        history_figure(history, None if reference is None else reference.damping),
        f"The estimate over {passes} pass{'es' if passes > 1 else ''} through the estimation data, "
        f"in the end {fit.status.word}; a curve that still climbs there has not settled.{points}",
    )


def _reference(comparison: Comparison, row: Row, chosen: Row | None) -> Fit | None:
    """Return the fit of the same model by the chosen method, where that is another."""
    if chosen is None or chosen.method == row.method:
        return None
    same = (one.fit for one in comparison.rows if one.model == row.model)
    return next((fit for fit in same if fit.method == chosen.method and fit.status.usable), None)


def _best(rows: Iterable[Row]) -> Row:
    return min(rows, key=_error)


def _error(row: Row) -> float:
    return float("inf") if row.rms is None else row.rms


def _name(row: Row) -> str:
    return f"{row.model} by {row.method}"


def _extent(log: Log) -> str:
    """Return what a log consists of."""
    names = [segment.name for segment in log.segments]
    head = f"{log.n} samples, {log.duration:.4g} s"
    named = f" ({listed(names)})" if len(names) <= _NAMED else ""
    return f"{head} in {len(names)} segments{named}" if len(names) > 1 else head


def listed(names: Sequence[str]) -> str:
    """Return names as a clause."""
    return f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else "".join(names)
