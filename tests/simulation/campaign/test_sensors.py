"""Noise as published, the same for the same seed."""

from __future__ import annotations

import numpy as np
import pytest

from hydrodamp.simulation.campaign.sensors import draw_noise

DEVIATIONS = [0.0133] * 3 + [8.7e-4] * 3 + [7.7e-5] * 3 + [np.sqrt(0.001)]
"""As the source rounds them: DVL, gyro, attitude, depth (vehicles-and-methods, section 1)."""


def test_levels_are_as_published() -> None:
    """Sample deviations of 60000 draws lie within a hundredth of the stated ones."""
    noise = draw_noise(5, n_runs=6, n_samples=10000)
    np.testing.assert_allclose(noise.std(axis=(0, 1)), DEVIATIONS, rtol=0.02)
    np.testing.assert_allclose(noise.mean(axis=(0, 1)) / DEVIATIONS, 0.0, atol=0.02)


def test_channels_runs_and_samples_are_independent() -> None:
    """No correlation beyond chance between any two columns or neighbours in time."""
    noise = draw_noise(6, n_runs=2, n_samples=10000)
    columns = np.concatenate((noise[1:, 0], noise[1:, 1], noise[:-1, 0]), axis=1)
    correlation = np.corrcoef(columns.T) - np.eye(columns.shape[1])
    assert np.max(np.abs(correlation)) < 0.05


def test_same_seed_same_noise_other_seed_other_noise() -> None:
    """Determinism by seed."""
    np.testing.assert_array_equal(draw_noise(7, 3, 20), draw_noise(7, 3, 20))
    assert not np.any(draw_noise(7, 3, 20) == draw_noise(8, 3, 20))


@pytest.mark.parametrize(("n_runs", "n_samples"), [(2, 50), (6, 20)])
def test_beginning_of_a_run_depends_on_its_seed_alone(n_runs: int, n_samples: int) -> None:
    """Fewer runs or samples cut the same streams short."""
    whole = draw_noise(9, 6, 50)
    np.testing.assert_array_equal(draw_noise(9, n_runs, n_samples), whole[:n_samples, :n_runs])
