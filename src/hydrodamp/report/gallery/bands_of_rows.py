"""Bands around the replays of a picture, as far as they are cheap."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hydrodamp.identification.fit import Fit
from hydrodamp.report.figures.replays import Bands
from hydrodamp.report.gallery.words import listed
from hydrodamp.simulation.problem import prepare
from hydrodamp.simulation.replay import Trajectory
from hydrodamp.validation.bands import PredictionBand, prediction_band
from hydrodamp.validation.comparison import Row
from hydrodamp.vehicle.vehicle import Vehicle

_WORK = 4e6
"""Steps times coefficients of all bands together: about a second."""

_STEP = 0.05
"""Longest step of a band's replay [s]."""


def affordable_bands(vehicle: Vehicle, rows: Sequence[Row]) -> Bands:
    """Return bands to first order around replays, the first rows first."""
    left = _WORK
    bands: dict[tuple[str, str], PredictionBand] = {}
    for row in rows:
        if row.trajectory is None or not _has_band(row.fit, row.trajectory):
            continue
        log = row.trajectory.log
        work = max(log.n, log.duration / _STEP) * row.n_coefficients
        if work <= left:
            left -= work
            bands[row.model, row.method] = _band(vehicle, row.fit, row.trajectory)
    return bands


def said_of_bands(bands: Bands) -> str:
    """Return what a caption says of bands."""
    if not bands:
        return ""
    names = listed([" by ".join(pair) for pair in bands])
    return (
        f"Shaded, of {names}: where 95 % of the replays would run at each moment if the "
        "coefficients erred as their standard errors say, to first order. Neither the noise of "
        "the measurements nor what the model's form cannot express is in a band."
    )


def _has_band(fit: Fit, trajectory: Trajectory) -> bool:
    covariance = fit.damping.covariance
    return (
        trajectory.attitude == "measured"
        and covariance is not None
        and covariance.size > 0
        and bool(np.isfinite(covariance).all())
    )


def _band(vehicle: Vehicle, fit: Fit, trajectory: Trajectory) -> PredictionBand:
    freedom = np.inf if fit.uncertainty is None else fit.uncertainty.degrees_of_freedom
    problem = prepare(vehicle, trajectory.log, fit.model)
    with np.errstate(over="ignore", invalid="ignore"):  # a replay that runs away has no band
        return prediction_band(problem, fit.damping, degrees_of_freedom=freedom, max_step=_STEP)
