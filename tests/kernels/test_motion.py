"""Equation 1's right-hand side."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

import oracle
from hydrodamp import kernels
from hydrodamp.kernels.plant import Plant

SEEDS = st.integers(0, 2**32 - 1)


@given(SEEDS)
def test_the_moving_frame_does_no_work(make, seed):
    rng = np.random.default_rng(seed)
    mass, nu = make.mass_matrix(rng), rng.uniform(-5, 5, (8, 6))
    wrench = kernels.coriolis(mass, nu)
    scale = np.abs(nu) @ np.abs(wrench).T
    assert np.all(np.abs(np.sum(nu * wrench, axis=1)) <= 1e-13 * (1 + np.diag(scale)))


def test_the_moving_frame_by_hand():
    """A point mass of 2 kg at surge 3 m/s turning at 0.5 rad/s: Y = -m u r."""
    wrench = kernels.coriolis(2.0 * np.eye(6), np.array([[3.0, 0, 0, 0, 0, 0.5]]))
    np.testing.assert_allclose(wrench, [[0, -3.0, 0, 0, 0, 0]], atol=1e-15)


def test_the_munk_moment_by_hand():
    """N = (m11 - m22) u v: a slender hull in oblique flow turns broadside."""
    mass = np.diag([30.0, 60.0, 60.0, 1.0, 5.0, 5.0])
    wrench = kernels.coriolis(mass, np.array([[2.0, 0.5, 0, 0, 0, 0]]))
    assert wrench[0, 5] == pytest.approx((30.0 - 60.0) * 2.0 * 0.5)


def test_equation_one_in_vectors(make):
    """M dnu/dt = [p1 x w ; p1 x v + p2 x w] + K xi + wrench."""
    rng = np.random.default_rng(1)
    plant, inputs = make.plant(rng), make.inputs(rng, n=1)
    matrix, nu = rng.standard_normal((plant.n_terms, 6)), inputs.velocity[0]
    p = plant.mass_matrix @ nu
    gyroscopic = np.concatenate(
        [np.cross(p[:3], nu[3:]), np.cross(p[:3], nu[:3]) + np.cross(p[3:], nu[3:])]
    )
    xi = kernels.regressor(
        plant.factors, inputs.velocity, inputs.down, inputs.channels, np.array([1.1])
    )[0]
    expected = np.linalg.solve(plant.mass_matrix, gyroscopic + xi @ matrix + inputs.wrench[0])
    found = oracle.acceleration(
        plant, matrix, nu, inputs.down[0], inputs.wrench[0], inputs.channels[0], 1.1
    )
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_three_degrees_of_freedom_use_the_sub_block(make):
    """Rows of the 6 x 6 inverse would let locked axes give way; the 3 x 3 inverse does not."""
    rng = np.random.default_rng(2)
    axes = np.array([0, 1, 5])
    free = np.isin(np.arange(6), axes)
    full = make.plant(rng)
    plant = Plant(full.mass_matrix, free, full.factors, full.n_channels)
    matrix, wrench = rng.standard_normal((plant.n_terms, 6)), rng.standard_normal(6)
    nu, down, held = np.where(free, 0.7, 0.0), np.array([0.0, 0, 1]), np.array([0.1, -0.2])
    xi = kernels.regressor(plant.factors, nu[None], down[None], held[None], np.ones(1))[0]
    force = kernels.coriolis(plant.mass_matrix, nu[None])[0] + xi @ matrix + wrench
    expected = np.linalg.solve(plant.mass_matrix[np.ix_(axes, axes)], force[axes])
    recorded = np.where(free, nu, 9.0)
    found = oracle.acceleration(plant, matrix, recorded, down, wrench, held, 1.0)
    np.testing.assert_allclose(found[axes], expected, rtol=1e-12)
    np.testing.assert_array_equal(found[~free], 0.0)
