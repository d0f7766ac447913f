"""Replay: sub-steps in closed form, segments, divergence."""

import numpy as np
import pytest

from hydrodamp.kernels import core
from hydrodamp.kernels.plant import Inputs, Plant

FREE = (True,) * 6
WHOLE = np.array([[0, 2]])


def constant_inputs(time, velocity):
    rest = [np.zeros((len(time), width)) for width in (3, 6, 0, 2, 3)]
    return Inputs(time, np.tile(velocity, (len(time), 1)), *rest)


@pytest.mark.parametrize(("length", "steps"), [(0.1, 2), (0.3 - 0.2, 2), (0.11, 3), (0.02, 1)])
def test_sub_steps_are_equal_and_no_longer_than_asked(length, steps):
    """One linear RK4 step multiplies by 1 - z + z^2/2 - z^3/6 + z^4/24, z = rate * step."""
    plant = Plant(np.eye(6), FREE, [[1, 0, 0, 0]], 0)
    matrix = np.array([[-3.0, 0, 0, 0, 0, 0]])
    z = 3.0 * length / steps
    inputs = constant_inputs([0.0, length], [1, 0, 0, 0, 0, 0])
    found, *_ = core.replay(plant, matrix, inputs, WHOLE)
    once = 1 - z + z**2 / 2 - z**3 / 6 + z**4 / 24
    assert found[1, 0] == pytest.approx(once**steps, rel=1e-14)


def test_overflow_and_a_lost_first_sample_have_diverged():
    plant = Plant(np.eye(6), FREE, [[1, 1, 1, 1]], 0)
    matrix = np.array([[1e3, 0, 0, 0, 0, 0]])
    burst = constant_inputs([0.0, 1.0, 2.0], [9.0, 0, 0, 0, 0, 0])
    assert core.replay(plant, matrix, burst, np.array([[0, 3]]))[1][0] == 1
    lost = constant_inputs([0.0, 1.0], [np.nan, 0, 0, 0, 0, 0])
    assert core.replay(plant, matrix, lost, WHOLE)[1][0] == 0
