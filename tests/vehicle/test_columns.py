from __future__ import annotations

import numpy as np

from hydrodamp.basis.term import Term
from hydrodamp.vehicle.actuators import Column
from hydrodamp.vehicle.vehicle import gather, restoring_columns, restoring_matrix


def test_gather_sums_equal_terms_and_drops_what_cancels():
    rudder, rpm = Term.parse("rudder"), Term.parse("rpm")
    known = gather(
        [
            Column("Y", rudder, 1.0),
            Column("X", rpm, 2.0),
            Column("N", rudder, -3.0),
            Column("X", rpm, -2.0),
        ]
    )
    assert known.terms == (rudder,)
    np.testing.assert_array_equal(known.matrix, [[0], [1], [0], [0], [0], [-3]])
    assert not known.matrix.flags.writeable


def test_nothing_known_is_an_empty_matrix():
    known = gather([])
    assert known.terms == ()
    assert known.matrix.shape == (6, 0)


def test_restoring_columns_are_the_restoring_matrix():
    matrix = restoring_matrix(100.0, 104.0, (0.01, -0.02, 0.03), (0.02, 0.01, -0.04))
    known = gather(restoring_columns(matrix))
    assert [str(term) for term in known.terms] == ["down_x", "down_y", "down_z"]
    np.testing.assert_array_equal(known.matrix, matrix)


def test_restoring_wrench_is_the_gradient_of_potential_energy():
    """Rotating by dphi about a body axis moves d by d x dphi; the work is that of the moment."""
    rng = np.random.default_rng(1)
    weight, buoyancy, gravity, lift = 100.0, 104.0, rng.normal(size=3), rng.normal(size=3)
    matrix = restoring_matrix(weight, buoyancy, gravity, lift)
    for down in rng.normal(size=(20, 3)):
        turn = 1e-6 * rng.normal(size=3)

        def potential(direction: np.ndarray) -> float:
            return float(-(weight * gravity - buoyancy * lift) @ direction)

        moved = potential(down + np.cross(down, turn)) - potential(down)
        np.testing.assert_allclose((matrix @ down)[3:] @ turn, -moved, rtol=1e-6, atol=1e-12)


def test_center_of_buoyancy_above_gravity_rights_the_vehicle():
    """Rolled to starboard, down leans to port of the body's z: the moment must be negative."""
    matrix = restoring_matrix(100.0, 100.0, (0, 0, 0.02), (0, 0, 0))
    roll, pitch = 0.1, 0.1
    assert (matrix @ [0.0, np.sin(roll), np.cos(roll)])[3] < 0.0
    assert (matrix @ [-np.sin(pitch), 0.0, np.cos(pitch)])[4] < 0.0
