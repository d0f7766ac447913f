"""Whiteness against its definition, outliers, and what is said of them."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import kstest

import hydrodamp as hd
from hydrodamp.identification.residuals import (
    autocorrelations,
    correlated,
    diagnose,
    outlier_share,
    whiteness,
)

FOSSEN = hd.catalog["fossen"]


def test_p_values_of_white_noise_are_uniform():
    rng = np.random.default_rng(0)
    segment = np.arange(300) // 100
    values = [whiteness(rng.normal(size=300), segment, 1.0)[0] for _ in range(400)]
    assert kstest(values, "uniform").pvalue > 0.001


def test_correlation_of_a_known_process():
    """AR(1) with coefficient 0.8: neighbours 0.8, time (1 + 0.8) / (1 - 0.8) = 9 steps."""
    noise = np.random.default_rng(1).normal(size=40000)
    series = lfilter([1.0], [1.0, -0.8], noise)
    p, neighbours, time = whiteness(series, np.zeros(40000, dtype=int), 0.5)
    assert p == 0.0
    assert neighbours == pytest.approx(0.8, abs=0.02)
    exact = 1.0 + 2.0 * sum(0.8**lag for lag in range(1, 11))
    assert time == pytest.approx(0.5 * exact, rel=0.05)


def test_no_pair_lies_across_a_join_and_nothing_is_not_tested():
    assert whiteness(np.array([1.0, 1.0] * 10), np.arange(20), 1.0)[1:] == (0.0, 1.0)
    assert whiteness(np.zeros(50), np.zeros(50, dtype=int), 0.1)[0] == 1.0
    assert whiteness(np.ones(3), np.zeros(3, dtype=int), 0.1)[0] == 1.0


def test_share_of_outliers():
    rng = np.random.default_rng(2)
    values = rng.normal(size=10000)
    values[:300] = 50.0
    assert outlier_share(values) == pytest.approx(0.03, abs=0.002)
    assert outlier_share(np.zeros(0)) == 0.0


@pytest.fixture(scope="module")
def campaign():
    return hd.reenact(seed=0, duration=60.0)


@pytest.fixture(scope="module")
def problem(campaign):
    return hd.prepare(campaign.vehicle, campaign.train, FOSSEN)


def test_a_poor_model_leaves_correlated_residuals_and_spikes_are_told(problem):
    damping = hd.LeastSquares().identify(problem, FOSSEN).damping
    said, *_ = diagnose(problem, damping)
    assert re.match(r"Residuals are correlated in time on X \(over [\d.]+ s, neighbours 0", said)
    assert "would be wrong" in said
    wrench = problem.inputs.wrench.copy()
    wrench[::200, 5] += 1e4
    spiked = replace(problem, inputs=replace(problem.inputs, wrench=wrench))
    assert re.match(r"Many residuals .* deviations on .*N \(\d", diagnose(spiked, damping)[-1])


def test_locked_axes_and_empty_rows_are_not_told_of(campaign):
    planar = replace(campaign.vehicle, axes=("X", "Y", "N"), actuators=())
    log = replace(campaign.train, wrench=np.ones((campaign.train.n, 6)))
    two = hd.Damping.from_dict(None, {"X_u": -1.0, "Z_w": -1.0, "N_r": -1.0})
    said = " ".join(diagnose(hd.prepare(planar, log, two.model), two))
    assert set(re.findall(r"([XYZKMN]) \(", said)) == {"X", "N"}


def test_short_logs_have_no_correlation(campaign, problem):
    short = campaign.train.between(0.0, 1.0)
    damping = hd.LeastSquares().identify(problem, FOSSEN).damping
    with pytest.raises(hd.MethodError, match="at least 4 residuals"):
        autocorrelations(hd.prepare(campaign.vehicle, short, FOSSEN), [damping])


def test_correlations_are_those_of_the_definition():
    rng = np.random.default_rng(5)
    values, segment = rng.normal(size=50), np.repeat([0, 1], [30, 20])
    pairs, correlation = correlated(values, segment, 30)
    parts = values[:30], values[30:]
    for lag in (0, 1, 7):
        expected = np.concatenate([part[: len(part) - lag] * part[lag:] for part in parts])
        assert correlation[lag] == pytest.approx(expected.sum() / np.sum(values**2))
        assert pairs[lag] == len(expected)
    assert pairs[30] == 0
