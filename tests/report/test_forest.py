"""Forest plot: one scale for each coefficient, with zero, values and intervals."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.report.forest import forest_rows, tick_values
from hydrodamp.report.table import format_interval
from table_rows import rows

MODEL = hd.DampingModel.from_table({"X": "u v r", "Y": "v"}, key="mine")


def make_fit(values, deviations, model=MODEL):
    covariance = np.diag(np.square(deviations))
    return hd.Fit(hd.Damping(model, values, covariance), "ls", hd.Status.OK)


def test_a_scale_is_linear_and_has_zero_values_and_intervals():
    """-10 ± 1.96 and 30 ± 3.92: margins of 3.92 and 5 % of the span of 40."""
    other = replace(MODEL, key="other")
    rows = forest_rows([make_fit([-10.0, 1, 1, 1], [1.0] * 4),
                        make_fit([30.0, 1, 1, 1], [2.0] * 4, other)])  # fmt: skip
    low, high = -10.0 - 3.92 - 2.0, 30.0 + 3.92 + 2.0
    scale = 100.0 / (high - low)
    (first, second), zero = rows[0].marks, rows[0].zero
    assert zero == pytest.approx(-low * scale, abs=0.006)
    assert first.value == pytest.approx((-10.0 - low) * scale, abs=0.006)
    ends = (26.08 - low) * scale, (33.92 - low) * scale
    assert second.interval == pytest.approx(ends, abs=0.006)
    assert (first.text, first.is_cut) == ("-10.0 ± 2.0", (False, False))
    assert (rows[0].label, rows[0].unit) == ("X_u", "N/(m/s)")


def test_long_intervals_are_cut_and_unknown_ones_are_not_drawn():
    (long, _, unknown, _) = forest_rows([make_fit([1.0, 1, 1, 1], [50.0, 1, np.nan, 1])])
    assert long.marks[0].is_cut == (True, True)
    assert long.marks[0].interval == (0.0, 100.0)
    assert unknown.marks[0].interval is None
    (flat, *_) = forest_rows([make_fit([0.0, 0, 0, 0], [0.0] * 4)])
    assert flat.marks[0].value == flat.zero == pytest.approx(50.0)


def test_shared_coefficients_come_with_the_determined_ones_first():
    small = hd.DampingModel.from_table({"X": "v r"}, key="small")
    first = make_fit([1.0, 2, 3, 4], [1.0] * 4)
    first = replace(first, grades={"X_u": hd.Grade.DETERMINED, "X_r": hd.Grade.WEAK})
    rows = forest_rows([first, make_fit([2.0, 3.0], [1.0, 1.0], small)])
    assert [row.label for row in rows] == ["X_r", "X_v"]
    assert forest_rows([first])[0].label == "X_u"


def test_one_distant_value_does_not_squeeze_the_others_and_the_true_value_is_drawn():
    """A value of 900 beside -10, 12 and 11 is an arrow; 14 is the true one."""
    fits = [make_fit([value, 1, 1, 1], [0.5] * 4) for value in (-10.0, 12.0, 11.0, 900.0)]
    row = forest_rows(fits, {"X_u": 14.0})[0]
    near, distant = row.marks[:3], row.marks[3]
    assert max(mark.value for mark in near) - min(mark.value for mark in near) > 70.0
    assert (distant.value, distant.is_cut) == (None, (False, True))
    low, high = -10.0 - 0.98 - 0.05 * 24.0, 14.0 + 0.98 + 0.05 * 24.0
    assert row.truth == pytest.approx(100.0 * (14.0 - low) / (high - low), abs=0.006)
    assert row.description.endswith("; true value: 14")


@rows(("low", "high", "expected"))
def test_ticks_are_multiples_of_1_2_or_5_with_zero(low, high, expected):
    assert tick_values(low, high) == pytest.approx(expected)


@rows(("value", "half", "text"))
def test_half_widths_have_two_significant_digits(value, half, text):
    assert format_interval(value, half) == text
