import numpy as np
import pytest
import yaml

from hydrodamp.errors import VehicleError
from hydrodamp.vehicle.file import parse_vehicle
from hydrodamp.vehicle.template import vehicle_template
from hydrodamp.vehicle.vehicle import Vehicle, without_righting
from table_rows import rows


def test_empty_template_names_every_number_to_fill_in(refused):
    refused(VehicleError, lambda: parse_vehicle(vehicle_template()))


def test_estimate_is_the_hull_estimate():
    vehicle = parse_vehicle(vehicle_template("mine", length=1.33, diameter=0.19, mass=30.5))
    hull = Vehicle.from_hull(1.33, 0.19, 30.5)
    np.testing.assert_allclose(vehicle.mass_matrix, hull.mass_matrix, rtol=1e-5)
    assert vehicle.name == "mine"
    assert "estimate" in vehicle.source


@pytest.mark.parametrize("name", ["a: b", "yes", "#1", 'quo"te', "ä"])
def test_any_name_survives(name):
    assert yaml.safe_load(vehicle_template(name))["name"] == name


def test_examples_in_the_comments_are_valid():
    lines = vehicle_template(length=1, diameter=0.2, mass=30).splitlines()
    examples = [line.lstrip("# ") for line in lines if line.startswith("#   - ")]
    text = vehicle_template(length=1, diameter=0.2, mass=30)
    filled = text.replace("actuators: []", "actuators:\n" + "\n".join(f"  {e}" for e in examples))
    assert parse_vehicle(filled).commands == ("rudder", "rpm", "port", "m1", "ch_forward")


@rows("axes, sizes")
def test_sizes_in_other_units_are_refused(axes, sizes, refused):
    """A hull of 2 m by 0.19 m displaces 39 kg as a spheroid and 58 kg as a cylinder."""
    refused(VehicleError, vehicle_template, "mine", axes, **sizes)


def test_a_boat_may_weigh_less_than_a_submerged_hull():
    boat = parse_vehicle(vehicle_template("boat", "XYN", length=1.2, diameter=0.3, mass=17.0))
    assert boat.mass_matrix[1, 1] > 17.0


def test_an_estimate_says_that_nothing_rights_it():
    """Length, diameter and mass say nothing of the metacentric height."""
    text = vehicle_template("mine", length=1.33, diameter=0.19, mass=30.5)
    assert without_righting(parse_vehicle(text))
    assert "metacentric height" in text
    righted = text.replace("center_of_gravity: [0, 0, 0]", "center_of_gravity: [0, 0, 0.004]")
    assert without_righting(parse_vehicle(righted)) == ""
