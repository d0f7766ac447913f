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


def test_coefficients_stand_with_error_interval_and_unit(comparison):
    grid = fit_table(comparison.rows[0].fit)
    assert grid.title == "Linear by ls: 36 coefficients, rank 36, 1200 samples"
    assert grid.words[3] == ["X_p", "-4", "2", "3.92", "N/(rad/s)", "no"]
    assert grid.header[-2:] == ("unit", "aliased")


def test_aliased_groups_are_named(comparison):
    grid = fit_table(comparison.rows[2].fit)
    aliased = dict(zip(column(grid, "coefficient"), column(grid, "aliased"), strict=True))
    assert (aliased["X_u^2"], aliased["Y_v|v|"]) == ("yes", "no")
    assert "aliased, only a combination is determined: X_u X_u^2" in grid.notes
    assert any(note.startswith("K_p is not determined") for note in grid.notes)


def test_without_covariance_there_is_no_error(comparison):
    grid = fit_table(comparison.rows[4].fit)
    assert set(column(grid, "std. error")) == {"-"}
    assert "rank" not in grid.title
    assert "aliased" not in grid.header  # a method without ranks cannot know


def test_the_rule_of_grades_stands_below_them(fit):
    grid = fit_table(fit, grades(fit, Grade.MINOR))
    assert set(column(grid, "grade")) == {"minor"}
    assert grid.notes[-1].startswith("grade: by the interval")
    assert "Minor, its uncertainty is below 5 %" in grid.notes[-1]
    assert "etermined" not in grid.notes[-1]  # no coefficient is
    determined = fit_table(fit, grades(fit, Grade.DETERMINED)).notes[-1]
    assert "Determined, interval within 25 % of the value" in determined


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


def test_coefficients_are_written_in_each_form(comparison, fit):
    latex = hd.format_coefficients(fit, "latex")
    assert r"\toprule" in latex
    assert r"X\_u & -1 & 0.1 & 0.196 & N/(m/s)" in latex
    assert hd.format_coefficients(fit) == to_text(fit_table(fit))
    with pytest.raises(MethodError, match="`form` must be text or markdown or latex or csv"):
        hd.format_coefficients(fit, "html")
    rows = [*csv.DictReader(hd.format_coefficients(comparison, "csv").splitlines())]
    for row in comparison.rows:
        name, values = f"{row.model} {row.method}", row.fit.damping.as_dict()
        if row.fit.status.usable:
            halves = dict(zip(values, half_widths(row.fit), strict=True))
            found = {each["coefficient"]: each for each in rows if each[name]}
            assert {key: float(each[name]) for key, each in found.items()} == values
            for key, half in halves.items():
                assert found[key][f"{name} ±"] == str(half)
