"""How well a coefficient is known, in words."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hydrodamp.identification.fit import Fit
from hydrodamp.identification.grades import Grade
from hydrodamp.identification.intervals import Uncertainty
from hydrodamp.report.fit_grid import fit_grid
from hydrodamp.report.known import LITTLE_MEANING, how_known, reach_of
from hydrodamp.validation.comparison import Comparison


@pytest.fixture
def fit(comparison: Comparison) -> Fit:
    """The linear model: its coefficients are -1, -2 ..., their standard errors a tenth."""
    damping = comparison.rows[0].fit.damping
    errors = 0.1 * np.abs(damping.coefficients)
    errors[1] = 10.0
    return replace(comparison.rows[0].fit, damping=replace(damping, covariance=np.diag(errors**2)))


def grades(fit: Fit, grade: Grade) -> Any:
    return SimpleNamespace(grades=dict.fromkeys(fit.model.labels, grade))


def test_a_determined_number_is_within_a_quarter_of_itself(fit: Fit) -> None:
    heading, known = how_known(fit, grades(fit, Grade.DETERMINED))
    assert heading == "grade"
    assert [known[label] for label in fit.model.labels[:3]] == [
        "determined",
        "matters little",
        "determined",
    ]


def test_other_grades_stand_as_they_are(fit: Fit) -> None:
    assert set(how_known(fit, grades(fit, Grade.WEAK))[1].values()) == {"weak"}


def test_the_table_has_the_grades_and_says_what_matters_little_means(fit: Fit) -> None:
    grid = fit_grid(fit, grades(fit, Grade.DETERMINED))
    assert grid.header[-1] == "grade"
    assert grid.rows[1][-1] == "matters little"
    assert grid.notes[-1] == LITTLE_MEANING
    assert LITTLE_MEANING not in fit_grid(fit, grades(fit, Grade.WEAK)).notes


def test_without_standard_errors_nothing_is_wide(fit: Fit) -> None:
    bare = replace(fit, damping=replace(fit.damping, covariance=None))
    assert set(how_known(bare, grades(fit, Grade.DETERMINED))[1].values()) == {"determined"}


def test_intervals_use_the_degrees_of_freedom_there_are(fit: Fit) -> None:
    known = replace(fit, uncertainty=Uncertainty(fit.damping.covariance, 5.0, "by hand"))
    assert reach_of(fit) == pytest.approx(1.96, abs=1e-3)
    assert reach_of(known) == pytest.approx(2.571, abs=1e-3)
