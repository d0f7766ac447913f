"""Estimates from main dimensions against published ships, boats and ROVs."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

import hydrodamp as hd
from hydrodamp.errors import VehicleError
from hydrodamp.vehicle.file import parse_vehicle
from hydrodamp.vehicle.hulls import BOAT_STD, ROV_STD, SHIP_STD, WATER_DENSITY, ship_added_mass
from hydrodamp.vehicle.template import vehicle_template
from table_rows import rows

KVLCC2_SCALE = 0.5 * 320.0**2 * 20.8
TANKER_SCALE = 220000.0
#: Length, beam, draft [m] and displacement [m^3]; published added mass in surge and sway [m^3] and
#: in yaw [m^5] over the density of water.
SHIPS = {
    # Chislett and Strom-Tejsen (1965): -42e-5, -748e-5, -43.8e-5 of L^3/2; 1546e-5 has the mass.
    "mariner": (160.93, 23.17, 8.23, 18541.0, *(
        np.array([42e-5, 748e-5, 43.8e-5 * 160.93**2]) * 0.5 * 160.93**3)),
    # Yasukawa and Yoshimura (2015): 0.022, 0.223, 0.011 of L^2 d/2.
    "kvlcc2": (320.0, 58.0, 20.8, 312622.0, *(
        np.array([0.022, 0.223, 0.011 * 320.0**2]) * KVLCC2_SCALE)),
    # Son and Nomoto (1982): 0.000238, 0.007049, 0.000419 of L^3/2.
    "container": (175.0, 25.4, 8.5, 21222.0, *(
        np.array([238e-6, 7049e-6, 419e-6 * 175.0**2]) * 0.5 * 175.0**3)),
    # Van Berlekom and Goddard (1972): 0.05 and 1.02 of the displacement, 0.1232 with the inertia.
    "tanker": (304.8, 47.17, 18.46, 220000.0, *(
        np.array([0.05, 1.02, (0.1232 - 0.25**2) * 304.8**2]) * TANKER_SCALE)),
}  # fmt: skip


def log_ratios(name):
    length, beam, draft, volume, *published = SHIPS[name]
    added, is_covered = ship_added_mass(length, beam, draft, volume * WATER_DENSITY)
    assert is_covered
    return np.log(np.array(published) * WATER_DENSITY / added.diagonal()[[0, 1, 5]])


@pytest.mark.parametrize("name", SHIPS)
def test_published_ships_lie_within_two_standard_deviations(name):
    assert (np.abs(log_ratios(name)) < 2.0 * np.array(SHIP_STD)[[0, 1, 5]]).all()


def test_the_std_of_a_ship_is_the_spread_of_published_ships():
    spread = np.sqrt(np.mean(np.square([log_ratios(name) for name in SHIPS]), axis=0))
    np.testing.assert_allclose(np.array(SHIP_STD)[[0, 1, 5]], spread, atol=0.05)


def test_clarke_and_soeding_by_hand():
    """Mariner: pi (T/L)^2 (1 + 0.16 C_B B/T - 5.1 (B/L)^2) = 958e-5 and so on, of rho L^3/2."""
    length, beam, draft, volume = SHIPS["mariner"][:4]
    added, _ = ship_added_mass(length, beam, draft, volume * WATER_DENSITY)
    scale = 0.5 * WATER_DENSITY * length**3
    assert added[0, 0] / scale == pytest.approx(65.0e-5, rel=0.01)
    assert added[1, 1] / scale == pytest.approx(958e-5, rel=0.01)
    assert added[1, 5] / scale / length == pytest.approx(46.5e-5, rel=0.01)
    assert added[5, 5] / scale / length**2 == pytest.approx(53.2e-5, rel=0.01)


def test_the_added_mass_of_a_container_ship_acts_where_it_is_published():
    """Son and Nomoto (1982): 0.05 L before amidships."""
    length, beam, draft, volume = SHIPS["container"][:4]
    added, _ = ship_added_mass(length, beam, draft, volume * WATER_DENSITY)
    assert added[1, 5] / added[1, 1] / length == pytest.approx(0.05, abs=0.01)


@given(st.floats(0.02, 1.0), st.floats(0.02, 30.0), st.floats(0.05, 1.0), st.floats(0.3, 300.0))
def test_any_floating_hull_has_positive_definite_added_mass(slenderness, flatness, block, length):
    beam = slenderness * length
    draft = beam / flatness
    boat = hd.Vehicle.from_dimensions("boat", length, beam, draft, block_coefficient=block)
    free = np.ix_((0, 1, 5), (0, 1, 5))
    assert np.linalg.eigvalsh(boat.added_mass[free])[0] > 0.0
    assert boat.axes == ("X", "Y", "N")


def test_estimates_scale_with_froude():
    """Mass by the cube, moments of inertia by the fifth power of the scale."""
    small, large = (
        hd.Vehicle.from_dimensions("ship", 3.2 * k, 0.58 * k, 0.208 * k, block_coefficient=0.81)
        for k in (1.0, 100.0)
    )
    power = np.array([1e6, 1e6, 1e10])
    free = (0, 1, 5)
    np.testing.assert_allclose(
        large.mass_matrix.diagonal()[[*free]], small.mass_matrix.diagonal()[[*free]] * power
    )
    assert large.std == small.std


def test_a_small_boat_is_estimated_with_a_factor_of_two():
    boat = hd.Vehicle.from_dimensions("boat", 1.2, 0.3, 0.1, mass=17.0)
    assert boat.std == {"added_mass": BOAT_STD}
    assert boat.mass_matrix[0, 0] == pytest.approx(
        17.0 + 2.7 * 17.0 ** (5 / 3) / 1025 ** (2 / 3) / 1.44
    )
    assert boat.mass_matrix[5, 5] - boat.added_mass[5, 5] == pytest.approx(17.0 * 0.3**2)


def test_a_catamaran_has_two_hulls_at_the_distance_of_its_beam():
    """Otter: pontoons 0.25 m wide; sway 1.5 m, yaw 1.7 I_z of its published model."""
    otter = hd.Vehicle.from_dimensions("catamaran", 2.0, 1.08, 0.134, mass=55.0)
    assert "0.25 m wide" in otter.note
    pontoon, _ = ship_added_mass(2.0, 0.25, 0.134, 27.5)
    assert otter.added_mass[1, 1] == pytest.approx(2.0 * pontoon[1, 1], rel=0.01)
    yaw = 2.0 * (pontoon[5, 5] + pontoon[0, 0] * 0.415**2)
    assert otter.added_mass[5, 5] == pytest.approx(yaw, rel=0.01)
    published = np.array([1.5 * 55.0, 1.7 * 55.0 * 0.25])
    ratios = np.log(published / otter.added_mass.diagonal()[[1, 5]])
    assert (np.abs(ratios) < np.array(BOAT_STD)[[1, 5]]).all()


@pytest.mark.parametrize(("name", "beam"), [("bluerov2", 0.338), ("bluerov2-heavy", 0.4)])
def test_published_rovs_lie_within_two_standard_deviations(name, beam):
    known = hd.fleet[name]
    mass = (known.mass_matrix - known.added_mass)[0, 0]
    rov = hd.Vehicle.from_dimensions("rov", 0.457, beam, 0.254, mass=mass)
    ratios = np.log(known.added_mass.diagonal() / rov.added_mass.diagonal())
    assert (np.abs(ratios) < 2.0 * np.array(ROV_STD)).all()
    assert np.sqrt(np.mean(ratios**2)) < ROV_STD[0]


def test_a_cube_and_a_prism_have_the_coefficients_of_the_table():
    """DNV-RP-H103, table A-2: 0.68 of a cube; 0.36 along a prism of twice its width."""
    cube = hd.Vehicle.from_dimensions("rov", 1.0, 1.0, 1.0, mass=1000.0)
    np.testing.assert_allclose(cube.added_mass.diagonal()[:3], 680.0)
    prism = hd.Vehicle.from_dimensions("rov", 1.0, 0.5, 0.5, mass=250.0)
    assert prism.added_mass[0, 0] == pytest.approx(0.36 * 250.0)
    sides = prism.added_mass.diagonal()
    assert sides[5] == pytest.approx((sides[1] * 1.0 + sides[0] * 0.25) / 12.0)
    inertia = (prism.mass_matrix - prism.added_mass).diagonal()[3:]
    np.testing.assert_allclose(inertia, np.array([0.5, 1.25, 1.25]) * 250.0 / 12.0)


@rows("kind, sizes")
def test_dimensions_that_cannot_be_are_refused(kind, sizes, refused):
    known = {"length": 1.2, "beam": 0.3, "draft": 0.1} | sizes
    refused(VehicleError, hd.Vehicle.from_dimensions, kind, **known)


@rows("kind, sizes")
def test_a_file_has_the_estimate(kind, sizes):
    written = parse_vehicle(vehicle_template("mine", None, kind, **sizes))
    estimate = hd.Vehicle.from_dimensions(kind, **sizes)
    free = np.ix_(estimate.free, estimate.free)
    np.testing.assert_allclose(written.mass_matrix[free], estimate.mass_matrix[free], rtol=1e-5)
    assert (written.axes, written.std) == (estimate.axes, estimate.std)
    assert estimate.note in written.source


def test_a_template_may_have_fewer_axes():
    text = vehicle_template("b", ("X", "N"), "boat", length=1.2, beam=0.3, draft=0.1, mass=17.0)
    assert parse_vehicle(text).axes == ("X", "N")


@rows("axes, kind, sizes")
def test_axes_and_sizes_of_another_kind_are_refused(axes, kind, sizes, refused):
    refused(VehicleError, vehicle_template, "b", axes, kind, **sizes)
