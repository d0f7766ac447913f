"""Errors: levels as stated, streams apart."""

import numpy as np

from hydrodamp.simulation.campaign.conditions import WHITE_NOISE

DEVIATIONS = [0.0133] * 3 + [8.7e-4] * 3 + [7.7e-5] * 3 + [np.sqrt(0.001)]
"""As the source rounds them: DVL, gyro, attitude, depth (vehicles-and-methods, section 1)."""


def test_levels_are_as_published():
    """Sample deviations lie within a few hundredths of the stated ones."""
    errors = WHITE_NOISE.sample_sensor_errors(5, n_runs=6, n_samples=10000)
    np.testing.assert_allclose(errors.std(axis=(0, 1)), DEVIATIONS, rtol=0.03)
    np.testing.assert_allclose(errors.mean(axis=(0, 1)) / DEVIATIONS, 0.0, atol=0.04)


def test_white_channels_runs_and_samples_are_independent():
    """No correlation beyond chance between any two columns or neighbours in time."""
    errors = WHITE_NOISE.sample_sensor_errors(6, n_runs=2, n_samples=10000)
    columns = np.concatenate((errors[1:, 0], errors[1:, 1], errors[:-1, 0]), axis=1)
    correlation = np.corrcoef(columns.T) - np.eye(columns.shape[1])
    assert np.max(np.abs(correlation)) < 0.05
