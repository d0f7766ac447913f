"""Grades: of the rule, of campaigns, of fits, and of a field log."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.identification.adequacy import Adequacy, ScoreTest
from hydrodamp.identification.grades import Cause, grade_coefficients
from hydrodamp.identification.identifiability import (
    analyse_excitation,
    grade_by_excitation,
    grade_fit,
    identifiability,
)

PRESTERO, LINEAR = hd.catalog["prestero"], hd.catalog["linear"]
ORDER = tuple(hd.Grade)


CLEAR = {"coefficient": 10.0, "half_width": 1.0, "size": 1.0, "reliability": 1.0, "aliased": False}


def grade(*, excited=True, **more):
    values = {key: np.array([value]) for key, value in {**CLEAR, **more}.items()}
    (found,), (cause,) = grade_coefficients(**values, response=10.0, excited=excited)
    return found, cause


@pytest.mark.parametrize(
    ("values", "expected", "cause", "why"),
    json.loads(Path(__file__).with_name("grades.json").read_text("utf-8")),
)
def test_the_rule_and_the_first_cause(values, expected, cause, why):
    assert grade(**values) == (hd.Grade[expected], cause and Cause[cause]), why


@pytest.fixture(scope="module")
def campaign():
    return hd.reenact(seed=0, duration=200.0)


@pytest.fixture(scope="module")
def problem(campaign):
    return hd.prepare(campaign.vehicle, campaign.train, [PRESTERO, LINEAR])


@pytest.fixture(scope="module")
def by_log(problem):
    return identifiability(problem, PRESTERO)


@pytest.mark.slow
def test_the_campaign_determines_the_main_coefficients(by_log):
    main = {"X_u|u|", "Y_ur", "K_p|p|", "M_uw", "N_uv", "N_ur"}
    assert main <= set(by_log.labels_with(hd.Grade.DETERMINED))
    assert all(one.excited for one in by_log.axes)
    assert by_log.grades["Z_w|w|"] is hd.Grade.NOT_DETERMINED
    assert by_log.axes[0].rank == 5


@pytest.mark.slow
def test_aliased_columns_are_named(problem, campaign):
    twice = hd.DampingModel.from_table({"X": "u^2 u|u|", "K": "p"}, key="twice")
    found = identifiability(hd.prepare(campaign.vehicle, campaign.train, twice), twice)
    assert found.axes[0].groups == (("X_u^2", "X_u|u|"),)
    assert found.axes[0].condition == np.inf
    assert found.labels_with(hd.Grade.NOT_DETERMINED) == ("X_u^2", "X_u|u|")


@pytest.mark.slow
def test_a_log_that_is_too_short_is_refused(campaign):
    first = campaign.train.segments[0].name
    short = hd.prepare(campaign.vehicle, campaign.train.select(first).between(0.0, 6.0), LINEAR)
    with pytest.raises(MethodError, match="longer log"):
        identifiability(short, LINEAR)


@pytest.fixture(scope="module")
def fit(problem):
    return hd.WeakForm().identify(problem, PRESTERO)


def with_errors(fit, covariance):
    return replace(fit, damping=replace(fit.damping, covariance=covariance), uncertainty=None)


@pytest.mark.slow
def test_without_standard_errors_the_log_alone_says(problem, fit, by_log):
    assert grade_fit(problem, with_errors(fit, None)).grades == by_log.grades


@pytest.mark.slow
def test_the_worse_holds(problem, fit, by_log):
    known, seen = fit.uncertainty, analyse_excitation(problem, PRESTERO)
    half = known.critical_value() * known.standard_errors
    by_fit = grade_by_excitation(seen, half, fit.damping.coefficients).grades
    worse = {k: max(by_log.grades[k], by_fit[k], key=ORDER.index) for k in by_log.grades}
    found = grade_fit(problem, fit)
    assert found.grades == worse
    assert tuple(found.causes) == found.labels_with(hd.Grade.NOT_DETERMINED)
    assert worse not in (by_log.grades, by_fit)


@pytest.fixture(scope="module")
def replayed():
    """A fit with held-out replays that pushes make poor, and its problem."""
    campaign = hd.reenact(seed=0, duration=60.0)
    problem = hd.prepare(campaign.vehicle, campaign.train, LINEAR)
    fit = hd.WeakForm().identify(problem, LINEAR)
    known = fit.uncertainty.rescale(np.full(36, 0.1))
    fit = replace(with_errors(fit, known.covariance), uncertainty=known)
    return problem, replace(fit, held_out_r_squared=dict.fromkeys("XYZKMN", 0.1))


def judge_form(*missing):
    """Return what score tests say of a form that lacks terms on these axes."""
    tests = {k: ScoreTest(900.0 if k in missing else 9.0, 10, 2000) for k in "XYZKMN"}
    return Adequacy.judge(tests, dict.fromkeys(tests, 0.0), {})


@pytest.mark.slow
def test_poor_replays_do_not_count_where_the_form_is_adequate(replayed):
    problem, fit = replayed
    assert set(grade_fit(problem, fit).causes.values()) == {Cause.POORLY_EXCITED}
    graded = grade_fit(problem, replace(fit, adequacy=judge_form()))
    assert all(axis.excited for axis in graded.axes)
    half = fit.uncertainty.critical_value() * fit.uncertainty.standard_errors
    is_narrow = half <= 0.25 * np.abs(fit.damping.coefficients)
    assert graded.labels_with(hd.Grade.DETERMINED) == tuple(np.array(LINEAR.labels)[is_narrow])
    lacking = grade_fit(problem, replace(fit, adequacy=judge_form("K")))
    assert set(lacking.causes.values()) == {Cause.POORLY_EXCITED}


@pytest.mark.slow
def test_no_coefficient_is_determined_where_terms_are_missing(replayed):
    problem, fit = replayed
    fit = replace(fit, held_out_r_squared=dict.fromkeys("XYZKMN", 0.9))
    full = grade_fit(problem, fit).grades
    limited = grade_fit(problem, replace(fit, adequacy=judge_form("N"))).grades
    changed = {label for label in full if limited[label] is not full[label]}
    assert changed == {k for k, v in full.items() if v is hd.Grade.DETERMINED and k[0] == "N"}
    assert changed
    assert {limited[label] for label in changed} == {hd.Grade.WEAK}
