"""Intervals with room for a bias, and from noise alone."""

import numpy as np
import pytest

from hydrodamp.identification.fit import Uncertainty

FOUND = Uncertainty(np.diag([9.0, 4.0]), 7.0, "by hand", noise=np.diag([4.0, 1.0]))


def test_a_shift_within_the_scatter_adds_nothing():
    assert FOUND.inflate(np.array([2.0, -1.0]), "a bias").standard_errors.tolist() == [3.0, 2.0]


def test_every_standard_error_is_at_least_the_shift():
    wide = FOUND.inflate(np.array([5.0, -3.0]), "a bias")
    np.testing.assert_allclose(wide.standard_errors, [5.0, 3.0])
    np.testing.assert_allclose(wide.noise_only.standard_errors, [5.0, 3.0])
    assert wide.covariance[0, 1] < 0.0
    for each in (wide, wide.rescale(np.array([2.0, 3.0]))):
        correlation = each.without_bias.covariance[0, 1]
        assert correlation == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(wide.without_bias.covariance, FOUND.covariance)


def test_noise_alone_keeps_the_degrees_of_freedom():
    alone = FOUND.noise_only
    assert alone.standard_errors.tolist() == [2.0, 1.0]
    assert alone.critical_value() == pytest.approx(FOUND.critical_value())
    assert alone.noise_only is alone


def test_an_uncertainty_speaks():
    known = Uncertainty(np.diag([1.0, 4.0]), 5.0, "scores", block=10.0, n_blocks=4)
    assert known.critical_value() == pytest.approx(2.5706, abs=1e-4)  # Student's t, 5 degrees
    half = known.interval([0.0, 1.0], 0.5)[1]
    np.testing.assert_allclose(half, 1.0 + 0.72669 * np.array([-2, 2]), atol=1e-4)
    assert str(known).endswith("4 blocks of 10 s; intervals have 5 degrees of freedom.")
    assert str(Uncertainty(np.eye(1), 5.0, "a prior")) == "Standard errors are from a prior."
