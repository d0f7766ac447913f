"""Searching again without parts of the log: what is left out, and what comes of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification import output_error as module
from hydrodamp.identification.output_error import OutputError, left_out
from hydrodamp.identification.search import Path, Place, searching

MODEL = hd.catalog["fossen"]


@pytest.fixture(scope="module")
def campaign():
    return hd.reenact(seed=3, duration=30.0)


@pytest.fixture
def problem(campaign):
    return hd.prepare(campaign.vehicle, campaign.train, MODEL)


@pytest.fixture
def seen(monkeypatch):
    """The problems that are searched, in place of a search."""
    problems = []

    def refine(search, shooting, start, rounds):
        problems.append(search.problem)
        return Path((start,), settled=True)

    monkeypatch.setattr(module, "refine", refine)
    return problems


@pytest.mark.parametrize(("n_parts", "found_parts"), [(4, 4), (5, 4), (8, 8), (16, 16)])
def test_every_sample_is_left_out_once(problem, seen, n_parts, found_parts):
    """Four segments are cut into two or four each, but not into five parts."""
    place = Place(np.zeros(12), np.ones(6))
    found = left_out(searching(problem, MODEL), place, n_parts)
    assert found is not None
    assert len(found) == len(seen) == found_parts
    kept = sum(part.n_samples for part in seen)
    assert kept == (found_parts - 1) * problem.n_samples


def test_what_is_left_crosses_no_join(problem, seen):
    """Within a segment of a part all steps are those of the log."""
    left_out(searching(problem, MODEL), Place(np.zeros(12), np.ones(6)), 8)
    step = np.diff(problem.inputs.time[:2])[0]
    for part in seen:
        for start, stop in part.segments.tolist():
            np.testing.assert_allclose(np.diff(part.inputs.time[start:stop]), step, rtol=1e-6)


def test_searches_without_an_end_leave_nothing(problem, monkeypatch):
    monkeypatch.setattr(module, "refine", lambda *_: None)
    assert left_out(searching(problem, MODEL), Place(np.zeros(12), np.ones(6)), 8) is None


def test_standard_errors_grow_with_the_noise(campaign):
    """To first order an estimate is linear in the noise: twice the noise, twice the error."""
    model = hd.catalog["prestero"].with_terms({"K": "up"}, key="true-terms")
    noise = campaign.train.velocity - campaign.exact_train.velocity
    errors = []
    for size in (0.5, 1.0):
        log = replace(campaign.train, velocity=campaign.exact_train.velocity + size * noise)
        fit = hd.identify(model, campaign.vehicle, log, OutputError())
        assert fit.uncertainty is not None
        assert fit.uncertainty.n_blocks == 8
        errors.append(fit.uncertainty.standard_errors)
    ratio = float(np.exp(np.mean(np.log(errors[1] / errors[0]))))
    assert ratio == pytest.approx(2.0, rel=0.25)


def test_without_parts_the_words_say_that_it_is_too_little(problem):
    fit = OutputError(parts=0, rounds=2).identify(problem, MODEL)
    assert "too little" in str(fit.uncertainty)


@pytest.mark.parametrize("parts", [-1, 1, 3])
def test_too_few_parts_are_refused(parts):
    with pytest.raises(hd.MethodError, match="`parts`"):
        OutputError(parts=parts)
