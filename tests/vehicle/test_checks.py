"""What a vehicle and its actuators refuse at the door."""

from __future__ import annotations

import numpy as np
import pytest

from hydrodamp.errors import VehicleError
from hydrodamp.vehicle.actuators import Fin, Propeller, Thruster
from hydrodamp.vehicle.vehicle import Vehicle

INFINITE = float("inf")


def vehicle(**given):
    return Vehicle(**{"name": "a", "mass_matrix": np.eye(6), "weight": 1, "buoyancy": 1, **given})


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Fin("uv", {"Y": 1.0}), "`command`.*`uv` reads as the product"),
        (lambda: Fin("rudder", {"Y": 1.0}, name="2nd"), "`name`.*letters, digits"),
        (lambda: Fin("rudder", {"Y": 1.0}, name="r"), "`name`.*reserved"),
        (lambda: Propeller("rpm", float("nan")), "`thrust` must be a finite number; got nan"),
        (lambda: Fin("rudder", {"Y": 1.0}, limit=0.0), "`limit` must be a positive number"),
        (lambda: Fin("rudder", {"Q": 1.0}), "`force` must name axes of X Y Z K M N"),
        (lambda: Fin("rudder", {"Y": INFINITE}), "`force Y` must be a finite"),
        (lambda: Thruster("t", [1, 2], (1, 0, 0), 1), r"`position` must have shape \(3\)"),
        (lambda: Thruster("t", (1, INFINITE, 0), (1, 0, 0), 1), "`position` must be finite"),
        (lambda: vehicle(buoyancy=-1.0), "`buoyancy` must be zero or positive"),
        (lambda: vehicle(axes=("Y", "X")), "in this order; got Y X"),
        (lambda: vehicle(axes=("X", "X")), "in this order; got X X"),
        (lambda: vehicle(axes=("X", "U")), "got X U"),
        (lambda: vehicle(axes=()), "got none"),
    ],
)
def test_refusals_say_what_is_wanted(call, message):
    with pytest.raises(VehicleError, match=message):
        call()


def test_derived_channels_must_not_collide():
    rudder = Fin("rudder", {"Y": 1.0}, limit=0.3)
    with pytest.raises(VehicleError, match="`rudder_limited` has the name of another actuator"):
        vehicle(actuators=(rudder, rudder))
    with pytest.raises(VehicleError, match="`rudder_limited` has the name of a command"):
        vehicle(actuators=(rudder, Fin("rudder_limited", {"Y": 1.0})))
    upper = Fin("rudder", {"Y": 1.0}, limit=0.3, name="upper")
    assert vehicle(actuators=(rudder, upper)).actuators == (rudder, upper)


def test_gains_come_in_axis_order():
    assert Fin("rudder", (("N", 1), ("X", 2))).force == (("X", 2.0), ("N", 1.0))
