"""Errors and pushes: levels as stated, colour as stated, streams apart."""

import numpy as np
import pytest

from hydrodamp.simulation.campaign.conditions import COLOURED, WHITE

DEVIATIONS = [0.0133] * 3 + [8.7e-4] * 3 + [7.7e-5] * 3 + [np.sqrt(0.001)]
"""As the source rounds them: DVL, gyro, attitude, depth (vehicles-and-methods, section 1)."""


@pytest.mark.parametrize("conditions", [WHITE, COLOURED])
def test_levels_are_as_published(conditions):
    """Sample deviations lie within a few hundredths of the stated ones, coloured or not."""
    errors = conditions.draw_errors(5, n_runs=6, n_samples=10000)
    np.testing.assert_allclose(errors.std(axis=(0, 1)), DEVIATIONS, rtol=0.03)
    np.testing.assert_allclose(errors.mean(axis=(0, 1)) / DEVIATIONS, 0.0, atol=0.04)


def test_white_channels_runs_and_samples_are_independent():
    """No correlation beyond chance between any two columns or neighbours in time."""
    errors = WHITE.draw_errors(6, n_runs=2, n_samples=10000)
    columns = np.concatenate((errors[1:, 0], errors[1:, 1], errors[:-1, 0]), axis=1)
    correlation = np.corrcoef(columns.T) - np.eye(columns.shape[1])
    assert np.max(np.abs(correlation)) < 0.05


def autocorrelation(series, lag):
    """Of series of mean zero, shape (n, n_runs, n_columns), averaged over runs."""
    return (series[lag:] * series[:-lag]).mean(axis=(0, 1)) / (series**2).mean(axis=(0, 1))


@pytest.mark.parametrize(("period", "lag"), [(0.1, 1), (0.1, 2), (0.1, 5), (0.02, 10)])
def test_coloured_errors_forget_as_stated(period, lag):
    """Autocorrelation exp(-lag / time): DVL 0.4 s, gyro 0.1 s, attitude 0.5 s, depth 0.4 s."""
    times = np.array([0.4] * 3 + [0.1] * 3 + [0.5] * 3 + [0.4])
    errors = COLOURED.draw_errors(7, n_runs=6, n_samples=20000, period=period)
    forgotten = np.exp(-period * lag / times)
    np.testing.assert_allclose(autocorrelation(errors, lag), forgotten, atol=0.025)


def test_pushes_are_as_strong_and_last_as_stated():
    """Autocorrelation exp(-1/2) after one second, correlated on no two axes."""
    pushes = COLOURED.draw_pushes(8, n_runs=6, n_samples=40000)
    np.testing.assert_allclose(pushes.std(axis=(0, 1)), COLOURED.push, rtol=0.03)
    np.testing.assert_allclose(autocorrelation(pushes, 10), np.exp(-0.5), atol=0.025)
    correlation = np.corrcoef(pushes.reshape(-1, 6).T) - np.eye(6)
    assert np.max(np.abs(correlation)) < 0.06


@pytest.mark.parametrize("name", ["draw_errors", "draw_pushes"])
@pytest.mark.parametrize(("n_runs", "n_samples"), [(2, 50), (6, 20)])
def test_beginning_of_a_run_depends_on_its_seed_alone(name, n_runs, n_samples):
    """Fewer runs or samples cut the same streams short."""
    draw = getattr(COLOURED, name)
    np.testing.assert_array_equal(draw(9, n_runs, n_samples), draw(9, 6, 50)[:n_samples, :n_runs])
    assert not np.any(draw(8, n_runs, n_samples) == draw(9, n_runs, n_samples))
