"""Mass matrices: the rigid body's, the added mass of a hull, and what is refused."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.integrate import quad

from hydrodamp.errors import VehicleError
from hydrodamp.vehicle import mass
from hydrodamp.vehicle.mass import (
    ROLL_FRACTION,
    checked_mass_matrix,
    cross_matrix,
    hull_added_mass,
    lamb_factors,
    rigid_body_mass_matrix,
)
from table_rows import rows

COORDINATE = st.floats(-2.0, 2.0)
VECTOR = st.tuples(COORDINATE, COORDINATE, COORDINATE)


@given(VECTOR, VECTOR)
def test_cross_matrix_is_the_cross_product(a, b):
    np.testing.assert_allclose(cross_matrix(a) @ b, np.cross(a, b), atol=1e-12)


@given(VECTOR, VECTOR, VECTOR)
def test_rigid_body_kinetic_energy(center, linear, angular):
    """A body with spin w has the energy of its centre's speed plus that about the centre."""
    kilograms, inertia = 7.0, np.diag([1.0, 2.0, 2.5])
    matrix = rigid_body_mass_matrix(kilograms, inertia, center, "center_of_gravity")
    velocity = np.concatenate([linear, angular])
    speed = np.asarray(linear) + np.cross(angular, center)
    energy = 0.5 * kilograms * speed @ speed + 0.5 * np.asarray(angular) @ inertia @ angular
    assert 0.5 * velocity @ matrix @ velocity == pytest.approx(energy, rel=1e-9, abs=1e-9)


@rows("function, arguments")
def test_refusals_say_what_is_wanted(function, arguments, refused):
    refused(VehicleError, getattr(mass, function), *arguments)


def test_only_the_free_axes_are_checked(refused):
    matrix = np.diag([1.0, 1.0, 0.0, -1.0, 0.0, 1.0])
    np.testing.assert_array_equal(checked_mass_matrix(matrix, ("X", "Y", "N")), matrix)
    refused(VehicleError, checked_mass_matrix, matrix, ("X", "Y", "K", "N"))


def test_small_matrix_lands_on_its_axes():
    small = np.array([[2.0, 0.0, 0.0], [0.0, 3.0, 0.5], [0.0, 0.5, 1.0]])
    full = checked_mass_matrix(small, ("X", "Y", "N"))
    np.testing.assert_array_equal(full[np.ix_([0, 1, 5], [0, 1, 5])], small)
    assert np.count_nonzero(full) == 5


def test_rounding_asymmetry_is_made_exact():
    checked = checked_mass_matrix(np.eye(6) + 1e-10 * np.eye(6, k=4))
    assert checked[0, 4] == checked[4, 0] > 0.0
    assert not checked.flags.writeable


@pytest.mark.parametrize("ratio", [1.001, 1.02, 1.5, 4.0, 12.5])
def test_lamb_integrals(ratio):
    """Hydrodynamics, article 114: alpha_0 and beta_0 as integrals over confocal ellipsoids."""
    a2 = ratio**2

    def integral(along, across):
        value, _ = quad(lambda x: ratio / ((a2 + x) ** along * (1 + x) ** across), 0, np.inf)
        return float(value)

    alpha, beta = integral(1.5, 1.0), integral(0.5, 2.0)
    slant = (beta - alpha) * (a2 + 1.0)
    pitch = (a2 - 1.0) ** 2 * (beta - alpha) / ((a2 + 1.0) * (2.0 * (a2 - 1.0) - slant))
    expected = (alpha / (2.0 - alpha), beta / (2.0 - beta), pitch)
    assert lamb_factors(ratio) == pytest.approx(expected, abs=1e-6)


def test_sphere_adds_half_of_what_it_displaces():
    added = hull_added_mass(0.4, 0.4, 12.0, 0.0).diagonal()
    np.testing.assert_allclose(added, [6.0, 6.0, 6.0, 0.0, 0.0, 0.0])


def test_remus_from_its_size():
    """Prestero's strip theory with fins gives 35.5 kg in sway and 0.93 kg in surge."""
    added = hull_added_mass(1.33, 0.191, 30.48, 0.177).diagonal()
    assert added[0] == pytest.approx(0.93, rel=0.25)
    assert added[1] == pytest.approx(35.5, rel=0.25)
    assert added[3] == ROLL_FRACTION * 0.177
