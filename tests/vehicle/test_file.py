from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp import errors
from hydrodamp.errors import VehicleError
from hydrodamp.vehicle.file import fleet, format_vehicle, parse_vehicle
from table_rows import rows

RIGID = "rigid_body: {mass: 10, inertia: [1, 2, 2]}\n"
ADDED = f"added_mass: {np.diag([1.0, 8, 8, 0.1, 1, 1]).tolist()}\n"
REST = "name: mine\nweight: 98\nbuoyancy: 99\n"


def test_round_trip(equipped, tmp_path):
    path = tmp_path / "vehicle.yaml"
    hd.write_vehicle(equipped, path)
    assert hd.read_vehicle(path) == equipped


def test_round_trip_of_every_setting():
    curve, dead_zone = [(-1, -30), (1, 1e-7)], (-0.1, 0.1)
    more = {"curve": curve, "dead_zone": dead_zone, "limit": 0.9, "name": "port_aft"}
    actuators = (
        hd.Thruster("port", (-0.1, -0.2, 1 / 3), (1, 1, 0), **more),
        hd.Fin("rudder", {"Y": 9.0}, dead_zone=(-0.01, 0.02)),
        hd.Propeller("rpm", 3e-6, dead_zone=(-50, 50), limit=1500),
    )
    settings = {"axes": ("X", "Y", "N"), "actuators": actuators, "estimate": ("gains",)}
    ship = hd.Vehicle("s", np.eye(3), 0.0, 0.0, **settings)
    assert parse_vehicle(format_vehicle(ship)) == ship


def test_rigid_body_and_added_mass_add_up():
    vehicle = parse_vehicle(REST + RIGID + ADDED + "center_of_gravity: [0, 0, 0.1]\n")
    np.testing.assert_allclose(vehicle.mass_matrix.diagonal(), [11, 18, 18, 1.1, 3, 3])
    assert vehicle.mass_matrix[0, 4] == pytest.approx(1.0)
    assert vehicle.added_mass[0, 0] == 1.0


def test_inertia_tensor_about_the_center_of_gravity():
    rigid = (
        "rigid_body:\n  mass: 10\n  inertia_about: center_of_gravity\n"
        "  inertia: [[1, 0, 0.1], [0, 2, 0], [0.1, 0, 2]]\n"
    )
    vehicle = parse_vehicle(REST + rigid + ADDED + "center_of_gravity: [0, 0, 0.1]\n")
    assert vehicle.mass_matrix[3, 3] == pytest.approx(1.2)
    assert vehicle.mass_matrix[3, 5] == pytest.approx(0.1)


def test_three_axes_need_no_weight():
    ship = parse_vehicle("{name: s, axes: [X, Y, N], mass_matrix: [[2,0,0],[0,3,0],[0,0,1]]}")
    assert ship.axes == ("X", "Y", "N")
    assert ship.weight == ship.buoyancy == 0.0


def test_what_locked_axes_need_may_stay_empty():
    """The planar part of the mass matrix is made of m, Izz, r_G and three added masses."""
    text = """
    name: boat
    axes: [X, Y, N]
    rigid_body: {mass: 10, inertia: [null, null, 70]}
    added_mass: [[1,0,0,0,0,0],[0,8,0,0,0,2],[0,0,null,0,0,0],null,[0,0,0,0,null,0],[0,2,0,0,0,9]]
    weight:
    buoyancy:
    center_of_gravity: [0.1, 0, null]
    center_of_buoyancy:
    actuators:
    note:
    """
    boat = parse_vehicle(text)
    free = np.ix_([0, 1, 5], [0, 1, 5])
    np.testing.assert_allclose(boat.mass_matrix[free], [[11, 0, 0], [0, 18, 3], [0, 3, 79]])
    assert boat.weight == boat.buoyancy == 0.0
    assert boat.center_of_buoyancy.tolist() == [0, 0, 0]
    assert boat.actuators == ()


def test_a_body_that_only_moves_along_needs_no_inertia():
    text = "{name: s, axes: [X, Y], rigid_body: {mass: 3, inertia: }, added_mass: AAA}"
    rows = "[[1,0,0,0,0,0],[0,1,0,0,0,0],null,null,null,null]"
    assert parse_vehicle(text.replace("AAA", rows)).mass_matrix[1, 1] == 4.0


@rows("text")
def test_faults_are_collected_with_file_and_key(tmp_path, text, refused):
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    refused(errors.VehicleError, hd.read_vehicle, path)


@pytest.mark.parametrize("name", ["a\ab", "a\nb", "", "x" * 300, "a\u202eb"])
def test_a_name_is_a_line_of_printable_characters(name, refused):
    refused(VehicleError, lambda: replace(fleet["vt690"], name=name))
    refused(VehicleError, lambda: replace(fleet["vt690"], note="a\ab"))
