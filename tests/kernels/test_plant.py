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


def test_locked_axes_do_not_couple_in_the_effective_mass():
    mass = np.eye(6) + 0.1
    plant = Plant(mass, (True, True, False, False, False, True), [[1, 0, 0, 0]], 0)
    assert plant.effective_mass[0, 1] == pytest.approx(0.1)
    assert plant.effective_mass[0, 2] == 0.0
    assert plant.effective_mass[2, 2] == 1.0


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
        ({"mass_matrix": np.eye(5)}, r"`mass_matrix` must have shape \(6, 6\); got \(5, 5\)"),
        ({"mass_matrix": np.eye(6) + np.eye(6, k=1)}, "must be symmetric"),
        ({"mass_matrix": -np.eye(6)}, "smallest eigenvalue is -1"),
        ({"free": (True,) * 3}, r"`free` must have shape \(6,\); got \(3,\)"),
        ({"factors": [[1, 2]]}, r"shape \(n_terms, 4\); got \(1, 2\)"),
        ({"factors": [[1, 21, 0, 0]]}, r"0\.\.20 with 0 channels; got 0\.\.21"),
        ({"factors": np.array([[2**32 + 1, 0, 0, 0]])}, r"got 0\.\.4294967297"),
        ({"factors": [[1.7, 0, 0, 0]]}, "must be whole numbers; got float64"),
        ({"factors": [[-1, 0, 0, 0]]}, r"got -1\.\.0"),
        ({"n_channels": -1}, "at least 0; got -1"),
    ],
)
def test_what_cannot_be_is_refused(change, message):
    good = {"mass_matrix": np.eye(6), "free": FREE, "factors": [[1, 0, 0, 0]], "n_channels": 0}
    with pytest.raises(ProblemError, match=message):
        Plant(**(good | change))
