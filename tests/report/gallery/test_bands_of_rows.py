"""Which replays have a band in a picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.report.gallery import bands_of_rows
from hydrodamp.report.gallery.bands_of_rows import affordable_bands, said_of_bands


@pytest.fixture
def rows(examined):
    """Of two models, with covariance."""
    return [row for row in examined.table.rows if row.method == "weak"]


def test_a_band_is_that_of_the_covariance_with_its_degrees_of_freedom(examined, rows):
    bands = affordable_bands(examined.vehicle, rows)
    assert list(bands) == [("linear", "weak"), ("fossen", "weak")]
    row = rows[0]
    problem = hd.prepare(examined.vehicle, row.trajectory.log, row.fit.model)
    freedom = row.fit.uncertainty.degrees_of_freedom
    direct = hd.prediction_band(problem, row.fit.damping, degrees_of_freedom=freedom)
    band = bands["linear", "weak"]
    np.testing.assert_array_equal(band.upper, direct.upper)
    np.testing.assert_allclose(band.velocity, row.trajectory.velocity, atol=1e-9)
    said = said_of_bands(bands)
    assert said.startswith("Shaded, of linear by weak and fossen by weak: ")
    assert said.endswith(".")


def test_without_covariance_or_along_an_own_attitude_there_is_none(examined, rows):
    row = rows[0]
    bare = replace(row, fit=replace(row.fit, damping=replace(row.fit.damping, covariance=None)))
    own = replace(row, trajectory=replace(row.trajectory, attitude="simulated"))
    unknown = [one for one in examined.table.rows if one.method == "ai"]
    never = replace(row, trajectory=None)
    assert affordable_bands(examined.vehicle, [bare, own, never, *unknown]) == {}
    assert said_of_bands({}) == ""


def test_what_takes_too_long_has_none_and_the_chosen_comes_first(examined, rows, monkeypatch):
    log = rows[0].trajectory.log
    steps = max(log.n, log.duration / 0.05)
    monkeypatch.setattr(bands_of_rows, "_WORK", 36.0 * steps)
    assert list(affordable_bands(examined.vehicle, rows)) == [("linear", "weak")]
    assert list(affordable_bands(examined.vehicle, rows[::-1])) == [("fossen", "weak")]
