import csv
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Uncertainty
from hydrodamp.identification.grades import Cause, Grade
from hydrodamp.report.fit_tables import fit_table, half_widths
from hydrodamp.report.table import to_text

from .conftest import column


@pytest.fixture
def fit(comparison):
    """The linear model: its coefficients are -1, -2 ..., their standard errors a tenth."""
    damping = comparison.rows[0].fit.damping
    errors = 0.1 * np.abs(damping.coefficients)
    errors[1] = 10.0
    return replace(comparison.rows[0].fit, damping=replace(damping, covariance=np.diag(errors**2)))


def grades(fit, grade, **causes):
    return SimpleNamespace(
        grades=dict.fromkeys(fit.model.labels, grade), causes=causes, summary="linear: as told"
    )


@pytest.mark.parametrize("place", [0, 2, 4])
def test_a_fit_in_text(comparison, place, snapshot):
    """Known to its rank, with aliased groups, and without covariance."""
    assert to_text(fit_table(comparison.rows[place].fit)) == snapshot


@pytest.mark.parametrize("grade", [Grade.MINOR, Grade.DETERMINED])
def test_the_rule_of_grades_stands_below_them(fit, grade, snapshot):
    grid = fit_table(fit, grades(fit, grade))
    assert set(column(grid, "grade")) == {grade.word}
    assert grid.notes[-1] == snapshot


def test_what_is_not_determined_has_a_cause_and_those_it_is_known_with(fit):
    covariance = fit.damping.covariance.copy()
    covariance[2, 0] = covariance[0, 2] = -0.95 * np.sqrt(covariance[0, 0] * covariance[2, 2])
    covariance[3, 4] = covariance[4, 3] = 0.95 * np.sqrt(covariance[3, 3] * covariance[4, 4])
    tied = replace(fit, damping=replace(fit.damping, covariance=covariance))
    found = grades(tied, Grade.NOT_DETERMINED, X_u=Cause.NOT_SIGNIFICANT, X_v=Cause.NOISE)
    grid = fit_table(tied, found)
    words = ("not determined: not significant", "not determined: noise", "not determined")
    assert column(grid, "grade")[:3] == words
    assert grid.notes[-3:-1] == (Cause.NOISE.value, Cause.NOT_SIGNIFICANT.value)
    assert grid.notes[-1].endswith("in combination: X_u with X_w (-0.95).")


def test_intervals_use_the_degrees_of_freedom_there_are(fit):
    known = replace(fit, uncertainty=Uncertainty(fit.damping.covariance, 5.0, "by hand"))
    assert half_widths(fit)[0] == pytest.approx(0.196, abs=1e-4)
    assert half_widths(known)[0] == pytest.approx(0.2571, abs=1e-4)


def test_coefficients_are_written_in_each_form(comparison, fit, refused):
    assert hd.format_coefficients(fit) == to_text(fit_table(fit))
    refused(MethodError, hd.format_coefficients, fit, "html")
    rows = [*csv.DictReader(hd.format_coefficients(comparison, "csv").splitlines())]
    for row in comparison.rows:
        name, values = f"{row.model} {row.method}", row.fit.damping.as_dict()
        if row.fit.status.usable:
            halves = dict(zip(values, half_widths(row.fit), strict=True))
            found = {each["coefficient"]: each for each in rows if each[name]}
            assert {key: float(each[name]) for key, each in found.items()} == values
            for key, half in halves.items():
                assert found[key][f"{name} ±"] == str(half)
