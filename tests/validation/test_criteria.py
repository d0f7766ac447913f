"""AIC, AICc and BIC against their textbook form, and what must not change them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

import hydrodamp as hd
from hydrodamp.basis.basis import Basis
from hydrodamp.identification.rows import Rows
from hydrodamp.validation.criteria import criteria

AXIS = "XYZKMN"
TERMS = ("u", "v", "w", "p")


def model_of(count, key, axes="XYZKMN"):
    return hd.DampingModel.from_table({axis: " ".join(TERMS[:count]) for axis in axes}, key=key)


def noisy_rows(seed=0, n=400, true=2, axes="XYZKMN", factor=1.0):
    """Rows whose target is a sum of the first columns and noise coupled across axes."""
    rng = np.random.default_rng(seed)
    design = rng.normal(size=(n, 4))
    mixing = np.eye(6) + 0.3 * rng.normal(size=(6, 6))
    target = design[:, :true] @ rng.normal(size=(true, 6)) + rng.normal(size=(n, 6)) @ mixing
    target = factor * target * [axis in axes for axis in AXIS]
    basis = model_of(4, "all").basis
    return Rows(basis, design, target, np.zeros(n, dtype=int), np.arange(n) / 10)


def solved(rows, model, method="ls"):
    """Ordinary least squares by someone else's program."""
    columns = [[rows.basis.index(term) for term in terms] for terms in model.terms]
    values = [
        np.linalg.lstsq(rows.design[:, column], rows.target[:, axis], rcond=None)[0]
        for axis, column in enumerate(columns)
    ]
    return hd.Fit(hd.Damping(model, np.concatenate(values)), method, hd.Status.OK)


def lowest(found, name):
    """The model with the lowest value of a criterion."""
    return min(found.rows, key=lambda row: getattr(row, name)).model


def nested(rows, axes="XYZKMN"):
    return [solved(rows, model_of(k, f"m{k}", axes)) for k in (1, 2, 3, 4)]


def test_white_residuals_give_the_textbook_values():
    """-2 log L of a Gaussian with covariance S is n log det S + 2 k for AIC, k log n for BIC,
    up to a constant; white residuals count as (nearly) all rows."""
    rows = noisy_rows(n=2000)
    found = criteria(rows, nested(rows))
    assert min(found.n_effective.values()) > 1700
    n = np.mean(list(found.n_effective.values()))
    expected = []
    for k in (1, 2, 3, 4):
        rest = (
            rows.target
            - rows.design[:, :k] @ np.linalg.lstsq(rows.design[:, :k], rows.target, rcond=None)[0]
        )
        expected.append(n * np.linalg.slogdet(rest.T @ rest / 2000)[1] + 2 * 6 * k)
    aic = [row.aic for row in found.rows]
    # Each axis has its own number of samples, so the two agree as those agree.
    spread = np.ptp(list(found.n_effective.values())) / n
    np.testing.assert_allclose(np.diff(aic), np.diff(expected), rtol=2 * spread + 1e-9, atol=1.0)


def test_penalties_are_those_of_the_formulas():
    rows = noisy_rows(n=300)
    found = criteria(rows, nested(rows))
    counts = np.array(list(found.n_effective.values()))
    for k, row in zip((1, 2, 3, 4), found.rows, strict=True):
        schwarz = ((k + 1) * (np.log(counts) - 2)).sum()
        assert row.bic - row.aic == pytest.approx(schwarz)
        # Hurvich and Tsai 1989, k + 1 parameters an axis.
        hurvich = (2 * (k + 1) * (k + 2) / (counts - k - 2)).sum()
        assert row.aicc - row.aic == pytest.approx(hurvich)


def test_the_truth_is_chosen_and_no_more():
    """BIC is consistent: of nested models it takes the true one in nearly every draw."""
    chosen = []
    for seed in range(20):
        rows = noisy_rows(seed)
        chosen.append(lowest(criteria(rows, nested(rows)), "bic"))
    assert chosen.count("m2") >= 19


def test_units_do_not_change_differences():
    plain, scaled = (noisy_rows(factor=factor) for factor in (1.0, 1000.0))
    first, second = (criteria(rows, nested(rows)) for rows in (plain, scaled))
    for name in ("aic", "aicc", "bic"):
        values = [[getattr(row, name) for row in table.rows] for table in (first, second)]
        np.testing.assert_allclose(np.diff(values[0]), np.diff(values[1]), rtol=1e-9)


def test_equal_columns_are_counted_once():
    rows = noisy_rows()
    twice = np.column_stack([rows.design[:, :2], rows.design[:, 1], rows.design[:, 3]])
    same = Rows(rows.basis, twice, rows.target, rows.segment, rows.time)
    found = criteria(same, [solved(same, model_of(3, "m3")), solved(same, model_of(2, "m2"))])
    assert found.rows[0].aic == pytest.approx(found.rows[1].aic)


def test_only_axes_with_a_target_count():
    rows = noisy_rows(axes="XYN")
    assert list(criteria(rows, nested(rows, "XYN")).n_effective) == ["X", "Y", "N"]


def test_more_coefficients_than_effective_samples_is_infinite():
    rows = noisy_rows(n=5)
    found = criteria(rows, nested(rows)[2:])
    assert [row.aicc for row in found.rows] == [np.inf, np.inf]


def test_an_exact_fit_is_finite():
    rows = noisy_rows()
    exact = Rows(rows.basis, rows.design, rows.design @ np.ones((4, 6)), rows.segment, rows.time)
    found = criteria(exact, nested(exact))
    assert lowest(found, "bic") == "m4"
    assert np.isfinite(found.rows[3].bic)


def test_fits_without_numbers_are_rows_without_numbers():
    rows = noisy_rows()
    fits = nested(rows)
    lost = [replace(fit, status=hd.Status.FAILED) for fit in fits]
    mixed = criteria(rows, [lost[0], fits[1]])
    assert (mixed.rows[0].aic, mixed.rows[0].aicc, mixed.rows[0].bic) == (None, None, None)
    assert mixed.rows[1] == criteria(rows, fits[1:2]).rows[0]
    assert criteria(rows, lost).rows[3].bic is None


def test_what_cannot_be_compared_is_refused():
    rows = noisy_rows()
    other = hd.Fit(hd.Damping(hd.catalog["fossen"], np.ones(12)), "ls", hd.Status.OK)
    with pytest.raises(hd.TermError, match="not in the basis"):
        criteria(rows, [other])
    nothing = Rows(Basis(()), np.zeros((3, 0)), np.zeros((3, 6)), np.zeros(3, int), np.arange(3.0))
    with pytest.raises(hd.MethodError, match="nothing to explain"):
        criteria(nothing, nested(rows))


def test_coloured_residuals_count_as_theory_says():
    """Those of AR(1) noise as n (1 - phi)/(1 + phi), in segments put together too."""
    rows = noisy_rows(n=100_000, axes="X")
    noise = lfilter([1.0], [1.0, -0.9], np.random.default_rng(3).normal(size=rows.n))
    found = [
        criteria(replace(rows, target=noise[:, None] * [1, 0, 0, 0, 0, 0], segment=segment), fits)
        for segment in (rows.segment, np.arange(rows.n) // 2000)
        for fits in [nested(rows, "X")]
    ]
    for one in found:
        assert one.n_effective["X"] == pytest.approx(rows.n / 19, rel=0.15)
