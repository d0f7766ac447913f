"""Pictures of a comparison: figures with captions as SVG."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, partial
from importlib.resources import files
from importlib.util import find_spec
from typing import TYPE_CHECKING

from hydrodamp.basis.term import VELOCITIES
from hydrodamp.errors import HydrodampError
from hydrodamp.identification.dissipativity import TAIL, PowerMaximum
from hydrodamp.identification.fit_files import Key
from hydrodamp.identification.identifiability import Identifiability
from hydrodamp.progress import count_items, progress
from hydrodamp.report.figures import diagnostics, style
from hydrodamp.report.figures.replays import replays_figure
from hydrodamp.report.files import Picture, ReportContent
from hydrodamp.simulation.problem import Problem
from hydrodamp.validation.compare import Comparison, Row
from hydrodamp.validation.diagnostics import (
    Findings,
    diagnose_comparison,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NEEDS_MATPLOTLIB = (
    'Pictures need the package matplotlib: pip install "hydrodamp[report]", then run the command '
    "again."
)


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
        pictures, missing = draw_pictures(sketches, findings.failures)
    if "grades" in findings.failures:
        missing.append(_sentence("Coefficients are not graded", findings.failures["grades"]))
    return ReportContent(
        findings.identifiability, findings.band, pictures, tuple(missing), findings.residual_tests
    )


def draw_pictures(
    sketches: Sequence[Sketch], failures: Mapping[str, str]
) -> tuple[tuple[Picture, ...], list[str]]:
    """Draw sketches; return the pictures, and the reason for each that is missing."""
    pictures: list[Picture] = []
    missing: list[str] = []
    for name, caption, draw in count_items(sketches, "drawing pictures", len(sketches)):
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
