"""Grades of a fit: by the log, and by its own intervals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.trust.grades import Grade
from hydrodamp.identification.trust.grading import graded
from hydrodamp.identification.trust.identifiability import identifiability

PRESTERO = hd.catalog["prestero"]
ORDER = tuple(Grade)


@pytest.fixture(scope="module")
def problem():
    campaign = hd.reenact(seed=0, duration=200.0)
    return hd.prepare(campaign.vehicle, campaign.train, PRESTERO)


@pytest.fixture(scope="module")
def fit(problem):
    return hd.WeakForm().identify(problem, PRESTERO)


def with_errors(fit: hd.Fit, covariance: np.ndarray | None) -> hd.Fit:
    return replace(fit, damping=replace(fit.damping, covariance=covariance), uncertainty=None)


def test_without_standard_errors_the_log_alone_says(problem, fit):
    found = graded(problem, with_errors(fit, None))
    assert found.grades == identifiability(problem, PRESTERO).grades


def test_an_interval_that_tells_nothing_is_no_better_for_the_log(problem, fit):
    found = graded(problem, with_errors(fit, 1e12 * np.eye(30)))
    assert set(found.grades.values()) == {Grade.NOT_DETERMINED}


def test_a_narrow_interval_is_no_better_than_the_log(problem, fit):
    found = graded(problem, with_errors(fit, 1e-12 * np.eye(30)))
    by_log = identifiability(problem, PRESTERO)
    assert all(ORDER.index(found.grades[k]) >= ORDER.index(by_log.grades[k]) for k in found.grades)


def test_the_worse_holds(problem, fit):
    by_log = identifiability(problem, PRESTERO).grades
    by_fit = identifiability(problem, PRESTERO, fit.uncertainty, fit.damping.coefficients).grades
    worse = {k: max(by_log[k], by_fit[k], key=ORDER.index) for k in by_log}
    assert graded(problem, fit).grades == worse
    assert worse not in (by_log, by_fit)


def test_few_degrees_of_freedom_widen_what_is_graded(problem, fit):
    few = replace(fit, uncertainty=replace(fit.uncertainty, degrees_of_freedom=1.0))
    many = replace(fit, uncertainty=replace(fit.uncertainty, degrees_of_freedom=np.inf))
    sure = [len(graded(problem, one).labelled(Grade.DETERMINED)) for one in (few, many)]
    assert sure[0] < sure[1]
