"""Plots of many samples keep every extreme, at any zoom."""

import numpy as np
import pytest

from hydrodamp.report.decimation import BLOCK, DecimatedSeries


@pytest.fixture(scope="module")
def series():
    """Noise of 100 000 samples at uneven times."""
    rng = np.random.default_rng(0)
    time = np.cumsum(rng.uniform(0.5, 1.5, 100_000))
    return DecimatedSeries.of(time, rng.standard_normal(100_000))


@pytest.mark.parametrize("share", [1.0, 0.3, 0.05, 0.001])
def test_the_extremes_of_an_interval_are_in_the_plot(series, share):
    middle, span = np.mean(series.time[[0, -1]]), np.ptp(series.time)
    start, end = middle - share * span / 2, middle + share * span / 2
    time, values = series.between(start, end, 300)
    inside = (series.time >= start) & (series.time <= end)
    assert len(time) <= 602
    assert np.nanmax(values) >= series.values[inside].max()
    assert np.nanmin(values) <= series.values[inside].min()
    near = 2 * BLOCK * 1.5  # a block on either side may be in the plot
    wider = (series.time >= start - near) & (series.time <= end + near)
    assert np.nanmax(values) <= series.values[wider].max()


def test_few_samples_are_plotted_as_they_are(series):
    time, values = series.between(series.time[500], series.time[600], 300)
    np.testing.assert_array_equal(values, series.values[500:601])
    np.testing.assert_array_equal(time, series.time[500:601])


def test_missing_values_and_empty_intervals_are_gaps():
    time = np.concatenate([np.arange(2000.0), 8000.0 + np.arange(2000.0)])
    values = np.ones(4000)
    values[:500] = np.nan
    moments, plotted = DecimatedSeries.of(time, values).between(0.0, 10_000.0, 100)
    assert np.isnan(plotted[moments < 400.0]).all()
    assert np.isnan(plotted[(moments > 2200.0) & (moments < 7800.0)]).all()
    assert np.nanmin(plotted) == np.nanmax(plotted) == 1.0


def test_an_empty_series_has_no_points():
    assert [len(each) for each in DecimatedSeries.of(*np.empty((2, 0))).between(0, 1, 10)] == [0, 0]
