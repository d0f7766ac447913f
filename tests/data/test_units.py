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
from table_rows import rows


@rows("quantity, unit, value")
def test_factors_are_those_of_nist(quantity, unit, value):
    """NIST SP 811 (2008), appendix B.8, to the digits printed there."""
    assert unit_factor(unit, quantity) == pytest.approx(value, rel=1e-6)


def test_a_unit_of_another_quantity_is_refused(refused):
    refused(LogError, unit_factor, "deg", "angular rate")


@rows("text, unit")
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


@rows("name, found")
def test_a_name_may_end_in_its_unit(name, found):
    assert trailing_unit(name.split()) == (found and tuple(found))


def test_no_column_stands_twice_and_every_quantity_has_units():
    assert len(set(RESERVED)) == len(RESERVED)
    assert set(QUANTITIES.values()) <= set(UNITS)
