"""Standard errors of the replay: one part of the log after another left out."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.gauss_newton import (
    best_initial_iterate,
    continue_over_lengths,
    initial_candidates,
    make_objective,
)
from hydrodamp.identification.output_error import build_fit, jackknife_uncertainty


@pytest.fixture(scope="module")
def campaign():
    return hd.reenact(seed=3, duration=30.0)


def test_without_a_prior_it_is_the_delete_one_jackknife(campaign):
    """R. G. Miller (1974), doi:10.1093/biomet/61.1.1, section 4, of the linearised problem."""
    model = hd.catalog["fossen"]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    search = make_objective(problem, model)
    windows = search.windows(4.0)
    place = best_initial_iterate(search, initial_candidates(search, model)[:1], 4.0)
    (kind,), place = place.kinds, replace(place, strength=0.0)
    normals = windows.normals(place.coefficients, kind.spread, 32)
    total = normals.sum(axis=0)
    ends = [np.linalg.solve((total - one)[:-1, :-1], (total - one)[:-1, -1]) for one in normals]
    away, n = np.array(ends) - np.mean(ends, axis=0), len(ends)
    found = jackknife_uncertainty(search, place)
    assert found is not None
    assert found.degrees_of_freedom == found.n_blocks - 1 == n - 1
    np.testing.assert_allclose(found.covariance, (n - 1) / n * away.T @ away, rtol=1e-6)


def test_what_no_data_tell_may_be_all_that_the_prior_allows(campaign):
    """A rudder gain that a log without rudder cannot tell has the spread of the prior."""
    model = hd.catalog["fossen"].with_terms({"N": "u|u|*rudder"})
    kept = np.array([name != "rudder" for name in campaign.train.command_names])
    still = replace(campaign.train, commands=campaign.train.commands * kept)
    problem = hd.prepare(campaign.vehicle, still, model)
    search = make_objective(problem, model)
    place = best_initial_iterate(search, [np.zeros(13)], 4.0)
    found = jackknife_uncertainty(search, replace(place, strength=0.1, size=4.0))
    assert found is not None
    assert found.standard_errors[-1] == pytest.approx(2.0 * search.unit[-1])
    assert found.noise_only.standard_errors[-1] == pytest.approx(0.0, abs=1e-12)


def test_too_few_windows_leave_nothing_out(campaign):
    model = hd.catalog["fossen"]
    problem = hd.prepare(campaign.vehicle, campaign.train.between(0.0, 5.0), model)
    search = make_objective(problem, model)
    assert jackknife_uncertainty(search, best_initial_iterate(search, [np.zeros(12)], 4.0)) is None


def test_intervals_reach_back_to_the_start_and_as_far_as_halves_differ(campaign):
    """Each variance is at least the square of how far the search moved from its start."""
    model = hd.catalog["linear"]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    search = make_objective(problem, model)
    start = best_initial_iterate(search, initial_candidates(search, model), 2.0)
    end = continue_over_lengths(search, start, (2.0, 4.0))
    moved = np.abs(end.coefficients - start.coefficients)
    alone = build_fit(search, model, hd.OutputError(), start, end)
    assert alone.uncertainty is not None
    assert np.all(alone.uncertainty.standard_errors >= moved * (1.0 - 1e-9))
    plain = jackknife_uncertainty(search, end)
    assert plain is not None
    apart = 3.0 * plain.noise_only.standard_errors
    wider = build_fit(search, model, hd.OutputError(), end, end, apart).uncertainty
    assert wider is not None
    np.testing.assert_allclose(wider.standard_errors, 3.0 * plain.standard_errors)
