"""Terms of attitude as buoyancy and centre of buoyancy."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.basis.term import AXES, DOWN
from hydrodamp.errors import ModelError
from hydrodamp.export.plant import ExportedPlant
from hydrodamp.export.restoring import absorb_restoring

from .conftest import RICH

DOWNWARD = np.random.default_rng(4).normal(size=(40, 3))


def plant_of(changes):
    """A plant whose terms of attitude add a matrix to the restoring matrix."""
    labels = {
        f"{axis}_{down}": float(changes[i, j])
        for i, axis in enumerate(AXES)
        for j, down in enumerate(DOWN)
        if changes[i, j]
    }
    return ExportedPlant.of(RICH, hd.Damping.from_dict(None, {"X_u": -5.0, **labels}))


def test_the_terms_of_another_buoyancy_are_that_buoyancy():
    other = replace(RICH, buoyancy=470.0, center_of_buoyancy=np.array([0.03, -0.02, -0.05]))
    absorbed = absorb_restoring(plant_of(other.restoring_matrix - RICH.restoring_matrix), DOWNWARD)
    assert absorbed.vehicle.buoyancy == pytest.approx(470.0, rel=1e-12)
    np.testing.assert_allclose(
        absorbed.vehicle.restoring_matrix, other.restoring_matrix, atol=1e-10
    )
    assert absorbed.damping.as_dict() == {"X_u": -5.0}


def test_terms_that_no_body_has_leave_the_least_squares_by_the_directions():
    changes = np.zeros((6, 3))
    changes[0, 0], changes[2, 2], changes[3, 1], changes[4, 0] = 8.0, 2.0, 3.0, -1.0
    absorbed = absorb_restoring(plant_of(changes), DOWNWARD).vehicle
    target = RICH.restoring_matrix + changes

    def error(vehicle):
        return float(np.mean((DOWNWARD @ (vehicle.restoring_matrix - target).T) ** 2))

    least = error(absorbed)
    assert 0.0 < least < error(RICH)


def test_a_net_weight_beyond_the_weight_is_refused(refused):
    changes = np.zeros((6, 3))
    changes[[0, 1, 2], [0, 1, 2]] = 2.0 * RICH.weight
    refused(ModelError, lambda: absorb_restoring(plant_of(changes), DOWNWARD))
