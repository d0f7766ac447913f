import pytest

from hydrodamp.data.channels import (
    QUANTITIES,
    RESERVED,
    UNITS,
    is_unit,
    parse_unit,
    trailing_unit,
    unit_factor,
)
from hydrodamp.errors import LogError

# NIST SP 811 (2008), appendix B.8, to the digits printed there.
NIST = {
    ("speed", "knots"): 5.144444e-1,
    ("speed", "km/h"): 2.777778e-1,
    ("speed", "ft/s"): 3.048e-1,
    ("angle", "deg"): 1.745329e-2,
    ("angular rate", "rpm"): 1.047198e-1,
    ("force", "lbf"): 4.448222,
    ("force", "kgf"): 9.80665,
    ("moment", "lbf ft"): 1.355818,
}


@pytest.mark.parametrize(("place", "value"), NIST.items(), ids=lambda item: str(item))
def test_factors_are_those_of_nist(place, value):
    assert unit_factor(place[1], place[0]) == pytest.approx(value, rel=1e-6)


def test_a_unit_of_another_quantity_is_refused(refused):
    refused(LogError, unit_factor, "deg", "angular rate")


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        *[("kts", "kn"), ("KM/H", "km/h"), ("CM/S", "cm/s"), ("m/sec", "m/s"), ("mps", "m/s")],
        *[("msec", "ms"), ("usec", "us"), ("µs", "us"), ("μs", "us"), ("Seconds", "s")],
        *[("°/s", "deg/s"), ("Degrees per second", "deg/s"), ("dps", "deg/s"), ("1/min", "rpm")],
        *[("m/s/s", "m/s^2"), ("m/s²", "m/s^2"), ("m/s2", "m/s^2"), ("[N·m]", "N m")],
        *[("volt", None), ("raw", None), ("S", None), ("", None)],
    ],
)
def test_units_are_known_in_the_spellings_of_files(text, unit):
    assert parse_unit(text) == unit
    assert is_unit(text) == (unit is not None or text in ("volt", "raw"))


def test_the_quantity_decides_between_units_that_differ_by_their_case_alone():
    assert parse_unit("KN", "speed") == "kn"
    assert parse_unit("KN", "force") == "kN"
    assert unit_factor("KTS", "speed") == UNITS["speed"]["kn"]


@pytest.mark.parametrize("word", ["u", "r", "1", "7", "t", "N2"])
def test_names_and_numbers_are_no_units(word):
    assert not is_unit(word)


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("gyro z rad s", (2, "rad/s")),
        ("gyro rads", (1, "rad/s")),
        ("accel x m s2", (2, "m/s^2")),
        ("speed knots", (1, "knots")),
        ("speed min", None),
        ("depth", None),
        ("m", None),
    ],
)
def test_a_name_may_end_in_its_unit(name, found):
    assert trailing_unit(name.split()) == found


def test_no_column_stands_twice_and_every_quantity_has_units():
    assert len(set(RESERVED)) == len(RESERVED)
    assert set(QUANTITIES.values()) <= set(UNITS)
