"""Verdicts and predicted errors on several splits of one log."""

from __future__ import annotations

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.report.table import to_text
from hydrodamp.report.verdict_tables import verdict_table
from hydrodamp.validation.verdict import Light

SPLITS = [
    pytest.param((0.0, 0.75), (0.75, 1.0), id="the last quarter"),
    pytest.param((0.25, 1.0), (0.0, 0.25), id="the first quarter"),
    pytest.param((0.0, 0.5), (0.5, 1.0), id="the second half"),
]


pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore::hydrodamp.errors.HydrodampWarning"),
]


@pytest.fixture
def home(measured_logs):
    return measured_logs("campaigns") / "c22"


@pytest.fixture
def log(home):
    return hd.read_log(home / "estimation.csv")


@pytest.fixture
def vehicle(home):
    return hd.read_vehicle(home / "vehicle.yaml")


def sensor_errors(log):
    """Standard deviations of white errors of the sensors, by differences."""
    return np.std(np.diff(log.velocity, axis=0), axis=0) / np.sqrt(2.0)


@pytest.mark.parametrize(("train", "test"), SPLITS)
def test_a_verdict_is_short_follows_its_lights_and_depends_on_no_unit(train, test, log, vehicle):
    """Verdicts on splits of one log may differ, not on deg/s against rad/s."""
    start, duration = log.time[0], log.time[-1] - log.time[0]
    parts = [log.between(*(start + duration * np.array(each))) for each in (train, test)]
    models = [hd.catalog[key] for key in ("gertler-hagen", "prestero", "linear", "fossen")]
    fits = hd.identify_all(hd.prepare(vehicle, parts[0], models), models, hd.WeakForm())
    by_unit = [hd.compare(fits, vehicle, parts[1], rate_unit=unit) for unit in ("deg", "rad")]
    degrees, radians = (table.verdict() for table in by_unit)
    assert degrees.lines == radians.lines
    assert degrees.relative_error == pytest.approx(radians.relative_error)
    lights = {axis.light for axis in degrees.axes}
    assert degrees.headline.startswith("Usable: ") == (Light.RED not in lights)
    assert len(to_text(verdict_table(degrees, ("Next: a command.",)), 80).splitlines()) <= 12
    selection = by_unit[0].select()
    smaller = [row for row in selection.equivalent if row.n_coefficients < degrees.n_coefficients]
    assert not smaller


@pytest.mark.parametrize("key", ["prestero", "fossen"])
@pytest.mark.parametrize("share", [0.75, 1.0])
def test_the_predicted_error_covers_that_on_the_rest_of_a_log(key, share, home, log, vehicle):
    middle = log.time[0] + share * (log.time[-1] - log.time[0])
    rest = log.between(middle, log.time[-1]) if share < 1.0 else None
    rest = rest or hd.read_log(home / "validation.csv")
    problem = hd.prepare(vehicle, log.between(log.time[0], middle), hd.catalog[key])
    fit = hd.find_method("recommended").identify(problem, hd.catalog[key])
    band = hd.predict_error(vehicle, fit, rest)
    error = np.sqrt(np.mean((band.velocity - rest.velocity) ** 2, axis=0))
    half_width = np.sqrt(np.mean(band.half_width**2, axis=0))
    assert np.all(error <= np.hypot(half_width, 2.0 * sensor_errors(rest)))


@pytest.mark.parametrize(
    ("train", "test"), [((0.0, 600.0), (600.0, 801.0)), ((600.0, 801.0), (0.0, 600.0))]
)
def test_a_band_covers_the_samples_of_velocities_within_their_range(train, test, log, vehicle):
    """It does so in either direction, and names the velocities that the training data lack."""
    parts = [log.between(*(log.time[0] + np.array(each))) for each in (train, test)]
    fit = hd.identify(hd.catalog["prestero"], vehicle, parts[0], hd.Recommended())
    band = hd.predict_error(vehicle, fit, parts[1])
    bound = np.hypot(band.half_width, 1.96 * sensor_errors(parts[1]))
    covered = np.mean(np.abs(band.velocity - parts[1].velocity) <= bound, axis=0)
    assert len(band.extrapolated) < 4
    for name, share in zip(VELOCITIES, covered.tolist(), strict=True):
        assert share > 0.94 or name in band.extrapolated, (name, share)
