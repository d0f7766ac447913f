"""Methods by key, and several models at once: one that is refused does not end the others."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError, ModelError
from hydrodamp.identification import dissipative
from hydrodamp.identification.identifiability import grade_fit
from hydrodamp.identification.methods import cite

LARGE, SMALL = hd.catalog["mcfarland-whitcomb"], hd.catalog["fossen"]


@pytest.fixture(scope="module")
def short():
    """A single run of 20 s: ridge has too few rows to cross-validate the largest model."""
    campaign = hd.reenact(seed=0, duration=20.0)
    run = campaign.train.select(campaign.train.segments[0].name)
    return hd.prepare(campaign.vehicle, run, [LARGE, SMALL])


@pytest.mark.slow
def test_a_fit_that_raises_is_a_status_and_the_other_models_stay(short):
    told = []
    fits = hd.identify_all(short, (LARGE, SMALL), hd.Ridge(), told.append)
    refused, usable = fits
    assert refused.status is hd.Status.REFUSED
    assert "rows for training where axis X" in refused.remarks[0]
    assert (refused.model.key, refused.method) == (LARGE.key, "ridge")
    assert np.isnan(refused.damping.coefficients).all()
    assert usable.status.usable
    assert set(map(id, told)) == set(map(id, fits))
    assert (refused.grades, set(usable.grades)) == ({}, set(SMALL.labels))
    table = hd.compare(fits, short.vehicle, short.log)
    assert table.rows[0].status is hd.Status.REFUSED
    assert table.row(LARGE.key, "ridge").rms is None


@pytest.mark.slow
def test_an_error_of_the_call_stays_an_error(short):
    narrow = hd.prepare(short.vehicle, short.log, SMALL)
    for method in (hd.Ridge(), hd.AdaptiveIdentifier()):
        with pytest.raises(ModelError, match="not prepared for"):
            hd.identify_all(narrow, [SMALL, LARGE], method)
    with pytest.raises(MethodError, match="no method 'rigde'"):
        hd.find_method("rigde")


@pytest.mark.parametrize(
    ("key", "method"),
    [
        pytest.param("recommended", (), marks=pytest.mark.slow),
        ("weak", ("weak",)),
        pytest.param("dissipative", (hd.Dissipative(),), marks=pytest.mark.slow),
    ],
)
def test_fits_are_graded_and_by_default_of_the_recommended_method(campaign, key, method):
    model, log = hd.catalog["linear"], campaign.train.select("yaw-1800", "depth-2600")
    problem = hd.prepare(campaign.vehicle, log, model)
    (fit,) = hd.identify_all(problem, [model], *method)
    single = hd.identify(model, campaign.vehicle, log, *method)
    assert fit.method == single.method == key
    for each in (fit, single):
        assert each.grades == dict(grade_fit(problem, replace(each, grades={})).grades)


@pytest.mark.slow
@pytest.mark.parametrize("key", hd.METHODS)
def test_a_fit_says_with_what_settings_it_was_made(
    key, driven, discrete_log, true_damping, monkeypatch
):
    """By them a run that goes on tells whether the fits of a folder are its own."""
    monkeypatch.setattr(dissipative, "_MAX_ITERATIONS", 1)  # the result is not used
    model = SMALL
    problem = hd.prepare(driven, discrete_log(true_damping(model), n=120), model)
    fit = hd.find_method(key).identify(problem, model)
    assert fit.provenance["settings"] == repr(hd.find_method(key))
    assert fit.method == key


def test_beside_the_paper_stands_what_is_the_papers():
    assert [key for key, entry in hd.METHODS.items() if entry.paper_column] == ["ls", "ai"]
    assert hd.LeastSquares(hd.FiniteDifference()).key == "ls"
    assert hd.LeastSquares(hd.SavitzkyGolay()).key not in hd.METHODS


def fit_by(method):
    return hd.Fit(hd.Damping(hd.catalog["linear"], np.zeros(36)), method, hd.Status.OK)


@pytest.mark.parametrize(
    ("method", "sources"),
    [("ls", 1), ("ai-composite", 1), ("weak", 1), ("ridge", 2), ("recommended", 2), ("oe", 2)],
)
def test_each_source_is_a_line(method, sources):
    lines, _, entry = cite(fit_by(method)).partition("\n\n")
    first, *cited, model = lines.splitlines()
    assert (first, len(cited)) == (f"Method: {method} of hydrodamp", sources)
    assert model.startswith("Linear: ")
    assert entry.startswith("@inproceedings{gibson-mccarter-stilwell-neu")
