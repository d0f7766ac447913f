"""The rule that grades a coefficient, case by case."""

from __future__ import annotations

import numpy as np
import pytest

from hydrodamp.identification.trust.grades import Evidence, Grade

CLEAR = {"coefficient": 10.0, "half": 1.0, "size": 1.0, "sound": 1.0, "aliased": False}


def grade(*, response: float = 10.0, excited: bool = True, **more: float) -> Grade:
    values = {key: np.array([value]) for key, value in {**CLEAR, **more}.items()}
    return Evidence(**values, response=response, excited=excited).grades()[0]


def test_a_narrow_interval_determines():
    assert grade() is Grade.DETERMINED
    assert grade(half=2.4) is Grade.DETERMINED
    assert grade(half=2.6) is Grade.WEAK


def test_a_zero_that_is_known_well_is_determined():
    """|t| = 0, but it can contribute at most 4 % of the response."""
    assert grade(coefficient=0.0, half=0.4) is Grade.DETERMINED
    assert grade(coefficient=0.0, half=0.6) is Grade.WEAK


def test_an_interval_worth_half_the_response_tells_nothing():
    assert grade(coefficient=8.0, half=4.9) is Grade.WEAK
    assert grade(coefficient=8.0, half=5.1) is Grade.NOT_DETERMINED


def test_a_small_part_of_a_large_coefficient_is_little_even_if_worth_much():
    """Two terms that cancel: each is known to 20 %."""
    assert grade(coefficient=100.0, half=20.0) is Grade.DETERMINED


@pytest.mark.parametrize(
    "fault",
    [
        {"aliased": True},
        {"size": 0.0},
        {"half": np.inf},
        {"half": np.nan},
        {"sound": 0.4},
        {"excited": False},
    ],
)
def test_what_no_interval_can_mend(fault):
    assert grade(**fault) is Grade.NOT_DETERMINED
