"""Pictures of a comparison: each figure of its diagnostics with a caption, drawn as SVG."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from importlib.util import find_spec
from typing import TYPE_CHECKING

from hydrodamp.basis.atoms import VELOCITIES
from hydrodamp.data.log import Log
from hydrodamp.errors import HydrodampError
from hydrodamp.identification.dissipativity import TAIL, PowerMaximum
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
from hydrodamp.report.files import Picture, ReportContent
from hydrodamp.validation.compare import Comparison, Row
from hydrodamp.validation.diagnostics import Findings, diagnose_comparison
from hydrodamp.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NEEDS_MATPLOTLIB = (
    'Pictures need the package matplotlib: pip install "hydrodamp[report]", then run the command '
    "again."
)

#: Name, caption and drawing function of a picture.
Sketch = tuple[str, str, "Callable[[], Figure]"]


def illustrate(comparison: Comparison, vehicle: Vehicle, train: Log) -> ReportContent:
    """Compute the diagnostics of the selected row and draw its pictures."""
    findings = diagnose_comparison(comparison, vehicle, train)
    missing = [NEEDS_MATPLOTLIB]
    pictures: tuple[Picture, ...] = ()
    if find_spec("matplotlib"):
        pictures, missing = draw_pictures(_sketches(comparison, findings, train), findings.failures)
    if "grades" in findings.failures:
        missing.append(_sentence("Coefficients are not graded", findings.failures["grades"]))
    return ReportContent(findings.identifiability, findings.band, pictures, tuple(missing))


def draw_pictures(
    sketches: Iterable[Sketch], failures: Mapping[str, str]
) -> tuple[tuple[Picture, ...], list[str]]:
    """Draw sketches; return the pictures, and the reason for each that is missing."""
    pictures: list[Picture] = []
    missing: list[str] = []
    for name, caption, draw in sketches:
        try:
            if name in failures:
                raise HydrodampError(failures[name])
            figure = draw()
        except HydrodampError as error:
            missing.append(_sentence(name.capitalize(), str(error)))
        else:
            width, height = (round(96 * inches) for inches in figure.get_size_inches())
            pictures.append(Picture(name, caption, width, height, figure_bytes(figure, "svg")))
    return tuple(pictures), missing


def _sentence(subject: str, reason: str) -> str:
    return f"{subject}: {reason}".rstrip(".") + "."


def _sketches(comparison: Comparison, findings: Findings, train: Log) -> Iterator[Sketch]:
    unit, row = comparison.rate_unit, findings.row
    if row is not None:
        yield from _replay_sketches(comparison, findings, row)
        yield from _fit_sketches(comparison, findings, row)
    yield (
        "estimation-velocities",
        "Training data: velocities. Damping of a velocity that hardly varies cannot be identified.",
        partial(velocities_figure, train, unit),
    )
    yield (
        "estimation-actuation",
        "Training data: actuation, attitude and depth over the same time.",
        partial(commands_figure, train),
    )


def _replay_sketches(comparison: Comparison, findings: Findings, row: Row) -> Iterator[Sketch]:
    if len(comparison.rows) > 1:
        yield (
            "front",
            "RMS error against number of coefficients. The line is the Pareto front: no row has "
            "both a lower error and fewer coefficients.",
            partial(front_figure, comparison),
        )
    if row.trajectory is None:
        return
    yield (
        "horizons",
        "RMS error against prediction horizon, the time since the simulation was restarted at a "
        "measured state. Observers need short horizons, simulators the whole segment.",
        partial(horizons_figure, findings.horizons),
    )
    band = findings.band
    yield (
        "replays",
        "Measured and simulated velocities: the selected row, and the row of every other method "
        f"with the lowest error.{f' {band_caption(row)}' if band else ''}",
        partial(replays_figure, findings.rows, band),
    )


def _fit_sketches(comparison: Comparison, findings: Findings, row: Row) -> Iterator[Sketch]:
    problem, grades, box, power = (
        findings.problem,
        findings.identifiability,
        findings.box,
        findings.power,
    )
    if problem is None or box is None:
        return
    if grades is not None:
        yield (
            "excitation",
            "Left: cross-validated share of the response of each axis that the model predicts "
            "(dashed: lower limit of an excited axis). Right: coefficients by grade. Do not "
            "interpret single coefficients of an axis below the limit: the excitation is poor or "
            "terms are missing.",
            partial(excitation_figure, grades),
        )
    yield (
        "correlation",
        "Correlation of the estimation errors of each pair of coefficients; lines separate the "
        "axes. Of a highly correlated pair, the sum or the difference is better known than each "
        "coefficient.",
        partial(correlation_figure, row.fit),
    )
    yield (
        "residuals",
        residual_caption(findings.residual_tests),
        partial(residuals_figure, problem, row.fit),
    )
    yield (
        "power",
        power_caption(power) if power else "",
        partial(power_figure, row.fit, box, comparison.rate_unit),
    )


def residual_caption(tests: tuple[str, ...]) -> str:
    """Return whether residuals are correlated in time, and how to read their picture."""
    if not any("autocorrelated" in test for test in tests):
        tests = ("Residuals are white according to the test.", *tests)
    reading = (
        "White residuals stay in the grey band; outside it, the model misses part of the dynamics."
    )
    return " ".join((*tests, reading))


def power_caption(maximum: PowerMaximum) -> str:
    """Return whether the damping injects energy, where most, and over which velocities."""
    power, velocity = maximum
    state = ", ".join(
        f"{name} {value:.2g}" for name, value in zip(VELOCITIES, velocity, strict=True) if value
    )
    result = (
        f"The damping injects energy where the power is positive (shaded): {power:.3g} W at most, "
        f"at {state} (m/s, rad/s). This is not physical, and a simulation may diverge there."
        if power > 0.0
        else "The damping is dissipative at all velocities that were searched."
    )
    return (
        f"{result} The velocities are those of the training data without {100.0 * TAIL:g} % of the "
        "samples at either end, extended by a quarter."
    )


def band_caption(row: Row) -> str:
    """Return what the prediction band of a row contains."""
    return (
        f"Shaded: 95 % band of {row.model} by {row.method}, the range of replays at each time for "
        "coefficients within their standard errors, to first order. It includes neither "
        "measurement noise nor model-form error."
    )
