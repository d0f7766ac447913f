from __future__ import annotations

import numpy as np
import pytest

from hydrodamp.vehicle.fleet import NAMES, fleet, without_righting
from hydrodamp.vehicle.vehicle import Vehicle

HEELED = np.array([[0.0, np.sin(0.1), np.cos(0.1)]])


def cube(gravity: float = 0.0, lift: float = 0.0, weight: float = 10.0, **more) -> Vehicle:
    centers = {"center_of_gravity": (0, 0, gravity), "center_of_buoyancy": (0, 0, lift)}
    return Vehicle("cube", np.eye(6), weight, weight, **centers, **more)


CENTERS = [
    *((0.01, 0.0, 10.0), (0.0, -0.01, 10.0), (0.0, 0.0, 10.0)),
    *((0.2, 0.2, 10.0), (-0.01, 0.0, 10.0), (0.1, 0.0, 0.0)),
]


@pytest.mark.parametrize(("gravity", "lift", "weight"), CENTERS)
def test_it_is_told_where_heeled_the_moment_turns_it_no_way_back(gravity, lift, weight):
    vehicle = cube(gravity, lift, weight)
    righted = vehicle.restoring_wrench(HEELED)[0, 3] < 0.0
    assert bool(without_righting(vehicle)) is not righted


@pytest.mark.parametrize(
    ("axes", "words"),
    [
        (("X", "Y", "N"), ""),
        (("X", "Y", "K", "N"), "in roll:"),
        (("X", "Z", "M"), "in pitch:"),
        (("X", "Y", "Z", "K", "M", "N"), "in roll and pitch:"),
    ],
)
def test_only_free_axes_count(axes, words):
    told = without_righting(cube(axes=axes))
    assert words in told
    assert bool(told) is bool(words)
    for axis, term in (("K", "K: down_y"), ("M", "M: down_x")):
        assert (term in told) is (bool(told) and axis in axes)


@pytest.mark.parametrize("name", NAMES)
def test_the_fleet_rights_itself(name):
    assert without_righting(fleet[name]) == ""
