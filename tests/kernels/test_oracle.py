"""The C core equals its oracle in NumPy.

Where only products are formed the bits agree. Elsewhere sums run in another
order (two chains of terms in C, BLAS in NumPy) and the 6 x 6 systems are solved
by L D L^T against LU, so results differ by rounding: some units of 1e-16 a step,
relative to the largest entry, and the tolerance leaves a factor of a thousand.
"""

import numpy as np
import pytest

import oracle
from hydrodamp.kernels import core
from hydrodamp.kernels.core import Gains

ROUNDING = 1e-12


def close(found, expected):
    scale = np.nanmax(np.abs(expected), initial=1.0)
    np.testing.assert_allclose(found, expected, rtol=0, atol=ROUNDING * scale)


@pytest.fixture
def rng():
    return np.random.default_rng(4)


@pytest.mark.parametrize("n", [1, 63, 64, 65, 3000])
@pytest.mark.parametrize("order", ["C", "F", None])
def test_regressor_bit_for_bit_in_any_order(make, rng, n, order):
    plant, inputs = make.plant(rng), make.inputs(rng, n=n)
    arguments = (plant.factors, inputs.velocity, inputs.down, inputs.channels)
    speed = inputs.propulsion[:, 0]
    out = None if order is None else np.empty((n, plant.n_terms), order=order)
    found = core.regressor(*arguments, speed, out)
    assert out is None or found is out
    np.testing.assert_array_equal(found, oracle.regressor(*arguments, speed))


def test_coriolis_of_an_asymmetric_matrix(rng):
    mass, velocity = rng.standard_normal((6, 6)), rng.standard_normal((50, 6))
    close(core.coriolis(mass, velocity), oracle.coriolis(mass, velocity))


@pytest.mark.parametrize("simulated", [False, True])
@pytest.mark.parametrize("free", [(True,) * 6, (True, True, False, False, False, True)])
def test_replay(make, rng, simulated, free):
    plant, matrix = make.linear_plant(rng, free)
    inputs = make.inputs(rng)
    segments = np.array([[0, 15], [17, 40]])
    attitude = make.attitude(rng, inputs.n) if simulated else None
    arguments = (plant, matrix, inputs, segments)
    found, diverged, _ = core.replay(*arguments, attitude=attitude)
    expected, also = oracle.replay(*arguments, attitude=attitude)
    close(found, expected)
    np.testing.assert_array_equal(diverged, also)
    np.testing.assert_array_equal(diverged, [-1, -1])


@pytest.mark.parametrize("free", [(True,) * 6, (True, True, False, False, False, True)])
def test_adapt_with_history_over_passes(make, rng, free):
    plant, inputs = make.plant(rng, free=free), make.inputs(rng)
    gamma = rng.uniform(0, 2, (plant.n_terms, 6)) * (rng.random((plant.n_terms, 6)) > 0.3)
    start = rng.standard_normal((plant.n_terms, 6))
    segments = np.array([[0, 15], [15, 16], [17, 40]])
    gains = Gains(plant, rng.uniform(1, 30, 6), gamma)
    arguments = (gains, start, inputs, segments, 3, 7)
    found, expected = core.adapt(*arguments), oracle.adapt(*arguments)
    for name in ("matrix", "error", "history_time", "history_error", "history_matrix"):
        close(getattr(found, name), getattr(expected, name))
    assert len(found.history_time) == 3 * (14 + 0 + 22) // 7
