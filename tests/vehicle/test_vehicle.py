import dataclasses
import pickle

import numpy as np
import pytest

from hydrodamp.errors import VehicleError
from hydrodamp.vehicle.actuators import Fin, Propeller
from hydrodamp.vehicle.vehicle import Vehicle, mass_matrix_digest
from table_rows import rows

RUDDER = Fin("rudder", {"Y": 1.0}, limit=0.3)


def commands_of(vehicle, motion):
    return {name: motion[name] for name in vehicle.commands}


def test_known_wrench_by_hand(equipped, motion):
    """Every actuator's law, written out, and weight and buoyancy at their centres."""
    u, down = motion["velocity"][:, 0], motion["down"]
    delta = np.clip(motion["rudder"], -0.3, 0.3)
    n = np.clip(motion["rpm"], -2000, 2000)
    bow = np.interp(motion["bow"], [-1, 0, 1], [-20, 0, 30])
    wrench = np.zeros((50, 6))
    wrench[:, 0] = -4.0 * u * np.abs(u) * delta**2 + 3e-6 * n * np.abs(n) - 2e-4 * u * np.abs(n)
    wrench[:, 1] = 9.0 * u * np.abs(u) * delta + bow
    wrench[:, 2] = 12.0 * motion["vertical"]
    wrench[:, 3] = 1e-7 * n * np.abs(n) - 0.1 * bow
    wrench[:, 4] = -3.0 * motion["vertical"]
    wrench[:, 5] = -8.0 * u * np.abs(u) * delta + 0.6 * bow
    wrench[:, :3] += (100.0 - 104.0) * down
    wrench[:, 3:] += np.cross([0.01, -0.02, 0.03], 100.0 * down)
    wrench[:, 3:] -= np.cross([0.02, 0.01, -0.04], 104.0 * down)
    known = equipped.known_wrench(motion["velocity"], down, commands_of(equipped, motion))
    np.testing.assert_allclose(known, wrench, rtol=1e-12, atol=1e-12)


def test_propulsion_speed_is_the_mean_of_the_propellers_that_know(equipped, motion):
    speed = equipped.propulsion_speed(motion)
    np.testing.assert_allclose(speed, 0.001 * np.clip(motion["rpm"], -2000, 2000))
    twin = dataclasses.replace(
        equipped,
        actuators=(
            Propeller("port", 1.0, speed_slope=0.1),
            Propeller("starboard", 1.0, speed_slope=0.3),
            Propeller("bow", 1.0),
        ),
    )
    assert twin.propulsion_speed({n: np.ones(1) for n in twin.commands}) == pytest.approx(0.2)
    assert dataclasses.replace(equipped, actuators=()).propulsion_speed({}) is None
    assert equipped.propulsion_speed({"rudder": np.zeros(3)}) is None


@rows("change")
def test_refusals(equipped, change, refused):
    refused(VehicleError, dataclasses.replace, equipped, **change)


@pytest.mark.parametrize("second", [RUDDER, Fin("rudder_limited", {"Y": 1.0})])
def test_two_actuators_with_one_channel_are_refused(equipped, second, refused):
    refused(VehicleError, dataclasses.replace, equipped, actuators=(RUDDER, second))


def test_a_name_of_its_own_keeps_channels_of_one_command_apart(equipped):
    two = (RUDDER, dataclasses.replace(RUDDER, name="upper"))
    assert dataclasses.replace(equipped, actuators=two).actuators == two


def test_is_a_value(equipped):
    twin = pickle.loads(pickle.dumps(equipped))
    assert twin == equipped
    assert hash(twin) == hash(equipped)
    assert equipped != dataclasses.replace(equipped, weight=99.0)
    assert equipped != dataclasses.replace(equipped, added_mass=None)
    assert equipped != dataclasses.replace(equipped, mass_matrix=2 * equipped.mass_matrix)
    assert equipped != "equipped"
    for array in (equipped.mass_matrix, equipped.center_of_gravity, equipped.added_mass):
        assert not array.flags.writeable


def test_digest_tells_mass_matrices_apart(equipped):
    digest = mass_matrix_digest(equipped.mass_matrix)
    assert len(digest) == 16
    assert digest == mass_matrix_digest(equipped.mass_matrix * (1 + 1e-13))
    assert digest != mass_matrix_digest(equipped.mass_matrix * 1.001)


def test_from_hull_is_close_to_the_690():
    """The 690 has 95.8 kg in sway and 29.5 kg m^2 in yaw (fleet)."""
    vehicle = Vehicle.from_hull(2.194, 0.1753, 47.556)
    assert vehicle.mass_matrix[1, 1] == pytest.approx(95.8, rel=0.1)
    assert vehicle.mass_matrix[5, 5] == pytest.approx(29.5, rel=0.35)
    assert vehicle.weight == vehicle.buoyancy == pytest.approx(466.5, rel=1e-3)
    assert "estimate" in vehicle.source


def test_from_hull_moves_the_rigid_body_to_its_center_of_gravity(refused):
    vehicle = Vehicle.from_hull(1.0, 0.2, 10.0, center_of_gravity=(0, 0, 0.05), buoyancy=110.0)
    assert vehicle.mass_matrix[0, 4] == pytest.approx(0.5)
    assert vehicle.buoyancy == 110.0
    refused(VehicleError, Vehicle.from_hull, 1.0, 0.0, 10.0)


def test_one_screen_with_everything(equipped, snapshot):
    ship = Vehicle("ship", np.diag([2.0, 3.0, 4.0]), 0.0, 0.0, axes=("X", "Y", "N"))
    for vehicle in (equipped, ship):
        assert len(str(vehicle).splitlines()) <= 25
        assert str(vehicle) == snapshot
    assert ship.free.tolist() == [True, True, False, False, False, True]
