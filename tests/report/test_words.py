from __future__ import annotations

from dataclasses import replace

import pytest

import hydrodamp as hd
from hydrodamp.identification.grades import AxisIdentifiability, Grade, Identifiability
from hydrodamp.report.words import remarks, verdict
from hydrodamp.validation.compare import Comparison


def graded(grades: str, *, excited: bool = True) -> Identifiability:
    """Return grades of 'linear': a letter d, w or n for each coefficient of every axis."""
    words = {"d": Grade.DETERMINED, "w": Grade.WEAK, "n": Grade.NOT_DETERMINED}
    model = hd.catalog["linear"]
    axes = []
    for k, axis in enumerate("XYZKMN"):
        labels = model.labels[6 * k : 6 * k + 6]
        sure = tuple(words[letter] for letter in grades)
        share = 0.9 if excited or axis != "K" else 0.1
        axes.append(
            AxisIdentifiability(axis, labels, sure, (1.0,) * 6, 6, 3.0, share, share > 0.25, ())
        )
    return Identifiability(model, tuple(axes))


def test_the_verdict_is_three_sentences(comparison):
    which, how_good, unknown = verdict(comparison)
    assert which.startswith("Take linear by ls (0.46): lowest RMS error of 2 replays; runner-up")
    assert "on data it has not seen, it errs by 0.46 (RMS of m/s and deg/s together)" in how_good
    assert "-110 % for r at worst and 90 % for u at best" in how_good
    assert unknown.startswith("How well the log determines the 36 coefficients was not graded;")
    assert all(each.endswith(".") for each in (which, how_good, unknown))


def test_a_score_on_fitted_data_says_so(comparison):
    shared = replace(comparison, provenance={"overlap": "all 5 samples"})
    assert "data that share all 5 samples with the training data" in verdict(shared)[1]
    first = comparison.rows[0]
    flat = replace(first, score=replace(first.score, fit_by_axis=dict.fromkeys("uvwpqr")))
    assert verdict(Comparison((flat,)))[1].endswith("together).")


def test_an_unfinished_run_says_so(comparison):
    lacking = replace(comparison, provenance={"unfinished": "7 of 9 rows: interrupted"})
    assert remarks(lacking)[0].startswith("Unfinished, 7 of 9 rows: interrupted.")


@pytest.mark.parametrize(
    ("grades", "excited", "sentence"),
    [
        ("dddddd", True, "The log determined all 36 coefficients of this model"),
        (
            "dddddw",
            True,
            "The log determined 30 of its 36 coefficients; 6 are weak, to be used with the "
            "whole model only (X_r, Y_r, Z_r, K_r, M_r, N_r)",
        ),
        (
            "nnnnnn",
            False,
            "The log determined none of its 36 coefficients; 36 are not determined (X 6, Y 6, "
            "Z 6, K 6, M 6, N 6); axes whose response is not predicted, for want of "
            "motion or of the right terms (share): K 10 %",
        ),
    ],
)
def test_the_third_sentence_rests_on_the_grades(comparison, grades, excited, sentence):
    assert verdict(comparison, graded(grades, excited=excited))[2] == f"{sentence}."


def test_without_an_error_nothing_is_recommended(comparison):
    lost = hd.Comparison(comparison.rows[1:2])
    assert verdict(lost)[0].startswith("No model can be recommended: none of 1 fits")
    assert "the outcomes are: diverged" in verdict(lost)[0]
