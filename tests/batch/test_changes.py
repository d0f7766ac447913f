"""Quiet seasons do not change; changes are found and dated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.batch.groups import find_change_points, find_outlying_groups

MODEL = hd.catalog["prestero"]


def season(rng, n_blocks, days=20, spread=1.0):
    """Return fits of days of a few blocks, some days with more information than others."""
    n = MODEL.n_coefficients
    fits = []
    for leverage in np.exp(spread * rng.standard_normal((days, n))):
        blocks = 10.0 + np.sqrt(leverage) * rng.standard_normal((n_blocks, n))
        uncertainty = hd.Uncertainty(
            np.cov(blocks.T) / n_blocks, n_blocks - 1, "by hand", leverage=leverage
        )
        damping = hd.Damping(MODEL, blocks.mean(axis=0))
        fits.append(hd.Fit(damping, "weak", hd.Status.OK, uncertainty=uncertainty))
    return fits


def shifted(fits, first, by, label="X_u|u|"):
    """Return fits with one coefficient larger from a day on."""
    step = by * np.array([one == label for one in MODEL.labels])
    return [
        replace(fit, damping=hd.Damping(MODEL, fit.damping.coefficients + step * (day >= first)))
        for day, fit in enumerate(fits)
    ]


@pytest.mark.slow
@pytest.mark.parametrize("spread", [0.0, 1.0, 2.0])
@pytest.mark.parametrize("n_blocks", [4, 8, 16])
def test_quiet_seasons_of_few_blocks_do_not_change(n_blocks, spread):
    rng = np.random.default_rng([5, n_blocks, int(spread)])
    false = sum(bool(find_change_points(season(rng, n_blocks, spread=spread))) for _ in range(100))
    assert false <= 2


@pytest.mark.parametrize("first", [2, 7, 18])
def test_a_change_is_dated(first):
    fits = shifted(season(np.random.default_rng(6), 4), first, by=40.0)
    (change,) = find_change_points(fits)
    assert (change.label, change.first) == ("X_u|u|", first)
    assert change.relative_change == pytest.approx(4.0, abs=0.5)


def test_a_group_without_coefficients_or_standard_errors_is_left_out():
    fits = shifted(season(np.random.default_rng(7), 8), 10, by=40.0)
    fits[4] = replace(fits[4], damping=hd.Damping(MODEL, np.full(MODEL.n_coefficients, np.nan)))
    fits[5] = replace(fits[5], aliased=(("X_u|u|",),))
    fits[6] = replace(fits[6], uncertainty=None)
    (change,) = find_change_points(fits)
    assert (change.label, change.first) == ("X_u|u|", 10)


def test_a_coefficient_that_no_side_determines_is_not_tested():
    """From -0.4 to 0.4 with an error of 0.1 on each side: larger than chance, but what is it?"""
    scale = 0.2
    fits = season(np.random.default_rng(8), 16, days=60, spread=0.0)
    few = [
        replace(one, damping=hd.Damping(MODEL, scale * (one.damping.coefficients - 10.0) - 0.05))
        for one in fits
    ]
    assert find_change_points(shifted(few, 30, by=0.1)) == ()
    (change,) = find_change_points(shifted(few, 30, by=2.0))
    assert change.first == 30


@pytest.mark.parametrize("by", [-150.0, 1500.0])
@pytest.mark.parametrize("day", [0, 3, 11])
def test_a_bad_group_does_not_hide_a_change(day, by):
    fits = shifted(season(np.random.default_rng(10), 8, days=12), 6, by=40.0)
    (bad,) = shifted(fits[day : day + 1], 0, by=by)
    fits[day] = bad
    assert find_outlying_groups(fits) == {day: ("X_u|u|",)}
    (change,) = find_change_points(fits)
    assert (change.label, change.first) == ("X_u|u|", 6)


@pytest.mark.parametrize("rounding", [1e-15, 1e-13])
@pytest.mark.parametrize("days", [[3], [4, 5, 6, 7]])
def test_a_rounding_error_is_neither_an_outlier_nor_a_change(days, rounding):
    (fit,) = season(np.random.default_rng(12), 8, days=1)
    coefficients = fit.damping.coefficients
    fits = [
        replace(fit, damping=hd.Damping(MODEL, coefficients * (1.0 + rounding * (day in days))))
        for day in range(8)
    ]
    assert find_outlying_groups(fits) == {}
    assert find_change_points(fits) == ()


@pytest.mark.slow
def test_groups_of_little_information_are_no_outliers():
    rng = np.random.default_rng(11)
    named = [bool(find_outlying_groups(season(rng, 8, spread=2.0))) for _ in range(20)]
    assert sum(named) <= 1


def test_too_few_groups_are_not_tested():
    assert find_change_points(season(np.random.default_rng(9), 8, days=4)) == ()
    assert find_change_points([]) == ()
