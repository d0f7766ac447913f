from __future__ import annotations

import numpy as np

from hydrodamp.vehicle.vehicle import Vehicle


def test_one_screen_with_everything(equipped):
    text = str(equipped)
    assert len(text.splitlines()) <= 25
    for word in ("equipped", "100", "104", "fin on rudder", "propeller on rpm", "made up"):
        assert word in text


def test_locked_axes_are_left_out():
    ship = Vehicle("ship", np.diag([2.0, 3.0, 4.0]), 0.0, 0.0, axes=("X", "Y", "N"))
    lines = str(ship).splitlines()
    assert [line.split()[0] for line in lines[5:8]] == ["X", "Y", "N"]
    assert lines[-1] == "no known actuators"
