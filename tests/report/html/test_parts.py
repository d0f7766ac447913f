from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hydrodamp.models.catalog import PAPER_MODELS
from hydrodamp.report.html import coefficient_tables as tables_of
from hydrodamp.report.html.coefficient_tables import coefficient_tables
from hydrodamp.report.html.score_table import ranked, score_table
from hydrodamp.report.html.summary import summary
from hydrodamp.simulation.status import Status
from hydrodamp.validation.comparison import Comparison


def with_fit(comparison, **changes):
    first = comparison.rows[0]
    return Comparison((replace(first, fit=replace(first.fit, **changes)),), provenance={})


def test_the_verdict_is_three_sentences(comparison):
    which, how_good, unknown = summary(comparison)
    assert which.startswith("Take linear by ls (0.46): lowest RMS error of 2 replays; runner-up")
    assert "on data it has not seen, it errs by 0.46 (RMS of m/s and deg/s together)" in how_good
    assert "-110 % for r at worst and 90 % for u at best" in how_good
    assert unknown.startswith(
        "What the log did not determine: 3 of its 36 coefficients may be zero"
    )
    assert all(each.endswith(".") for each in (which, how_good, unknown))


def test_many_unknown_coefficients_are_counted_by_row(comparison):
    covariance = np.diag(np.full(36, 1e6))
    fit = comparison.rows[0].fit
    unsure = with_fit(comparison, damping=replace(fit.damping, covariance=covariance))
    assert "36 of its 36 coefficients" in summary(unsure)[2]
    assert "(X 6, Y 6, Z 6, K 6, M 6, N 6)" in summary(unsure)[2]


def test_aliased_coefficients_are_named_first(comparison):
    tied = with_fit(comparison, aliased=(("X_u", "X_v"), ("K_p",)))
    words = summary(tied)[2]
    assert "3 of its 36 coefficients cannot be told apart (X_u, X_v, K_p)" in words
    assert "of the others" in words


@pytest.mark.parametrize(
    ("covariance", "rank", "words"),
    [
        (np.diag(np.full(36, 1e-9)), 36, "determined all 36 coefficients"),
        (None, None, "is not known: ls tells neither ranks nor standard errors"),
        (None, 36, "tells all 36 coefficients apart, but ls gives no standard errors"),
    ],
)
def test_what_is_known_depends_on_the_method(comparison, covariance, rank, words):
    fit = comparison.rows[0].fit
    damping = replace(fit.damping, covariance=covariance)
    assert words in summary(with_fit(comparison, damping=damping, rank=rank))[2]


def test_a_score_on_fitted_data_says_so(comparison):
    shared = replace(comparison, provenance={"overlap": "all 5 samples"})
    assert "data that share all 5 samples with the training data" in summary(shared)[1]
    first = comparison.rows[0]
    flat = replace(first, score=replace(first.score, fit_by_axis=dict.fromkeys("uvwpqr")))
    assert summary(Comparison((flat,)))[1].endswith("together).")


def test_ranks_put_what_has_not_settled_behind(comparison):
    order = [(row.model, row.method) for row in ranked(comparison.rows)]
    assert order[:3] == [("linear", "ls"), ("uncoupled", "ls"), ("linear", "ai")]
    assert {row.rms for row in ranked(comparison.rows)[4:]} == {None}


def test_the_printed_error_stands_beside_a_re_enactment(comparison):
    table = score_table(comparison)
    assert [column.name for column in table.columns][:7] == [
        *("Model", "Method", "n", "Rank", "RMS", "Outcome", "Paper")
    ]
    assert [line.chosen for line in table.lines].index(True) == 0
    assert table.lines[0].cells[6].text == "0.50"
    elsewhere = score_table(replace(comparison, provenance={}))
    assert "Paper" not in [column.name for column in elsewhere.columns]
    assert score_table(Comparison(())).lines == ()


def test_intervals_are_drawn_in_shares_of_the_value(comparison):
    table = coefficient_tables(comparison.rows[:1])[0]
    assert table.known
    assert len(table.lines) == 36
    line = table.lines[0]  # -1 with standard error 1
    assert (line.value, line.error, line.span) == ("-1", "1", "-2.96 to 0.96")
    assert line.interval is not None
    assert not line.interval.sure
    assert line.interval.cut
    last = table.lines[-1]  # -36 with standard error 6
    assert last.interval is not None
    assert last.interval.sure
    assert last.interval.high - 100.0 == pytest.approx(60.0 * 1.96 * 6 / 36, abs=0.1)


def test_coefficients_without_standard_errors_have_no_interval(comparison):
    tables = coefficient_tables(ranked(comparison.rows))
    found = {(table.model, table.method): table for table in tables}
    assert ("coe", "ls") not in found
    online = found["linear", "ai"]
    assert not online.known
    assert {line.known for line in online.lines} == {"-"}
    assert "no" in {line.known for line in found["uncoupled", "ls"].lines}
    assert online.sentences[0] == Status.NOT_SETTLED.value


def test_estimates_that_err_together_are_named(comparison):
    fit = comparison.rows[0].fit
    covariance = np.diag(np.r_[0.0, np.full(35, 4.0)])
    covariance[2, 5] = covariance[5, 2] = -3.9
    covariance[7, 9] = covariance[9, 7] = 3.7
    damping = replace(fit.damping, covariance=covariance)
    (table,) = coefficient_tables((replace(comparison.rows[0], fit=replace(fit, damping=damping)),))
    assert table.sentences[-1] == (
        "2 pairs of estimates are correlated beyond 0.9, and better known together than apart; the "
        "most: X_w with X_r (-0.97), Y_v with Y_p (+0.93)."
    )


def test_a_zero_or_unknown_coefficient_is_not_drawn(comparison):
    fit = comparison.rows[0].fit
    covariance = fit.damping.covariance.copy()
    covariance[1, 1] = -1e-9
    values = fit.damping.coefficients.copy()
    values[0] = 0.0
    spoilt = replace(fit.damping, coefficients=values, covariance=covariance)
    lines = coefficient_tables((replace(comparison.rows[0], fit=replace(fit, damping=spoilt)),))[0]
    assert [line.interval for line in lines.lines[:2]] == [None, None]
    assert lines.lines[1].error == "-"


def test_whole_fits_are_listed_until_there_are_too_many(make_log, make_comparison, monkeypatch):
    comparison = make_comparison(make_log(20.0, 10.0), PAPER_MODELS, ("ls",))
    monkeypatch.setattr(tables_of, "MOST", 330)
    kept = coefficient_tables(comparison.rows)
    assert [table.model for table in kept] == list(PAPER_MODELS[: len(kept)])
    assert sum(len(table.lines) for table in kept) <= 330
