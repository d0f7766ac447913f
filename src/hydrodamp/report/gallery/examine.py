"""What the training log says of the chosen row, asked once, after the fits."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec

from hydrodamp.data.log import Log
from hydrodamp.errors import HydrodampError
from hydrodamp.identification.grades import Identifiability, graded
from hydrodamp.report.gallery.bands_of_rows import affordable_bands
from hydrodamp.report.gallery.findings import Findings, chosen_row
from hydrodamp.report.gallery.of_the_adaptation import sketches_of_adaptation
from hydrodamp.report.gallery.of_the_data import sketches_of_data
from hydrodamp.report.gallery.of_the_fit import sketches_of_fit
from hydrodamp.report.gallery.of_the_replays import best_of_each_method, sketches_of_replays
from hydrodamp.report.gallery.picture import Gallery, Sketch, painted
from hydrodamp.report.gallery.words import sentence
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.validation.comparison import Comparison, Row
from hydrodamp.vehicle.vehicle import Vehicle

MISSING = (
    'the pictures need the package matplotlib: pip install "hydrodamp[report]", then run the '
    "command again."
)
"""What to do where there are no pictures."""


def drawable() -> bool:
    """Tell whether what pictures need is installed."""
    return find_spec("matplotlib") is not None


def examine(
    comparison: Comparison,
    vehicle: Vehicle,
    train: Log,
    reach: Callable[[str, int, int], None] | None = None,
) -> Findings:
    """Grade the coefficients of the chosen row, band its replay and draw its pictures."""
    row = chosen_row(comparison)
    if row is None:
        return Findings(
            gallery=_gallery(_sketches_of_logs(comparison, vehicle, train, None), reach)
        )
    problem = prepare(vehicle, train, row.fit.model)
    grades, not_graded = _graded(problem, row)
    if reach is not None:
        reach("bands of replays", 0, 0)
    bands = affordable_bands(vehicle, best_of_each_method(comparison, row))
    sketches = [
        *sketches_of_fit(problem, row.fit, grades, comparison.rate_unit),
        *sketches_of_replays(comparison, vehicle, row, bands),
        *_sketches_of_logs(comparison, vehicle, train, row),
    ]
    band = bands.get((row.model, row.method))
    return Findings(grades, _gallery(sketches, reach), not_graded, band)


def _gallery(sketches: list[Sketch], reach: Callable[[str, int, int], None] | None) -> Gallery:
    return painted(sketches, reach) if drawable() else Gallery((), (sentence(MISSING),))


def _graded(problem: Problem, row: Row) -> tuple[Identifiability | None, str]:
    """Return the grades, or why there are none."""
    if not row.n_coefficients:
        return None, ""
    try:
        return graded(problem, row.fit), ""
    except HydrodampError as error:
        return None, sentence(f"What the log determines is not known: {error}")


def _sketches_of_logs(
    comparison: Comparison, vehicle: Vehicle, train: Log, row: Row | None
) -> list[Sketch]:
    """Return the pictures that there are without any choice too."""
    return [
        *sketches_of_data(train, comparison.rate_unit),
        *sketches_of_adaptation(comparison, vehicle, train, row),
    ]
