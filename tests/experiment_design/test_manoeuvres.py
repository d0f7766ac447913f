"""Manoeuvres: multisines that share nothing and have low peaks, steps that stay in bounds."""

import numpy as np
import pytest

from hydrodamp.experiment_design.excitation import (
    SHAPES,
    Manoeuvre,
    _waves,
    candidate_manoeuvres,
    low_peak_phases,
)


def test_multisines_share_no_harmonic_so_they_are_orthogonal():
    waves = _waves("multisine", 0.5, 5, 500, 0.1)
    products = waves.T @ waves / 500
    assert np.abs(products - np.diag(np.diag(products))).max() < 1e-12
    assert np.abs(waves).max(axis=0) == pytest.approx(np.ones(5))


def test_phases_make_a_lower_peak_than_those_of_schroeder():
    # Relative peak factor (Morelli 2012): range over 2 sqrt(2) rms, one for a single sine.
    def factor(harmonics, shift):
        time = np.linspace(0.0, 2.0 * np.pi, 4096)[:-1]
        wave = np.sin(np.outer(time, harmonics) + shift).sum(axis=1)
        return np.ptp(wave) / (2.0 * np.sqrt(2.0) * np.std(wave))

    harmonics = np.arange(2, 22, 2)
    k = np.arange(1, 11)
    schroeder = factor(harmonics, -np.pi * k * (k - 1) / 10)
    found = factor(harmonics, low_peak_phases(tuple(harmonics.tolist())))
    assert 1.0 <= found < min(schroeder, 1.2)


@pytest.mark.parametrize("shape", SHAPES)
def test_no_wave_is_larger_than_one(shape):
    waves = _waves(shape, 0.7, 4, 400, 0.1)
    assert np.abs(waves).max() <= 1.0 + 1e-12
    assert np.all(np.abs(waves).max(axis=0) > 0.0)


def test_numbers_make_the_manoeuvre_they_are_of():
    for one in candidate_manoeuvres(2):
        again = Manoeuvre.from_design_vector(one.numbers)
        assert (again.shape, again.level, again.tempo) == (one.shape, one.level, one.tempo)
        assert again.strengths == pytest.approx(one.strengths)
