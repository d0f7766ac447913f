"""Intervals with room for a bias, and from noise alone."""

from __future__ import annotations

import numpy as np
import pytest

from hydrodamp.identification.intervals import Uncertainty

FOUND = Uncertainty(np.diag([9.0, 4.0]), 7.0, "by hand", noise=np.diag([4.0, 1.0]))


def test_a_shift_within_the_scatter_adds_nothing():
    assert FOUND.widened(np.array([2.0, -1.0]), "a bias").standard_errors.tolist() == [3.0, 2.0]


def test_every_standard_error_is_at_least_the_shift():
    wide = FOUND.widened(np.array([5.0, -3.0]), "a bias")
    np.testing.assert_allclose(wide.standard_errors, [5.0, 3.0])
    np.testing.assert_allclose(wide.of_noise.standard_errors, [5.0, 3.0])
    assert wide.covariance[0, 1] < 0.0


def test_noise_alone_keeps_the_degrees_of_freedom():
    alone = FOUND.of_noise
    assert alone.standard_errors.tolist() == [2.0, 1.0]
    assert alone.reach() == pytest.approx(FOUND.reach())
    assert alone.of_noise is alone
