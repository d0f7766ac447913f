from __future__ import annotations

import pytest

from hydrodamp.errors import VehicleError
from hydrodamp.vehicle.checks import (
    check_command,
    checked_actuators,
    checked_array,
    checked_axes,
    checked_force,
    checked_gains,
    checked_name,
    checked_number,
    checked_table,
)
from hydrodamp.vehicle.fin import Fin


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: checked_name("uv", "command"), "`command`.*`uv` reads as the product"),
        (lambda: checked_name("2nd", "name"), "`name`.*letters, digits"),
        (lambda: checked_number(float("nan"), "gain"), "`gain` must be a finite number; got nan"),
        (lambda: checked_number(0.0, "limit", positive=True), "`limit` must be a positive number"),
        (lambda: checked_gains({"Q": 1.0}, "force"), "`force` must name axes of X Y Z K M N"),
        (lambda: checked_gains({"Y": float("inf")}, "force"), "`force Y` must be a finite"),
        (lambda: checked_table([1, 2], (3,), "position"), r"`position` must have shape \(3\)"),
        (lambda: checked_array([1, float("inf")], (2,), "position"), "`position` must be finite"),
        (lambda: check_command("rudder", "r", None), "`name`.*reserved"),
        (lambda: check_command("rudder", "", -0.3), "`limit` must be a positive"),
        (lambda: checked_force(-1.0, "buoyancy"), "`buoyancy` must be zero or positive"),
        (lambda: checked_axes(("Y", "X")), "in this order; got Y X"),
        (lambda: checked_axes(("X", "X")), "in this order; got X X"),
        (lambda: checked_axes(("X", "U")), "got X U"),
        (lambda: checked_axes(()), "got none"),
    ],
)
def test_refusals_say_what_is_wanted(call, message):
    with pytest.raises(VehicleError, match=message):
        call()


def test_derived_channels_must_not_collide():
    rudder = Fin("rudder", {"Y": 1.0}, limit=0.3)
    with pytest.raises(VehicleError, match="`rudder_limited` has the name of another actuator"):
        checked_actuators((rudder, rudder))
    with pytest.raises(VehicleError, match="`rudder_limited` has the name of a command"):
        checked_actuators((rudder, Fin("rudder_limited", {"Y": 1.0})))
    upper = Fin("rudder", {"Y": 1.0}, limit=0.3, name="upper")
    assert checked_actuators((rudder, upper)) == (rudder, upper)


def test_gains_come_in_axis_order():
    assert checked_gains((("N", 1), ("X", 2)), "force") == (("X", 2.0), ("N", 1.0))
