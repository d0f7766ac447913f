import re
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import FileError, VehicleError
from hydrodamp.vehicle.file import format_vehicle, parse_vehicle
from hydrodamp.vehicle.vehicle import without_righting
from table_rows import rows


@pytest.mark.parametrize("name", hd.fleet)
class TestEveryVehicle:
    def test_reads_under_its_name(self, name):
        assert hd.fleet[name].name == name
        assert hd.fleet[name] is hd.fleet[name]

        assert hd.fleet[name].source
        assert hd.fleet[name].note

    def test_every_number_has_a_source(self, name):
        """Every line with a number carries a comment, or stands under one that does."""
        text = files("hydrodamp.vehicle").joinpath("fleet", f"{name}.yaml").read_text("utf-8")
        commented = False
        for line in text.splitlines():
            if re.search(r": .*\d", line) and not re.match(r"\s*(#|source|note|name)", line):
                assert "#" in line or commented, line
            commented = "#" in line or (commented and line.startswith("  "))

    def test_added_mass_is_positive_semidefinite_and_less_than_the_whole(self, name):
        vehicle = hd.fleet[name]
        free = np.ix_(vehicle.free, vehicle.free)
        assert np.linalg.eigvalsh(vehicle.added_mass[free])[0] >= 0.0
        assert np.linalg.eigvalsh((vehicle.mass_matrix - vehicle.added_mass)[free])[0] > 0.0

    def test_rights_itself(self, name):
        """Heeled, the moment turns it back: its center of buoyancy lies above its gravity."""
        lean = np.array([[0.0, np.sin(0.1), np.cos(0.1)], [-np.sin(0.1), 0.0, np.cos(0.1)]])
        wrench = hd.fleet[name].restoring_wrench(lean)
        for heeled, axis in ((wrench[0, 3], "K"), (wrench[1, 4], "M")):
            assert heeled < 0.0 or axis not in hd.fleet[name].axes
        assert without_righting(hd.fleet[name]) == ""

    def test_round_trip(self, name):
        assert parse_vehicle(format_vehicle(hd.fleet[name])) == hd.fleet[name]

    def test_fin_moments_belong_to_a_tail(self, name):
        """Y and N of a rudder astern have opposite signs, Z and M of a stern plane equal ones."""
        for actuator in hd.fleet[name].actuators:
            force = dict(getattr(actuator, "force", ()))
            if "Y" in force:
                assert force["Y"] * force["N"] < 0.0
            if "Z" in force:
                assert force["Z"] * force["M"] > 0.0


def test_vt690_numbers():
    """Section 1 of the 690's sources: 47.556 kg, symmetrised off-diagonal pairs."""
    matrix = hd.fleet["vt690"].mass_matrix
    expected = [60.603, 95.794, 99.3461, 0.928, 29.4507, 29.4646]
    np.testing.assert_allclose(matrix.diagonal(), expected, rtol=1e-12)
    assert matrix[1, 5] == pytest.approx(-(2.6899 + 3.67588) / 2)
    assert matrix[2, 4] == pytest.approx(-(0.67173 - 0.776908) / 2)
    assert matrix[0, 4] == pytest.approx(47.556 * 0.0083)


def test_vt690_thrust_balances_its_published_drag():
    """At u = u_c the thrust is X_u|u| u^2 with X_u|u| = -3.244."""
    vehicle, commands = hd.fleet["vt690"], {"rudder": [0.0], "elevator": [0.0], "rpm": [2060.0]}
    speed = vehicle.propulsion_speed(commands)
    thrust = vehicle.known_wrench([[speed[0], 0, 0, 0, 0, 0]], [[0, 0, 1]], commands)[0, 0]
    assert thrust == pytest.approx(3.244 * speed[0] ** 2)


def test_lauv_fin_force():
    """Two fins a plane: 2 x 0.5 rho S CL = 1028 x 0.0064 x 3.0, at x = -0.4 m."""
    rudder = dict(hd.fleet["lauv"].actuators[1].force)
    assert rudder["Y"] == pytest.approx(1028 * 0.0064 * 3.0)
    assert rudder["N"] == pytest.approx(-0.4 * rudder["Y"])
    propeller = hd.fleet["lauv"].actuators[0]
    assert propeller.thrust * propeller.limit**2 == pytest.approx(50.0)


