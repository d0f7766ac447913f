from __future__ import annotations

from dataclasses import replace

from hydrodamp.report.fit_grid import LISTED, fit_grid
from hydrodamp.validation.comparison import Comparison


def test_coefficients_stand_with_error_and_unit(comparison: Comparison) -> None:
    grid = fit_grid(comparison.rows[0].fit)
    assert grid.title == "Linear by ls: 36 coefficients, rank 36, 1200 samples"
    assert grid.rows[3] == ("X_p", "-4", "2", "N/(rad/s)", "yes")


def test_aliased_groups_are_named(comparison: Comparison) -> None:
    grid = fit_grid(comparison.rows[2].fit)
    assert dict(zip(grid.column("coefficient"), grid.column("told apart"), strict=True))[
        "X_u^2"
    ] == ("no")
    assert "X_u X_u^2 are known only together" in grid.notes
    assert "K_p is zero throughout or determined by nothing" in grid.notes


def test_without_covariance_there_is_no_error(comparison: Comparison) -> None:
    grid = fit_grid(comparison.rows[4].fit)
    assert set(grid.column("std. error")) == {"-"}
    assert "rank" not in grid.title
    assert "told apart" not in grid.header  # a method without ranks cannot know


def test_many_groups_are_counted(comparison: Comparison) -> None:
    fit = comparison.rows[0].fit
    many = replace(fit, aliased=tuple((label,) for label in fit.model.labels))
    assert fit_grid(many).notes[-1] == f"and {36 - LISTED} more such groups"
