"""A comparison made by hand, each row known beforehand, and one of a short campaign."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.data.log import Segment
from hydrodamp.models.damping import VehicleStamp
from hydrodamp.validation.compare import replayed_row

NAMES = ("u", "v", "w", "p", "q", "r")
STAMP = VehicleStamp("vt690", 466.5, 466.5, "0123456789abcdef")


def make_fit(model, method, status=hd.Status.OK, rank=None):
    """Return a fit whose coefficients count down from -1."""
    n = hd.catalog[model].n_coefficients
    covariance = None if rank is None else np.diag(np.arange(1.0, n + 1))
    tied = (("X_u", "X_u^2"), ("K_p",)) if status is hd.Status.RANK_DEFICIENT else ()
    damping = hd.Damping(hd.catalog[model], -np.arange(1.0, n + 1), covariance, STAMP)
    return hd.Fit(damping, method, status, rank, tied, 1200, {"settings": method})


def make_row(fit, rms, diverged=()):
    """Return a row whose by-axis numbers are its error times 1, 2, ... 6."""
    errors = {name: None if rms is None else rms * (k + 1) for k, name in enumerate(NAMES)}
    fits = {name: None if rms is None else 90.0 - 40.0 * k for k, name in enumerate(NAMES)}
    log = hd.Log(
        np.array([0.0, 0.1, 0.2, 5.0, 5.1]),
        np.arange(30.0).reshape(5, 6),
        segments=(Segment("dive", 0, 3), Segment("turn", 3, 5)),
        source="test.csv",
    )
    velocity = log.velocity + 0.5
    if diverged:
        velocity[4:] = np.nan
    trajectory = hd.Trajectory(log, velocity, diverged, "measured") if fit.status.usable else None
    score = hd.Score(rms, errors, fits, "deg", diverged)
    row = replayed_row(fit, score, trajectory)
    if rms is None:
        return row
    squares = np.full(row.blocks.error.shape, rms**2)
    motion = 0.46**2 / (1.0 - np.array([*fits.values()]) / 100.0) ** 2
    deviation = np.broadcast_to(motion, squares.shape)
    noise = np.zeros(squares.shape)
    blocks = replace(row.blocks, error=squares, deviation=deviation, noise=noise)
    return replace(row, blocks=blocks)


@pytest.fixture
def comparison():
    """One row of every outcome, by two methods."""
    rows = (
        make_row(make_fit("linear", "ls", rank=36), 0.46),
        make_row(make_fit("fossen", "ls", rank=12), None, (("dive", 12.34), ("turn", 0.1))),
        make_row(make_fit("uncoupled", "ls", hd.Status.RANK_DEFICIENT, 22), 2.15),
        make_row(make_fit("coe", "ls", hd.Status.TOO_FEW_SAMPLES), None),
        make_row(make_fit("linear", "ai", hd.Status.NOT_CONVERGED), 14.02),
        make_row(make_fit("fossen", "ai", hd.Status.NOT_CONVERGED), 1234.5),
        make_row(make_fit("uncoupled", "ai", hd.Status.FAILED), None),
    )
    return hd.Comparison(
        rows, provenance={"vehicle": "vt690", "test": "test.csv", "truth": "sname"}
    )


@dataclass(frozen=True)
class Sailed:
    """A short campaign, and what was identified from it."""

    vehicle: hd.Vehicle
    train: hd.Log
    test: hd.Log
    problem: hd.Problem
    table: hd.Comparison

    def fit(self, model, method):
        return self.table.row(model, method).fit


@pytest.fixture(scope="session")
def sailed():
    """Three models by two methods, on runs of 20 s."""
    campaign = hd.reenact(seed=0, duration=20.0)
    models = tuple(hd.catalog[key] for key in ("linear", "prestero", "fossen"))
    problem = hd.prepare(campaign.vehicle, campaign.train, models)
    fits = [
        fit
        for key in ("weak", "ai")
        for fit in hd.identify_all(problem, models, hd.find_method(key))
    ]
    table = hd.compare(fits, campaign.vehicle, campaign.test)
    return Sailed(campaign.vehicle, campaign.train, campaign.test, problem, table)


def column(grid, name):
    """Return the words of a column of a table."""
    place = grid.header.index(name)
    return tuple(row[place] for row in grid.words)
