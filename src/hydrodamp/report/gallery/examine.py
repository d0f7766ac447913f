"""What the training log says of the chosen row, asked once, after the fits."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib.util import find_spec

from hydrodamp.data.log import Log
from hydrodamp.errors import HydrodampError
from hydrodamp.identification.trust.identifiability import Identifiability, identifiability
from hydrodamp.report.gallery.findings import Findings, chosen_row
from hydrodamp.report.gallery.of_the_adaptation import sketches_of_adaptation
from hydrodamp.report.gallery.of_the_data import sketches_of_data
from hydrodamp.report.gallery.of_the_fit import sketches_of_fit
from hydrodamp.report.gallery.of_the_replays import sketches_of_replays
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
    """Tell whether what pictures need is installed.

    Returns
    -------
    drawable : bool
        Whether matplotlib is there.

    Examples
    --------
    >>> isinstance(drawable(), bool)
    True
    """
    return find_spec("matplotlib") is not None


def examine(
    comparison: Comparison,
    vehicle: Vehicle,
    train: Log,
    reach: Callable[[str, int, int], None] | None = None,
) -> Findings:
    """Grade the coefficients of the chosen row and draw its pictures.

    Parameters
    ----------
    comparison : Comparison
        As :func:`hydrodamp.compare` made it, with the whole logs of its replays.
    vehicle : Vehicle
        Everything known.
    train : Log
        What was identified from.
    reach : callable, optional
        Called as pictures are drawn, for a progress bar: see
        :func:`hydrodamp.report.gallery.picture.painted`.

    Returns
    -------
    findings : Findings
        What could be found, and why the rest could not. Without matplotlib there
        are grades alone.
    """
    row = chosen_row(comparison)
    problem = None if row is None else prepare(vehicle, train, row.fit.model)
    grades, not_graded = (None, "") if problem is None or row is None else _graded(problem, row)
    if not drawable():
        return Findings(grades, Gallery((), (sentence(MISSING),)), not_graded)
    sketches = list(_sketches(comparison, vehicle, train, row, problem, grades))
    return Findings(grades, painted(sketches, reach), not_graded)


def _graded(problem: Problem, row: Row) -> tuple[Identifiability | None, str]:
    """Return the grades, or why there are none."""
    if not row.n_coefficients:
        return None, ""
    try:
        return identifiability(problem, row.fit.model), ""
    except HydrodampError as error:
        return None, sentence(f"What the log determines is not known: {error}")


def _sketches(
    comparison: Comparison,
    vehicle: Vehicle,
    train: Log,
    row: Row | None,
    problem: Problem | None,
    grades: Identifiability | None,
) -> Iterator[Sketch]:
    """Return all pictures, in the order in which they are looked at."""
    if row is not None and problem is not None:
        yield from sketches_of_fit(problem, row.fit, grades, comparison.rate_unit)
        yield from sketches_of_replays(comparison, vehicle, row)
    yield from sketches_of_data(train, comparison.rate_unit)
    yield from sketches_of_adaptation(comparison, vehicle, train, row)
