"""Pictures of a comparison: figures with captions as SVG, and data of interactive plots."""

from __future__ import annotations

import base64
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache, partial
from importlib.resources import files
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.data.log import Log
from hydrodamp.errors import HydrodampError
from hydrodamp.identification.dissipativity import TAIL, PowerMaximum
from hydrodamp.identification.fit_files import Key
from hydrodamp.identification.identifiability import Identifiability
from hydrodamp.identification.predicted_error import PredictionBand
from hydrodamp.progress import count_items, progress
from hydrodamp.report.figures import diagnostics, style
from hydrodamp.report.figures.replays import (
    recorded_channels,
    replays_figure,
)
from hydrodamp.report.figures.style import model_colours
from hydrodamp.report.files import Picture, ReportContent
from hydrodamp.report.table import percent
from hydrodamp.simulation.problem import Problem
from hydrodamp.validation.compare import Comparison, Row
from hydrodamp.validation.diagnostics import (
    Findings,
    diagnose_comparison,
    find_selected_row,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NEEDS_MATPLOTLIB = (
    'Pictures need the package matplotlib: pip install "hydrodamp[report]", then run the command '
    "again."
)

MAX_REPLAYS = 32  # replays drawn, those with the lowest errors
MAX_VALUES = 600_000  # values of all series together, 1.6 MB as text
MAX_POINTS = 20_000  # points of one series
QUANTISATION_STEPS = 65_000  # steps of the range of a series, as uint16
MISSING_STEP = 65_535  # step of a missing value
LINE_WIDTH = 1.5  # px

#: Name, caption and drawing function of a picture.
Sketch = tuple[str, str, "Callable[[], Figure]"]


def illustrate(
    comparison: Comparison,
    problem: Problem,
    graded: Mapping[Key, Identifiability | str] | None = None,
) -> ReportContent:
    """Compute the diagnostics of the selected row and draw its pictures."""
    with progress("diagnosing"):
        findings = diagnose_comparison(comparison, problem, graded)
    missing = [NEEDS_MATPLOTLIB]
    pictures: tuple[Picture, ...] = ()
    if find_spec("matplotlib"):
        sketches = [*_sketches(comparison, findings)]
        counted = count_items(sketches, "drawing pictures", len(sketches))
        pictures, missing = draw_pictures(counted, findings.failures)
    if "grades" in findings.failures:
        missing.append(_sentence("Coefficients are not graded", findings.failures["grades"]))
    return ReportContent(
        findings.identifiability, findings.band, pictures, tuple(missing), findings.residual_tests
    )


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
            pictures.append(
                Picture(name, caption, width, height, style.figure_bytes(figure, "svg"))
            )
    return tuple(pictures), missing


def _sentence(subject: str, reason: str) -> str:
    return f"{subject}: {reason}".rstrip(".") + "."


def _sketches(comparison: Comparison, findings: Findings) -> Iterator[Sketch]:
    """Yield the pictures of the selected row."""
    unit, row, text = comparison.rate_unit, findings.row, captions()
    if row is not None and len(comparison.rows) > 1:
        yield "front", text["front"], partial(diagnostics.front_figure, comparison)
    if row is not None and row.trajectory is not None:
        yield "horizons", text["horizons"], partial(diagnostics.horizons_figure, findings.horizons)
        band = f" {band_caption(row)}" if findings.band else ""
        caption = f"{text['replays']}{band}"
        yield "replays", caption, partial(replays_figure, findings.rows, findings.band)
    if row is not None and findings.problem is not None and findings.box is not None:
        fit, tests = row.fit, findings.residual_tests
        draw_residuals = partial(diagnostics.residuals_figure, findings.problem, fit)
        yield "residuals", residual_caption(tests), draw_residuals
        caption = power_caption(findings.power) if findings.power else ""
        yield "power", caption, partial(diagnostics.power_figure, fit, findings.box, unit)


@cache
def captions() -> dict[str, str]:
    """Return the captions of ``captions.toml``."""
    text = files("hydrodamp.report").joinpath("captions.toml").read_text("utf-8")
    return dict(tomllib.loads(text))


def residual_caption(tests: tuple[str, ...]) -> str:
    """Return whether residuals are correlated in time, and how to read their picture."""
    is_white = not any("autocorrelated" in test for test in tests)
    return " ".join((*([captions()["white"]] * is_white), *tests, captions()["residuals"]))


def power_caption(maximum: PowerMaximum) -> str:
    """Return whether the damping injects energy, where most, and over which velocities."""
    power, velocity = maximum
    values = zip(VELOCITIES, velocity, strict=True)
    state = ", ".join(f"{name} {value:.2g}" for name, value in values if value)
    result = captions()["injects" if power > 0.0 else "dissipative"]
    tail = captions()["power"].format(tail=100.0 * TAIL)
    return f"{result.format(power=power, state=state)} {tail}"


def band_caption(row: Row) -> str:
    """Return what the prediction band of a row contains."""
    return captions()["band"].format(row=f"{row.model} by {row.method}")


def series(
    comparison: Comparison, rows: Sequence[Row], band: PredictionBand | None = None
) -> dict[str, Any] | None:
    """Return the data and captions of the time-series plots, rows in order of preference."""
    runs = [(row, row.trajectory) for row in rows if row.trajectory is not None]
    if not runs:
        return None
    shown_runs, log, selected = runs[:MAX_REPLAYS], runs[0][1].log, find_selected_row(comparison)
    names, unit = tuple(runs[0][0].score.rms_by_axis), comparison.rate_unit
    channels = [*recorded_channels(log)]
    n_series = len(names) * (1 + len(shown_runs) + 2 * (band is not None))
    n_series += sum(len(panel.channels) for panel in channels)
    # Extremes of intervals cannot be subtracted, so a long log has series of residuals.
    is_exact = log.n <= min(MAX_VALUES // n_series, MAX_POINTS)
    n_series += 0 if is_exact else len(names) * len(shown_runs)
    bins, time = (
        style.Bins.over(log.bounds, min(MAX_VALUES // n_series, MAX_POINTS)),
        style.clock(log),
    )

    def packed(velocity: FloatArray) -> list[dict[str, object]]:
        return [_pack(bins.values(style.shown_velocities(velocity, name, unit))) for name in names]

    looks = style.line_styles([(row.model, row.method) for row, _ in shown_runs])
    colours = model_colours(comparison.models)  # those of the table, whatever is shown
    band_entry, caption, edges = None, "", []
    if band is not None and selected is not None:
        band_entry = {
            "name": f"{100.0 * band.level:.0f} % band of {selected.model} by {selected.method}",
            "model": selected.model,
            "colour": colours[selected.model],
        }
        caption = band_caption(selected)
        edges = [packed(band.lower), packed(band.upper)]
    document = {
        "velocities": [{"name": name, "unit": style.velocity_unit(name, unit)} for name in names],
        "segments": [
            {"name": segment.name, "start": time[segment.start], "stop": time[segment.stop - 1]}
            for segment in log.segments
        ],
        "replays": [
            {
                "name": f"{row.model} by {row.method}",
                "model": row.model,
                "fit": _mean_fit(row),
                "fits": [row.score.fit_by_axis[name] for name in names],
                "colour": colours[row.model],
                "dashes": [round(LINE_WIDTH * length, 1) for length in look.dashes],
            }
            for (row, _), look in zip(shown_runs, looks, strict=True)
        ],
        "band": band_entry,
        "palette": style.SERIES,
        "time": _base64(bins.times(time).astype("<f8")),
        "series": [packed(log.velocity), *(packed(run.velocity) for _, run in shown_runs)],
        "residuals": []
        if is_exact
        else [packed(run.velocity - log.velocity) for _, run in shown_runs],
        "channels": [
            {
                "label": panel.label,
                "downward": panel.downward,
                "names": [*panel.channels],
                "series": [_pack(bins.values(values)) for values in panel.channels.values()],
            }
            for panel in channels
        ],
        "edges": edges,
    }
    return {
        "document": document,
        "band_caption": caption,
        "left_out": len(runs) - len(shown_runs),
        "is_thinned": not bins.is_exact,
    }


def _mean_fit(row: Row) -> str | None:
    """Return the mean fit over the velocities [%]."""
    fits = [fit for fit in row.score.fit_by_axis.values() if fit is not None]
    return percent(float(np.mean(fits))) if fits else None


def _pack(values: FloatArray) -> dict[str, object]:
    """Return a series quantised to uint16 steps of its range."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    step = (high - low) / QUANTISATION_STEPS or 1.0
    counts = np.where(np.isfinite(values), np.rint((values - low) / step), MISSING_STEP)
    return {"low": low, "step": step, "steps": _base64(counts.astype("<u2"))}


def _base64(array: np.ndarray) -> str:
    return base64.b64encode(array.tobytes()).decode("ascii")
