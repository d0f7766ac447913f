"""Whiteness against its definition, outliers, and what is said of them."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import kstest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.identification.trust.diagnostics import AxisDiagnostics, Diagnostics, diagnose
from hydrodamp.identification.trust.residuals import Whiteness, outlier_share, whiteness

FOSSEN, LINEAR = hd.catalog["fossen"], hd.catalog["linear"]


def test_p_values_of_white_noise_are_uniform():
    rng = np.random.default_rng(0)
    segment = np.arange(300) // 100
    values = [whiteness(rng.normal(size=300), segment, 1.0).p for _ in range(400)]
    assert kstest(values, "uniform").pvalue > 0.001


def test_correlation_of_a_known_process():
    """AR(1) with coefficient 0.8: neighbours 0.8, time (1 + 0.8) / (1 - 0.8) = 9 steps."""
    noise = np.random.default_rng(1).normal(size=40000)
    found = whiteness(lfilter([1.0], [1.0, -0.8], noise), np.zeros(40000, dtype=int), 0.5)
    assert found.p == 0.0
    assert found.neighbours == pytest.approx(0.8, abs=0.02)
    exact = 1.0 + 2.0 * sum(0.8**lag for lag in range(1, 11))
    assert found.time == pytest.approx(0.5 * exact, rel=0.05)


def test_no_pair_lies_across_a_join():
    found = whiteness(np.array([1.0, 1.0] * 10), np.arange(20), 1.0)
    assert (found.neighbours, found.time) == (0.0, 1.0)


def test_nothing_to_test():
    assert whiteness(np.zeros(50), np.zeros(50, dtype=int), 0.1).p is None
    assert whiteness(np.ones(3), np.zeros(3, dtype=int), 0.1).p is None


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
    return hd.prepare(campaign.vehicle, campaign.train, [FOSSEN, LINEAR])


def test_a_poor_model_leaves_correlated_residuals(problem):
    found = diagnose(problem, FOSSEN)
    assert all(one.whiteness.p < 0.001 for one in found.axes if one.axis in "XN")
    assert any("would be wrong" in sentence for sentence in found.remarks)
    text = str(found).splitlines()
    assert len(text) == 2 + 6 + len(found.remarks)
    assert json.loads(json.dumps(found.as_dict(), allow_nan=False))["model"] == "fossen"


def test_residuals_of_a_damping(problem):
    fit = hd.identify(FOSSEN, problem.vehicle, problem.log, hd.LeastSquares())
    own = diagnose(problem, FOSSEN, fit.damping)
    best = diagnose(problem, FOSSEN)
    for one, other in zip(own.axes, best.axes, strict=True):
        assert one.rms >= other.rms * (1 - 1e-12)


def test_fewer_axes_and_empty_rows(campaign):
    planar = replace(campaign.vehicle, axes=("X", "Y", "N"), actuators=())
    log = replace(campaign.train, wrench=np.ones((campaign.train.n, 6)))
    model = hd.DampingModel.from_table({"X": "u", "Z": "w", "N": "r"}, key="two")
    found = diagnose(hd.prepare(planar, log, model), model, support=2.0)
    assert [one.axis for one in found.axes] == ["X", "N"]


def axis(**more) -> AxisDiagnostics:
    plain = AxisDiagnostics("Y", 1.0, Whiteness(0.5, 0.0, 0.1), 0.0)
    return replace(plain, **more)


def test_sentences_for_a_person():
    assert Diagnostics("two", (axis(), axis()), 2.0).remarks == ()
    coloured = axis(whiteness=Whiteness(1e-9, 0.9, 3.0))
    spiked = replace(coloured, axis="N", outliers=0.05)
    assert Diagnostics("two", (axis(), coloured, spiked), 2.0).remarks == (
        "Residuals are correlated in time on Y (over 3 s, neighbours 0.90), N (over 3 s, "
        "neighbours 0.90) (Ljung-Box, p < 0.01): intervals for white residuals would be wrong.",
        "Many residuals are beyond 4 robust standard deviations on N (5.0 %): look at the log "
        "there and remove its spikes.",
    )


def test_what_is_refused(problem):
    other = hd.Damping(LINEAR, np.zeros(36))
    with pytest.raises(MethodError, match=r"X_u\|u\|"):
        diagnose(problem, FOSSEN, other)
