"""Standard deviations and origins of the values of a vehicle file."""

import numpy as np
import yaml

import hydrodamp as hd
from hydrodamp.errors import VehicleError
from hydrodamp.vehicle.file import fleet_text, format_vehicle, parse_vehicle
from hydrodamp.vehicle.priors import HULL_STD
from hydrodamp.vehicle.template import vehicle_template
from table_rows import rows

#: Length and diameter of the fleet [m], a BlueROV2 by its frame.
SIZES = {
    "bluerov2": (0.457, 0.338),
    "bluerov2-heavy": (0.457, 0.4),
    "lauv": (1.08, 0.15),
    "remus100": (1.33, 0.19),
    "vt690": (2.2, 0.175),
}


def with_lines(**lines):
    return yaml.safe_dump(yaml.safe_load(fleet_text("lauv")) | lines)


@rows("given, name, std")
def test_a_std_is_given_once_or_by_component_and_survives(given, name, std):
    vehicle = parse_vehicle(with_lines(std={name: given}, origin={name: "measured"}))
    assert vehicle.std == {name: tuple(std)}
    again = parse_vehicle(format_vehicle(vehicle))
    assert again == vehicle
    assert again.origin == {name: "measured"}


@rows("lines")
def test_a_wrong_std_or_origin_is_refused_with_its_key(lines, refused):
    refused(VehicleError, lambda: parse_vehicle(with_lines(**lines)))


def test_the_std_of_added_mass_needs_added_mass(refused):
    refused(
        VehicleError, lambda: hd.Vehicle("cube", np.eye(6), 10.0, 10.0, std={"added_mass": 0.5})
    )


def test_published_vehicles_are_exact_and_drafts_are_not():
    assert not any(vehicle.std for vehicle in hd.fleet.values())
    drafted = parse_vehicle(vehicle_template("mine", length=1.33, diameter=0.19, mass=30.5))
    hull = hd.Vehicle.from_hull(1.33, 0.19, 30.5)
    assert drafted.std == hull.std == {"added_mass": HULL_STD, "buoyancy": (0.02,)}
    assert drafted.origin == hull.origin == {"added_mass": "formula", "buoyancy": "assumed"}
    assert "buoyancy" not in hd.Vehicle.from_hull(1.33, 0.19, 30.5, buoyancy=299.0).std


def test_the_std_of_a_hull_is_the_spread_of_the_fleet_about_the_formula():
    logarithms = []
    for name, (length, diameter) in SIZES.items():
        known = hd.fleet[name]
        mass = known.weight / 9.80665
        hull = hd.Vehicle.from_hull(length, diameter, mass, buoyancy=known.buoyancy)
        logarithms.append(np.log(known.added_mass.diagonal() / hull.added_mass.diagonal()))
    spread = np.sqrt(np.mean(np.square(logarithms), axis=0))
    np.testing.assert_allclose(spread, HULL_STD, atol=0.06)