def test_mariner_has_the_dimensionless_mass_matrix_of_its_source():
    """Chislett and Strom-Tejsen: m' - Y_vdot' = 1546e-5, I_z' - N_rdot' = 83e-5, of rho L^3/2."""
    matrix, length = hd.fleet["mariner"].mass_matrix, 160.93
    scale = 0.5 * 1025 * length**3
    assert matrix[0, 0] / scale == pytest.approx(840e-5)
    assert matrix[1, 1] / scale == pytest.approx(1546e-5)
    assert matrix[5, 5] / scale / length**2 == pytest.approx(83e-5)
    coupling = -0.023 * 798e-5 + (9.354e-5 - 4.646e-5) / 2.0
    assert matrix[1, 5] / scale / length == pytest.approx(coupling)


def test_kvlcc2_has_the_mass_matrix_of_the_mmg_standard_method():
    """Yasukawa and Yoshimura (2015): 0.022, 0.223 and 0.011 of rho L^2 d/2."""
    vehicle, scale = hd.fleet["kvlcc2"], 0.5 * 1025 * 320.0**2 * 20.8
    added = vehicle.added_mass.diagonal()[[0, 1, 5]] / (scale, scale, scale * 320.0**2)
    np.testing.assert_allclose(added, [0.022, 0.223, 0.011])
    yaw = 1025 * 312600 * ((0.25 * 320.0) ** 2 + 11.2**2) + 0.011 * scale * 320.0**2
    assert vehicle.mass_matrix[5, 5] == pytest.approx(yaw)


def test_otter_turns_to_starboard_by_its_left_propeller():
    """B = k [1 1; 0.395 -0.395] of otter.m, at 50 rad/s."""
    commands = {"left": [50.0], "right": [0.0]}
    wrench = hd.fleet["otter"].known_wrench([[0.0] * 6], [[0, 0, 1]], commands)[0]
    assert wrench[0] == pytest.approx(0.01108 * 50.0**2)
    assert wrench[5] == pytest.approx(0.395 * wrench[0])


def test_unknown_name_names_the_nearest(equipped, tmp_path, monkeypatch, refused):
    assert len(hd.fleet) == 8
    assert "lauv" in hd.fleet
    assert 5 not in hd.fleet
    refused(VehicleError, lambda: hd.fleet["vt609"])
    refused(VehicleError, hd.find_vehicle, "remus")
    hd.write_vehicle(equipped, tmp_path / "mine.yaml")
    monkeypatch.chdir(tmp_path)
    refused(VehicleError, hd.find_vehicle, "mine")


def test_find_vehicle_takes_names_and_files(equipped, tmp_path, refused):
    hd.write_vehicle(equipped, tmp_path / "mine.yaml")
    assert hd.find_vehicle(tmp_path / "mine.yaml") == equipped
    assert hd.find_vehicle("lauv") is hd.fleet["lauv"]
    with pytest.raises(FileError, match=r"yours\.yaml: cannot be read: No such file"):
        hd.find_vehicle(tmp_path / "yours.yaml")
    refused(FileError, lambda: hd.find_vehicle(tmp_path / "mine.yml"))


def test_a_file_of_a_vehicle_that_nothing_rights_is_told(equipped, tmp_path):
    level = replace(equipped, center_of_gravity=equipped.center_of_buoyancy)
    hd.write_vehicle(level, tmp_path / "mine.yaml")
    with pytest.warns(hd.HydrodampWarning, match="no righting moment in roll and pitch"):
        hd.find_vehicle(tmp_path / "mine.yaml")


def cube(gravity=0.0, lift=0.0, weight=10.0, **more):
    centers = {"center_of_gravity": (0, 0, gravity), "center_of_buoyancy": (0, 0, lift)}
    return hd.Vehicle("cube", np.eye(6), weight, weight, **centers, **more)


@pytest.mark.parametrize(
    ("gravity", "lift", "weight", "rights"),
    [(0.01, 0, 10, True), (0, -0.01, 10, True), (0, 0, 10, False), (0.1, 0, 0, False)],
)
def test_it_rights_where_gravity_lies_below_and_weighs(gravity, lift, weight, rights):
    assert (without_righting(cube(gravity, lift, weight)) == "") is rights


@rows("axes, words")
def test_only_free_axes_count(axes, words):
    told = without_righting(cube(axes=axes))
    assert words in told
    assert bool(told) is bool(words)
    for axis, term in (("K", "K: down_y"), ("M", "M: down_x")):
        assert (term in told) is (bool(told) and axis in axes)
