"""Excitation signals: orthogonal multisines of low peaks, and bounded steps."""

import numpy as np
import pytest

from hydrodamp.experiment_design.guidance import (
    SHAPES,
    Manoeuvre,
    _unit_signals,
    candidate_manoeuvres,
    low_peak_phases,
)


def test_multisines_share_no_harmonic_so_they_are_orthogonal():
    signals = _unit_signals("multisine", 0.5, 5, 500, 0.1)
    products = signals.T @ signals / 500
    assert np.abs(products - np.diag(np.diag(products))).max() < 1e-12
    assert np.abs(signals).max(axis=0) == pytest.approx(np.ones(5))


def test_phases_make_a_lower_peak_than_those_of_schroeder():
    # Relative peak factor (Morelli 2012): range over 2 sqrt(2) rms, one for a single sine.
    def factor(harmonics, shift):
        time = np.linspace(0.0, 2.0 * np.pi, 4096)[:-1]
        signal = np.sin(np.outer(time, harmonics) + shift).sum(axis=1)
        return np.ptp(signal) / (2.0 * np.sqrt(2.0) * np.std(signal))

    harmonics = np.arange(2, 22, 2)
    k = np.arange(1, 11)
    schroeder = factor(harmonics, -np.pi * k * (k - 1) / 10)
    optimised = factor(harmonics, low_peak_phases(tuple(harmonics.tolist())))
    assert 1.0 <= optimised < min(schroeder, 1.2)


@pytest.mark.parametrize("shape", SHAPES)
def test_no_signal_exceeds_one(shape):
    signals = _unit_signals(shape, 0.7, 4, 400, 0.1)
    assert np.abs(signals).max() <= 1.0 + 1e-12
    assert np.all(np.abs(signals).max(axis=0) > 0.0)


def test_the_design_vector_defines_the_manoeuvre():
    for manoeuvre in candidate_manoeuvres(2):
        rebuilt = Manoeuvre.from_design_vector(manoeuvre.design_vector)
        for name in ("shape", "level", "tempo"):
            assert getattr(rebuilt, name) == getattr(manoeuvre, name)
        assert rebuilt.strengths == pytest.approx(manoeuvre.strengths)
