from __future__ import annotations

import pickle

import numpy as np
import pytest

from hydrodamp.errors import ProblemError
from hydrodamp.kernels.plant import Plant

FREE = (True,) * 6


def test_arrays_are_copied_and_cannot_be_written():
    mass = np.eye(6)
    plant = Plant(mass, FREE, [[1, 0, 0, 0]], 0)
    mass[0, 0] = 7.0
    assert plant.mass_matrix[0, 0] == 1.0
    for array in (plant.mass_matrix, plant.mass_columns, plant.free, plant.factors):
        assert not array.flags.writeable


def test_locked_rows_need_not_be_symmetric_or_positive():
    mass = np.eye(6)
    mass[2, 2], mass[0, 2] = -1.0, 3.0
    plant = Plant(mass, (True, True, False, True, True, True), [[1, 0, 0, 0]], 0)
    np.testing.assert_array_equal(plant.mass_matrix, mass)


def test_survives_pickling_for_a_process_pool():
    plant = pickle.loads(pickle.dumps(Plant(np.eye(6), FREE, [[1, 22, 0, 0]], 1)))
    assert plant.n_terms == 1
    assert plant.n_channels == 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"factors": [[1, 2]]}, r"shape \(n_terms, 4\).*; got \(1, 2\)"),
        ({"factors": [[1, 21, 0, 0]]}, r"0\.\.20 with 0 channels; got \(1, 4\), 0\.\.21"),
        ({"factors": np.array([[2**32 + 1, 0, 0, 0]])}, r"0\.\.4294967297"),
        ({"factors": [[1.7, 0, 0, 0]]}, "must be whole numbers; got float64"),
        ({"factors": [[-1, 0, 0, 0]]}, r"-1\.\.0"),
    ],
)
def test_what_cannot_be_is_refused(change, message):
    good = {"mass_matrix": np.eye(6), "free": FREE, "factors": [[1, 0, 0, 0]], "n_channels": 0}
    with pytest.raises(ProblemError, match=message):
        Plant(**(good | change))
