import json
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.cli.vehicle import NO_ACTUATORS, add_actuators
from hydrodamp.errors import VehicleError
from hydrodamp.vehicle.file import fleet, parse_vehicle, read_vehicle
from table_rows import rows

SIZES = "--length 1.6 --diameter 0.19 --mass 40"


@rows(("axes", "sizes"))
def test_a_vehicle_is_complete_with_its_main_dimensions(folder, call, axes, sizes):
    """None of them has a righting moment."""
    done = call(f"vehicle new mine.yaml {sizes} --json")
    assert json.loads(done.stdout) == {"path": "mine.yaml", "complete": True}
    vehicle = read_vehicle(folder / "mine.yaml")
    assert (vehicle.name, vehicle.axes) == ("mine", tuple(axes))
    assert not vehicle.restoring_matrix[3:].any()


def test_a_vehicle_of_the_fleet_can_be_started_from(folder, call):
    call("vehicle new mine.yaml --like bluerov2")
    assert read_vehicle(folder / "mine.yaml") == replace(fleet["bluerov2"], name="mine")
    assert "actuators: []" in (folder / "mine.yaml").read_text("utf-8")
    call("vehicle new flat.yaml --like kvlcc2 --axes X,N")
    assert read_vehicle(folder / "flat.yaml").axes == ("X", "N")


def test_gains_of_actuators_come_from_a_log(folder, refused):
    """The simulated vehicle has 10 N per unit of ahead, and 4 N m per unit of turn."""
    text = (folder / "planar.yaml").read_text("utf-8").partition("actuators:")[0]
    log = hd.read_log("ab.csv")
    known = add_actuators(f"{text}{NO_ACTUATORS}\n", log)
    wrenches = {item.commands[0]: item.wrench[0] for item in parse_vehicle(known).actuators}
    assert wrenches["ahead"][0] == pytest.approx(10.0, rel=0.02)
    assert wrenches["turn"][5] == pytest.approx(4.0, rel=0.05)
    refused(VehicleError, add_actuators, (folder / "planar.yaml").read_text("utf-8"), log)
    still = replace(log, commands=np.zeros_like(log.commands))
    refused(VehicleError, add_actuators, f"{text}{NO_ACTUATORS}\n", still)


def test_the_free_axes_can_be_stated(folder, call):
    done = call(f"vehicle new boat.yaml {SIZES} --axes X,Y,N --json")
    assert json.loads(done.stdout)["complete"]
    boat, whole = read_vehicle(folder / "boat.yaml"), hd.Vehicle.from_hull(1.6, 0.19, 40.0)
    assert boat.axes == ("X", "Y", "N")
    free = np.ix_((0, 1, 5), (0, 1, 5))
    np.testing.assert_allclose(boat.mass_matrix[free], whole.mass_matrix[free], rtol=1e-4)
    text = (folder / "boat.yaml").read_text("utf-8")
    assert "inertia: [null, null, " in text
    assert "\nweight:  #" in text
