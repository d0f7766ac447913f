"""Autocorrelation against its definition, outliers, and remarks on both."""

import re
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.validation.diagnostics import (
    autocorrelation,
    autocorrelations,
    diagnose,
    outlier_share,
)
from value_changes import set_values

FOSSEN = hd.catalog["fossen"]


def test_share_of_outliers():
    values = np.random.default_rng(2).normal(size=10000)
    values[:300] = 50.0
    assert outlier_share(values) == pytest.approx(0.03, abs=0.002)
    assert outlier_share(np.zeros(0)) == 0.0


@pytest.fixture(scope="module")
def problem(campaign):
    return hd.prepare(campaign.vehicle, campaign.train, FOSSEN)


@pytest.mark.slow
def test_autocorrelation_and_outliers_are_reported(problem):
    damping = hd.LeastSquares().identify(problem, FOSSEN).damping
    remark, *_ = diagnose(problem, damping)
    assert re.match(r"Residuals are autocorrelated on X \(0\.\d\d\)", remark)
    spikes = np.s_[::200, 5], lambda wrench: wrench + 1e4
    spiked = replace(problem, inputs=set_values(problem.inputs, "wrench", spikes))
    assert re.match(r"Many residuals are outliers.* on .*N \(\d", diagnose(spiked, damping)[-1])


@pytest.mark.slow
def test_locked_axes_and_axes_without_terms_are_not_reported(campaign):
    planar = replace(campaign.vehicle, axes=("X", "Y", "N"), actuators=())
    log = replace(campaign.train, wrench=np.ones((campaign.train.n, 6)))
    damping = hd.Damping.from_dict(None, {"X_u": -1.0, "Z_w": -1.0, "N_r": -1.0})
    remarks = " ".join(diagnose(hd.prepare(planar, log, damping.model), damping))
    assert set(re.findall(r"([XYZKMN]) \(", remarks)) == {"X", "N"}


def test_short_logs_have_no_correlation(campaign, problem):
    short = campaign.train.between(0.0, 1.0)
    damping = hd.LeastSquares().identify(problem, FOSSEN).damping
    with pytest.raises(MethodError, match="at least 4 residuals"):
        autocorrelations(hd.prepare(campaign.vehicle, short, FOSSEN), [damping])


def test_correlations_are_those_of_the_definition():
    rng = np.random.default_rng(5)
    values, segment = rng.normal(size=50), np.repeat([0, 1], [30, 20])
    correlation = autocorrelation(values, segment, 30)
    segments = values[:30], values[30:]
    for lag in (0, 1, 7):
        expected = np.concatenate([each[: len(each) - lag] * each[lag:] for each in segments])
        assert correlation[lag] == pytest.approx(expected.sum() / np.sum(values**2))
    assert correlation[30] == 0.0
