"""Pictures of how adaptive identifiers came to their estimates."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol, runtime_checkable

import numpy as np

from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError
from hydrodamp.identification.adaptive import History
from hydrodamp.identification.methods import METHODS
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.report.figures.histories import history_figure
from hydrodamp.report.gallery.picture import Drawn, Sketch
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.validation.comparison import Comparison, Row
from hydrodamp.vehicle.vehicle import Vehicle

_STEPS_KEPT = 3000
"""Steps of a history at most."""

_WORK = 1e8
"""Steps times coefficients that are gone through again: about a second."""


@runtime_checkable
class Remembering(Protocol):
    """A method that can tell how its estimate came about."""

    @property
    def passes(self) -> int:
        """How often the log is gone through."""
        ...

    def history(self, problem: Problem, model: DampingModel, every: int = 1) -> History:
        """Go through the log again."""
        ...


def sketches_of_adaptation(
    comparison: Comparison, vehicle: Vehicle, train: Log, chosen: Row | None
) -> Iterator[Sketch]:
    """Return a picture for each adaptive method: of its row with the lowest error."""
    for key in comparison.methods:
        method = METHODS.get(key)
        if isinstance(method, Remembering):
            row = _of(comparison, key)
            title = f"Adaptive history of {row.model} by {key}"
            reference = _reference(comparison, row, chosen)
            yield Sketch(
                f"history-{key}",
                title,
                lambda method=method, row=row, reference=reference: _history(
                    method, vehicle, train, row, reference
                ),
            )


def _of(comparison: Comparison, key: str) -> Row:
    """Return the row of a method with the lowest error; without any, its first."""
    rows = [row for row in comparison.rows if row.method == key]
    scored = [row for row in rows if row.rms is not None]
    return min(scored, key=lambda row: row.rms or 0.0) if scored else rows[0]


def _reference(comparison: Comparison, row: Row, chosen: Row | None) -> Row | None:
    """Return the row of the same model by the chosen method."""
    if chosen is None or chosen.method == row.method:
        return None
    for other in comparison.rows:
        if (other.model, other.method) == (row.model, chosen.method) and other.fit.status.usable:
            return other
    return None


def _history(
    method: Remembering, vehicle: Vehicle, train: Log, row: Row, reference: Row | None
) -> Drawn:
    _refuse(method, train, row)
    problem = prepare(vehicle, train, row.fit.model)
    steps = train.n * method.passes
    history = method.history(problem, row.fit.model, every=max(steps // _STEPS_KEPT, 1))
    if not np.all(np.isfinite(history.coefficients)):
        raise MethodError("its estimate ran away, so there is no curve to draw")
    known: Damping | None = None if reference is None else reference.fit.damping
    dashes = (
        "" if reference is None else f" Dashes at the right are the values by {reference.method}."
    )
    passes = "one pass" if method.passes == 1 else f"{method.passes} passes"
    return Drawn(
        history_figure(history, known),
        f"The estimate over {passes} through the estimation data, in the end "
        f"{row.fit.status.word}; a curve that still climbs there has not settled.{dashes}",
        f"Lines of {row.n_coefficients} coefficients of {row.model} by {row.method} and of the "
        "errors of the estimated velocities over the time adapted.",
    )


def _refuse(method: Remembering, train: Log, row: Row) -> None:
    """Refuse what was made otherwise, or what would take too long to make again."""
    settings = row.fit.provenance.get("settings")
    if settings is not None and settings != repr(method):
        raise MethodError(
            f"it was made with other settings than '{row.method}' has by its key; draw it with "
            "`hd.history_figure(method.history(problem, model))`"
        )
    if float(train.n) * method.passes * row.n_coefficients > _WORK:
        raise MethodError(
            f"going {method.passes} times through {train.n} samples with {row.n_coefficients} "
            "coefficients again takes too long here; draw it with "
            f"`hd.history_figure(hd.find_method('{row.method}').history(problem, model))`"
        )
