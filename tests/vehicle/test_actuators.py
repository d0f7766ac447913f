"""Laws that every kind of actuator keeps, then what each of them does."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import VehicleError
from table_rows import rows

ALL = [
    hd.Matrix(("forward", "turn"), [[1, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 2]]),
    hd.Fin("rudder", {"Y": 9.0, "N": -8.0}),
    hd.Fin("rudder", {"Y": 9.0}, drag={"X": -4.0}, limit=0.3, name="aft"),
    hd.Fin("rudder", {"Y": 9.0}, dead_zone=(-0.01, 0.02)),
    hd.Propeller("rpm", 3e-6),
    hd.Propeller("rpm", 3e-6, dead_zone=(-100, 150), limit=1500),
    hd.Propeller("rpm", 3e-6, advance=-1e-4, torque=-1e-7, speed_slope=0.001, limit=1500),
    hd.Thruster("port", (0, -0.2, 0), (1, 0, 0), gain=40),
    hd.Thruster("port", (0, -0.2, 0), (1, 0, 1), gain=40, dead_zone=(-0.1, 0.2), limit=0.9),
    hd.Thruster("port", (0, -0.2, 0), (1, 0, 0), curve=[(-1, -30), (1, 50)]),
]


@pytest.mark.parametrize("actuator", ALL, ids=lambda one: f"{type(one).__name__}")
def test_missing_command_is_named(actuator, refused):
    refused(VehicleError, actuator.channels, {})
    near = {f"{actuator.commands[0]}s": np.zeros(2), "fuel": np.zeros(2)}
    refused(VehicleError, actuator.channels, near)


def test_dead_zones_of_fins_and_propellers():
    fin = ALL[3].channels({"rudder": np.array([-0.02, -0.01, 0.0, 0.02, 0.03])})
    np.testing.assert_array_equal(fin["rudder_limited"], [-0.02, 0, 0, 0, 0.03])
    propeller = ALL[5].channels({"rpm": np.array([-200.0, 0.0, 150.0, 151.0, 2000.0])})
    np.testing.assert_array_equal(propeller["rpm_limited"], [-200, 0, 0, 151, 1500])


def test_propulsion_speed():
    """The DIVE vehicle of the 690's laboratory: u = 0.0061071 rpm - 0.43304."""
    propeller = hd.Propeller("rpm", 1.0, speed_slope=0.0061071, speed_offset=-0.43304, limit=300)
    speed = propeller.propulsion_speed({"rpm": np.array([200.0, 1000.0])})
    np.testing.assert_allclose(speed, [0.78838, 1.39909])
    assert hd.Propeller("rpm", 1.0).propulsion_speed({"rpm": np.zeros(1)}) is None


@rows("kind, fields")
def test_refusals(kind, fields, refused):
    refused(VehicleError, getattr(hd, kind), **fields)


def test_thruster_limit_dead_zone_and_gain():
    command = np.array([-2.0, -0.5, -0.1, 0.0, 0.2, 0.21, 2.0])
    thrust = ALL[8].channels({"port": command})["port_thrust"]
    np.testing.assert_allclose(thrust, [-36, -20, 0, 0, 0, 8.4, 36])


CURVE = hd.Curve("m1", reference=400.0, reverse_ratio=0.8, exponent=1.6, dead_band=25.0)


def test_a_curve_keeps_its_reference_and_mirrors_with_a_ratio_of_one():
    commands = np.array([-500.0, -400.0, -25.0, 10.0, 212.5, 400.0])
    values = CURVE.channels({"m1": commands})["m1"]
    np.testing.assert_allclose(values[[1, 5]], [-320.0, 400.0], rtol=1e-15)
    np.testing.assert_array_equal(values[[2, 3]], 0.0)
    assert values[4] == pytest.approx(400.0 * 0.5**1.6)
    even = replace(CURVE, reverse_ratio=1.0)
    forward, back = (even.channels({"m1": sign * commands})["m1"] for sign in (1.0, -1.0))
    np.testing.assert_array_equal(forward, -back)


def test_actuators_and_propulsion_get_the_value_of_a_curve():
    curve = replace(CURVE, voltage="battery", reference_voltage=16.0, voltage_exponent=1.2)
    thruster = hd.Thruster("m1", (0, 0.2, 0), (1, 0, 0), gain=0.1)
    propeller = hd.Propeller("m1", thrust=1.0, speed_slope=0.01)
    vehicle = hd.Vehicle("boat", np.eye(6), 1.0, 1.0, actuators=(thruster, propeller, curve))
    assert vehicle.commands == ("m1", "battery")
    commands = {"m1": np.array([400.0]), "battery": np.array([12.0])}
    values = 400.0 * 0.75**1.2
    np.testing.assert_allclose(vehicle.channels(commands)["m1"], values)
    np.testing.assert_allclose(vehicle.propulsion_speed(commands), 0.01 * values)


@rows("fields")
def test_a_curve_that_cannot_be_is_refused(fields, refused):
    refused(VehicleError, replace, CURVE, **fields)


def test_two_curves_of_a_command_are_refused(refused):
    refused(VehicleError, lambda: hd.Vehicle("boat", np.eye(6), 1.0, 1.0, actuators=(CURVE, CURVE)))
