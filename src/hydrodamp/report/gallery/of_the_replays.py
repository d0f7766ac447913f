"""Pictures of replays on held-out data: horizons, and for print what the report zooms."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from hydrodamp.report.figures.coefficients import coefficients_figure
from hydrodamp.report.figures.replays import Bands, replays_figure
from hydrodamp.report.figures.scores import front_figure, horizons_figure
from hydrodamp.report.gallery.bands_of_rows import said_of_bands
from hydrodamp.report.gallery.findings import models_of
from hydrodamp.report.gallery.picture import Drawn, Sketch
from hydrodamp.report.gallery.words import listed, segments_of
from hydrodamp.report.numbers import error_size
from hydrodamp.simulation.horizons import HorizonScores, horizon_scores
from hydrodamp.simulation.replay import AttitudeSource
from hydrodamp.validation.comparison import Comparison, Row
from hydrodamp.vehicle.vehicle import Vehicle

_TOGETHER = 4
"""Rows in one picture."""


def sketches_of_replays(
    comparison: Comparison, vehicle: Vehicle, row: Row, bands: Bands
) -> Iterator[Sketch]:
    """Return the pictures of replays."""
    best = best_of_each_method(comparison, row)
    yield Sketch(
        "horizons", "Error growth with horizon", lambda: _horizons(comparison, vehicle, best)
    )
    yield Sketch(
        "replays",
        "Measured against replayed",
        lambda: _replays(comparison, best, bands),
        print_only=True,
    )
    if len(comparison.rows) > 1:
        yield Sketch("front", "Error and size", lambda: _front(comparison))
    yield Sketch(
        "coefficients", "Coefficients", lambda: _coefficients(comparison, row), print_only=True
    )


def best_of_each_method(comparison: Comparison, first: Row) -> tuple[Row, ...]:
    """Return a row, then the one with the lowest error of every other method."""
    scored = [row for row in comparison.rows if row.rms is not None and row.method != first.method]
    scored.sort(key=lambda row: row.rms or 0.0)
    best = {row.method: row for row in reversed(scored)}
    others = sorted(best.values(), key=lambda row: row.rms or 0.0)
    return (first, *others)[:_TOGETHER]


def _horizons(comparison: Comparison, vehicle: Vehicle, rows: Sequence[Row]) -> Drawn:
    attitude: AttitudeSource = "simulated" if comparison.attitude == "simulated" else "measured"
    unit = comparison.rate_unit
    scores = {
        (row.model, row.method): horizon_scores(
            vehicle, row.fit.damping, row.trajectory.log, attitude=attitude, rate_unit=unit
        )
        for row in rows
        if row.trajectory is not None
    }
    figure = horizons_figure(scores, models_of(comparison, rows[0]))
    told = "; ".join(f"{_name(pair)}: {_grows(found)}" for pair, found in scores.items())
    (first, found), *_ = scores.items()
    return Drawn(
        figure,
        f"{_name(first)} errs by {_ends(found)}. Short horizons are what "
        "an observer needs, the whole run what a simulator needs.",
        f"RMS error [m/s and {unit}/s] against the time replayed without a measurement. {told}.",
    )


def _name(pair: tuple[str, str]) -> str:
    return " by ".join(pair)


def _ends(found: HorizonScores) -> str:
    short, long = _error(found["step"].score.rms), _error(found["run"].score.rms)
    return f"{short} when it restarts at every sample from what was measured, by {long} when never"


def _error(rms: float | None) -> str:
    return "an amount without bound" if rms is None else error_size(rms)


def _grows(found: HorizonScores) -> str:
    return ", ".join(
        f"{one.name} {error_size(one.score.rms)}"
        + (f" ({one.n_diverged} of {one.n_windows} windows diverged)" if one.n_diverged else "")
        for one in found.scores
    )


def _replays(comparison: Comparison, rows: Sequence[Row], bands: Bands) -> Drawn:
    figure = replays_figure(rows, bands, models_of(comparison, rows[0]))
    logs = [row.trajectory.log for row in rows if row.trajectory is not None]
    names = listed([f"{row.model} by {row.method}" for row in rows])
    what = "Data that were fitted too" if comparison.provenance.get("overlap") else "Held-out data"
    return Drawn(
        figure,
        f"{what}, {segments_of(logs[0])}: measured, and replayed by {names}. "
        f"{said_of_bands(bands)}".rstrip(),
        f"Lines of measured and replayed velocities over time, a panel each, by {names}.",
    )


def _front(comparison: Comparison) -> Drawn:
    return Drawn(
        front_figure(comparison),
        "RMS error against the number of coefficients; the line joins the rows that no other "
        "beats in both.",
        f"Points of {len(comparison.rows)} rows, error against number of coefficients, both on "
        "logarithmic scales.",
    )


def _coefficients(comparison: Comparison, row: Row) -> Drawn:
    others = [
        one.fit
        for one in comparison.rows
        if one.model == row.model and one is not row and one.fit.status.usable
    ]
    fits = [row.fit, *others][:_TOGETHER]
    methods = listed([fit.method for fit in fits])
    return Drawn(
        coefficients_figure(fits),
        f"Coefficients of {row.model} by {methods}, with 95 % intervals where they are known; an "
        "interval across zero leaves the sign open.",
        f"Points with intervals for {row.n_coefficients} coefficients by {methods}, axis by axis.",
    )
