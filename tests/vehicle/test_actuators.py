"""Laws that every kind of actuator keeps, then what each of them does."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import VehicleError

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
class TestEveryKind:
    def test_missing_command_is_named(self, actuator):
        with pytest.raises(VehicleError, match=f"`{actuator.commands[0]}`; got none"):
            actuator.channels({})
        with pytest.raises(VehicleError, match=r"; got .*s, fuel\. Did you mean"):
            actuator.channels({f"{actuator.commands[0]}s": np.zeros(2), "fuel": np.zeros(2)})


def test_a_matrix_has_a_row_a_command():
    with pytest.raises(VehicleError, match=r"`wrench` must have shape \(1, 6\)"):
        hd.Matrix(("forward",), [[1, 2, 3]])


def test_dead_zones_of_fins_and_propellers():
    fin = ALL[3].channels({"rudder": np.array([-0.02, -0.01, 0.0, 0.02, 0.03])})
    np.testing.assert_array_equal(fin["rudder_limited"], [-0.02, 0, 0, 0, 0.03])
    propeller = ALL[5].channels({"rpm": np.array([-200.0, 0.0, 150.0, 151.0, 2000.0])})
    np.testing.assert_array_equal(propeller["rpm_limited"], [-200, 0, 0, 151, 1500])
    with pytest.raises(VehicleError, match=r"`dead_zone` must be \(lowest, highest\)"):
        hd.Fin("rudder", {"Y": 9.0}, dead_zone=(0.1, -0.1))
    with pytest.raises(VehicleError, match=r"`dead_zone` must have shape \(2\)"):
        hd.Propeller("rpm", 3e-6, dead_zone=(1, 2, 3))


def test_propulsion_speed():
    """The DIVE vehicle of the 690's laboratory: u = 0.0061071 rpm - 0.43304."""
    propeller = hd.Propeller("rpm", 1.0, speed_slope=0.0061071, speed_offset=-0.43304, limit=300)
    speed = propeller.propulsion_speed({"rpm": np.array([200.0, 1000.0])})
    np.testing.assert_allclose(speed, [0.78838, 1.39909])
    assert hd.Propeller("rpm", 1.0).propulsion_speed({"rpm": np.zeros(1)}) is None


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: hd.Propeller("rpm", np.nan), "`thrust` must be a finite number; got nan"),
        (lambda: hd.Propeller("rpm", 1.0, speed_slope=0.0), "`speed_slope` must be a positive"),
        (lambda: hd.Propeller("rpm", 1.0, limit=-1.0), "`limit` must be a positive number"),
        (lambda: hd.Fin("uv", {"Y": 1.0}), "`command`.*`uv` reads as the product"),
        (lambda: hd.Fin("rudder", {"Y": 1.0}, name="2nd"), "`name`.*letters, digits"),
        (lambda: hd.Fin("rudder", {"Y": 1.0}, name="r"), "`name`.*reserved"),
        (lambda: hd.Fin("rudder", {"Q": 1.0}), "`force` must name axes of X Y Z K M N"),
        (lambda: hd.Fin("rudder", {"Y": np.inf}), "`force Y` must be a finite"),
    ],
)
def test_refusals(call, message):
    with pytest.raises(VehicleError, match=message):
        call()


def test_thruster_limit_dead_zone_and_gain():
    command = np.array([-2.0, -0.5, -0.1, 0.0, 0.2, 0.21, 2.0])
    thrust = ALL[8].channels({"port": command})["port_thrust"]
    np.testing.assert_allclose(thrust, [-36, -20, 0, 0, 0, 8.4, 36])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({}, "either `gain` or `curve`"),
        ({"gain": 1.0, "curve": [(0, 0), (1, 1)]}, "either `gain` or `curve`"),
        ({"gain": np.inf}, "`gain` must be a finite"),
        ({"gain": 1.0, "direction": (0, 0, 0)}, "`direction` must not be zero"),
        ({"gain": 1.0, "position": (0, 0)}, r"`position` must have shape \(3\)"),
        ({"gain": 1.0, "position": (1, np.inf, 0)}, "`position` must be finite"),
        ({"gain": 1.0, "dead_zone": (0.2, 0.1)}, r"`dead_zone` must be \(lowest, highest\)"),
        ({"curve": [(0, 0)]}, "at least two rows"),
        ({"curve": []}, "`curve` must have"),
        ({"curve": [(1, 0), (0, 1)]}, "increasing commands"),
    ],
)
def test_thruster_refusals(settings, message):
    with pytest.raises(VehicleError, match=message):
        hd.Thruster("bow", **{"position": (0, 0, 0), "direction": (1, 0, 0), **settings})
