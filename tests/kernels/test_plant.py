"""The tables that C reads: plants, records, samples; what cannot be is refused."""

import pickle

import numpy as np
import pytest

from hydrodamp.errors import ProblemError
from hydrodamp.kernels.plant import Inputs, Plant, Sample

FREE = (True,) * 6


def test_arrays_are_copied_and_cannot_be_written():
    mass = np.eye(6)
    plant = Plant(mass, FREE, [[1, 0, 0, 0]], 0)
    mass[0, 0] = 7.0
    assert plant.mass_matrix[0, 0] == 1.0
    for array in (plant.mass_matrix, plant.free, plant.factors):
        assert not array.flags.writeable


def test_locked_rows_need_not_be_symmetric_or_positive():
    mass = np.eye(6)
    mass[2, 2], mass[0, 2] = -1.0, 3.0
    plant = Plant(mass, np.arange(6) != 2, [[1, 0, 0, 0]], 0)
    np.testing.assert_array_equal(plant.mass_matrix, mass)


def test_survives_pickling_for_a_process_pool():
    plant = pickle.loads(pickle.dumps(Plant(np.eye(6), FREE, [[1, 22, 0, 0]], 1)))
    assert (plant.n_terms, plant.n_channels) == (1, 1)


def test_a_sample_alone_is_level_and_unforced():
    alone = Sample.of(time=1.0, velocity=np.ones(6))
    np.testing.assert_array_equal(alone.values, [1] * 7 + [0, 0, 1] + [0] * 8)
    with pytest.raises(ProblemError, match="shapes required"):
        Sample.of(time=1.0, velocity=np.ones(5))


@pytest.mark.parametrize(
    "name", ["velocity", "down", "wrench", "channels", "propulsion", "down_slope"]
)
def test_every_array_must_have_a_row_a_sample(name):
    widths = {
        "velocity": 6,
        "down": 3,
        "wrench": 6,
        "channels": 1,
        "propulsion": 2,
        "down_slope": 3,
    }
    arrays = {key: np.zeros((4 - (key == name), width)) for key, width in widths.items()}
    with pytest.raises(ValueError, match=rf"`{name}` must have shape \(4, .*got \(3, "):
        Inputs(time=np.arange(4), **arrays)
