import json
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.cli.vehicle import NO_ACTUATORS, add_actuators
from hydrodamp.errors import VehicleError
from hydrodamp.vehicle.file import fleet, parse_vehicle, read_vehicle

SIZES = "--length 1.6 --diameter 0.19 --mass 40"


def test_an_estimate_can_be_used_as_it_is(folder, call):
    done = call(f"vehicle new mine.yaml {SIZES} --json")
    assert json.loads(done.stdout) == {"path": "mine.yaml", "complete": True}
    assert read_vehicle(folder / "mine.yaml").name == "mine"


def test_an_estimate_says_that_nothing_rights_it(folder, call):
    told = call(f"vehicle new mine.yaml {SIZES}").stderr
    assert "no restoring moment" in " ".join(told.split())
    assert not read_vehicle(folder / "mine.yaml").restoring_matrix[3:].any()
    assert "ready to use" in call("vehicle new like.yaml --like bluerov2").stderr


def test_a_vehicle_of_the_fleet_can_be_started_from(folder, call):
    call("vehicle new mine.yaml --like bluerov2")
    assert read_vehicle(folder / "mine.yaml") == replace(fleet["bluerov2"], name="mine")
    assert "actuators: []" in (folder / "mine.yaml").read_text("utf-8")


def test_gains_of_actuators_come_from_a_log(folder):
    """The simulated vehicle has 10 N per unit of ahead, and 4 N m per unit of turn."""
    text = (folder / "planar.yaml").read_text("utf-8").partition("actuators:")[0]
    log = hd.read_log("ab.csv")
    known = add_actuators(f"{text}{NO_ACTUATORS}\n", log)
    wrenches = {item.commands[0]: item.wrench[0] for item in parse_vehicle(known).actuators}
    assert wrenches["ahead"][0] == pytest.approx(10.0, rel=0.02)
    assert wrenches["turn"][5] == pytest.approx(4.0, rel=0.05)
    with pytest.raises(VehicleError, match="this vehicle has some"):
        add_actuators((folder / "planar.yaml").read_text("utf-8"), log)
    still = replace(log, commands=np.zeros_like(log.commands))
    with pytest.raises(VehicleError, match="no command moves the vehicle"):
        add_actuators(f"{text}{NO_ACTUATORS}\n", still)


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


@pytest.mark.parametrize(
    ("kind", "sizes"),
    [
        ("boat", "--length 1.2 --beam 0.3 --draft 0.1 --mass 17"),
        ("catamaran", "--length 2 --beam 1.08 --draft 0.134 --mass 55"),
        ("ship", "--length 161 --beam 23.2 --draft 8.23 --block-coefficient 0.6"),
    ],
)
def test_a_surface_craft_is_ready_from_its_main_dimensions(folder, call, kind, sizes):
    assert "ready to use" in call(f"vehicle new mine.yaml --kind {kind} {sizes}").stderr
    assert read_vehicle(folder / "mine.yaml").axes == ("X", "Y", "N")
