"""Standard errors of merged folds do not depend on how the folds were merged."""

from __future__ import annotations

from dataclasses import replace
from functools import reduce

import numpy as np
import pytest

import hydrodamp as hd
from batch.conftest import MODEL
from hydrodamp.batch.sufficient_statistics import (
    LogStatistics,
    merge_statistics,
    solve_model,
    summarise_log,
)
from hydrodamp.errors import ProblemError

METHOD = hd.WeakForm()


@pytest.fixture(scope="module")
def folds(fleet):
    """40 dives of 40 s to 160 s; every other clock starts from zero."""
    found = []
    for number in range(40):
        names = [one.name for one in fleet.log.segments][: 1 + number % 4]
        log = fleet.dive(number).select(*names)
        start = 0.0 if number % 2 else 1e4 * number
        log = replace(log, time=log.time - log.time[0] + start)
        found.append(summarise_log(log, fleet.vehicle, [MODEL], METHOD))
    return found


def merge_tree(folds: list[LogStatistics], rng: np.random.Generator) -> LogStatistics:
    """Merge folds in a random order, as a tree of a random shape."""
    parts = [folds[k] for k in rng.permutation(len(folds))]
    while len(parts) > 1:
        first, other = sorted(rng.choice(len(parts), 2, replace=False).tolist())
        parts.append(merge_statistics([parts[first], parts.pop(other)]))
        parts.pop(first)
    return parts[0]


def estimate(folded, fleet):
    fit = solve_model(folded, fleet.vehicle, MODEL, METHOD)
    return fit.damping.coefficients, fit.uncertainty.standard_errors


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_every_order_and_tree_gives_the_same_errors(seed, folds, fleet):
    expected = estimate(merge_statistics(folds), fleet)
    merged = merge_tree(folds, np.random.default_rng(seed))
    assert (merged.n_logs, len(merged.balanced)) == (40, 32)
    for found, one in zip(estimate(merged, fleet), expected, strict=True):
        np.testing.assert_allclose(found, one, rtol=1e-6)


@pytest.mark.slow
def test_logs_beyond_the_blocks_that_are_kept(folds, fleet):
    """All at once: the same for every order. Bit by bit: blocks stay balanced."""
    many = [*folds, *folds, *folds, *folds]
    expected, one = merge_statistics(many), merge_statistics(many[::-1])
    np.testing.assert_allclose(estimate(one, fleet)[1], estimate(expected, fleet)[1], rtol=1e-6)
    for seed in range(3):
        order = np.random.default_rng(seed).permutation(len(many))
        merged = reduce(LogStatistics.merge, [many[k] for k in order])
        rows = [block.n_samples for block in merged.balanced]
        assert max(rows) < 0.06 * sum(rows)
        assert merged.n_logs == 160


@pytest.mark.slow
def test_folds_of_different_terms_are_refused(folds, fleet, refused):
    linear = summarise_log(fleet.log, fleet.vehicle, [hd.catalog["linear"]], METHOD)
    refused(ProblemError, merge_statistics, [folds[0], linear])
    refused(ProblemError, merge_statistics, [])
