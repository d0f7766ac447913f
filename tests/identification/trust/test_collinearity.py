"""Condition, inflation and groups against their definitions."""

from __future__ import annotations

import numpy as np
import pytest

from hydrodamp.identification.trust.collinearity import HIGH, collinearity


def test_orthogonal_columns_inflate_nothing():
    found = collinearity(np.diag([1.0, 1e3, 1e-6]), "abc")
    np.testing.assert_allclose(found.inflation, 1.0, rtol=1e-12)
    assert found.condition == pytest.approx(1.0)
    assert (found.groups, found.span.rank) == ((), 3)


def test_inflation_is_what_the_other_columns_explain():
    """1 / (1 - R²) of a column on the others, uncentred."""
    rng = np.random.default_rng(0)
    design = rng.normal(size=(50, 4)) + 1.0
    for column, inflation in enumerate(collinearity(design, "abcd").inflation):
        others = np.delete(design, column, axis=1)
        own = design[:, column]
        left = own - others @ np.linalg.lstsq(others, own, rcond=None)[0]
        assert inflation == pytest.approx(own @ own / (left @ left), rel=1e-9)


def test_condition_is_that_of_unit_columns():
    design = np.random.default_rng(1).normal(size=(30, 3)) * [1.0, 1e4, 1e-4]
    unit = design / np.linalg.norm(design, axis=0)
    assert collinearity(design, "abc").condition == pytest.approx(np.linalg.cond(unit), rel=1e-9)


def test_two_near_dependencies_are_two_groups():
    rng = np.random.default_rng(2)
    a, b, c = rng.normal(size=(3, 200))
    noise = 1e-3 * rng.normal(size=(2, 200))
    found = collinearity(np.column_stack([a, b, a + noise[0], b + noise[1], c]), "abxyc")
    assert found.condition > HIGH
    assert sorted(found.groups) == [("a", "x"), ("b", "y")]
    assert found.inflation[4] < 1.2


def test_exact_aliases_come_first_and_have_no_finite_inflation():
    rng = np.random.default_rng(3)
    a, b = rng.normal(size=(2, 100))
    design = np.column_stack([a, 2 * a, np.zeros(100), b, b + 1e-3 * rng.normal(size=100)])
    found = collinearity(design, "apzbq")
    assert found.groups == (("a", "p"), ("z",), ("b", "q"))
    assert found.condition == np.inf
    np.testing.assert_array_equal(np.isinf(found.inflation), [True, True, True, False, False])
    np.testing.assert_array_equal(found.aliased, [True, True, True, False, False])


@pytest.mark.parametrize("columns", [0, 2])
def test_nothing_to_examine(columns):
    found = collinearity(np.zeros((5, columns)), "ab"[:columns])
    assert found.span.rank == 0
    assert len(found.groups) == columns
