from __future__ import annotations

import pytest

from hydrodamp.data.channels import BLOCKS, QUANTITIES, RESERVED, unit_of
from hydrodamp.data.log import Log
from hydrodamp.data.units import UNITS


def test_every_block_is_an_attribute_of_a_log() -> None:
    given = Log(time=[0.0, 1.0], velocity=[[0.0] * 6] * 2)
    assert all(hasattr(given, block.name) for block in BLOCKS)


def test_no_column_stands_twice_and_every_quantity_has_units() -> None:
    assert len(set(RESERVED)) == len(RESERVED)
    assert set(QUANTITIES.values()) <= set(UNITS)


@pytest.mark.parametrize(
    ("column", "unit"),
    [("time", "s"), ("r", "rad/s"), ("dw", "m/s^2"), ("fx", "m/s^2"), ("eta", "1"), ("K", "N m")],
)
def test_columns_are_in_si_units(column: str, unit: str) -> None:
    assert unit_of(column) == unit
