"""What the training log says of the chosen row, asked once, after the fits."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np

from hydrodamp.data.log import Log
from hydrodamp.errors import HydrodampError
from hydrodamp.identification.grades import Identifiability, graded
from hydrodamp.report.captions import Sketch, sketches_of_logs, sketches_of_row
from hydrodamp.report.findings import Findings, Gallery, Picture, chosen_row
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.validation.bands import PredictionBand, prediction_band
from hydrodamp.validation.compare import Comparison, Row
from hydrodamp.vehicle.vehicle import Vehicle

#: What to do where there are no pictures.
MISSING = (
    'The pictures need the package matplotlib: pip install "hydrodamp[report]", then run the '
    "command again."
)

# Longest step of a band's replay [s], and how many steps times coefficients take a second or so.
_STEP = 0.05
_WORK = 4e6


def drawable() -> bool:
    """Tell whether what pictures need is installed."""
    return find_spec("matplotlib") is not None


def examine(comparison: Comparison, vehicle: Vehicle, train: Log) -> Findings:
    """Grade the coefficients of the chosen row, band its replay and draw its pictures."""
    row = chosen_row(comparison)
    sketches = list(sketches_of_logs(comparison, vehicle, train, row))
    if row is None:
        return Findings(gallery=painted(sketches))
    problem = prepare(vehicle, train, row.fit.model)
    grades, not_graded = _graded(problem, row)
    band = _band(vehicle, row)
    of_row = sketches_of_row(comparison, vehicle, problem, row, grades, band)
    return Findings(grades, painted([*of_row, *sketches]), not_graded, band)


def painted(sketches: list[Sketch]) -> Gallery:
    """Draw sketches; of one that cannot be drawn, return the reason."""
    from hydrodamp.report.figures.look import figure_bytes

    if not drawable():
        return Gallery((), (MISSING,))
    pictures: list[Picture] = []
    not_drawn: list[str] = []
    for name, title, draw, print_only in sketches:
        try:
            figure, caption = draw()
            drawing = figure_bytes(figure, "svg")
            pictures.append(Picture(name, title, caption, drawing, print_only))
        except HydrodampError as error:
            not_drawn.append(_sentence(f"{title}: {error}"))
    return Gallery(tuple(pictures), tuple(not_drawn))


def _graded(problem: Problem, row: Row) -> tuple[Identifiability | None, str]:
    """Return the grades, or why there are none."""
    if not row.n_coefficients:
        return None, ""
    try:
        return graded(problem, row.fit), ""
    except HydrodampError as error:
        return None, _sentence(f"What the log determines is not known: {error}")


def _band(vehicle: Vehicle, row: Row) -> PredictionBand | None:
    """Return the band of a replay, where there are standard errors and it is quickly made."""
    run, covariance = row.trajectory, row.fit.damping.covariance
    if run is None or run.attitude != "measured" or covariance is None:
        return None
    steps = max(run.log.n, run.log.duration / _STEP)
    if not covariance.size or not np.isfinite(covariance).all() or steps * len(covariance) > _WORK:
        return None
    known = row.fit.uncertainty
    freedom = np.inf if known is None else known.degrees_of_freedom
    problem = prepare(vehicle, run.log, row.fit.model)
    with np.errstate(over="ignore", invalid="ignore"):  # a replay that runs away has no band
        return prediction_band(problem, row.fit.damping, degrees_of_freedom=freedom, max_step=_STEP)


def _sentence(text: str) -> str:
    """Return what an error says as a sentence."""
    return f"{text[0].upper()}{text[1:].rstrip('.')}."
