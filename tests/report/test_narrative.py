from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.identifiability import AxisIdentifiability, Grade, Identifiability
from hydrodamp.report.narrative import remarks, verdict
from hydrodamp.validation.compare import Comparison


def graded(grades, *, excited=True):
    """Return grades of 'linear': a letter d, m, w or n for each coefficient of every axis."""
    words = dict(zip("dmwn", Grade, strict=True))
    model = hd.catalog["linear"]
    axes = []
    for k, axis in enumerate("XYZKMN"):
        labels = model.labels[6 * k : 6 * k + 6]
        sure = tuple(words[letter] for letter in grades)
        share = 0.9 if excited or axis != "K" else 0.1
        axes.append(AxisIdentifiability(axis, labels, sure, 6, 3.0, share, share > 0.25, ()))
    return Identifiability(model, tuple(axes))


def test_the_verdict_is_three_sentences(comparison, snapshot):
    sentences = verdict(comparison)
    assert len(sentences) == 3
    assert all(sentence.endswith(".") for sentence in sentences)
    assert "\n".join(sentences) == snapshot


def test_scores_on_fitted_data_and_unfinished_runs_say_so(comparison):
    lacking = replace(comparison, provenance={"unfinished": "7 of 9 rows: interrupted"})
    assert next(remarks(lacking)).startswith("Incomplete comparison (7 of 9 rows: interrupted)")
    shared = replace(comparison, provenance={"overlap": "all 5 samples"})
    assert "data that share all 5 samples with the training data" in verdict(shared)[1]
    first = comparison.rows[0]
    flat = replace(first, score=replace(first.score, fit_by_axis=dict.fromkeys("uvwpqr")))
    assert verdict(Comparison((flat,)))[1].endswith("test data.")


def test_beyond_the_training_and_feeding_are_told_of_chosen_and_lost_rows(comparison):
    """The test reaches 29 m/s or rad/s; only fossen's pitch is of the wrong sign."""
    chosen, lost, other, *_ = comparison.rows
    values = {**lost.fit.damping.as_dict(), "M_q|q|": 1.0}
    pitch = hd.Damping.from_dict(lost.fit.model, values)
    fits = (
        replace(chosen.fit, training_range={"q": (-2.0, 2.0), "r": (-29.0, 29.0)}),
        replace(lost.fit, damping=pitch),
        replace(other.fit, damping=hd.Damping(other.fit.model, np.ones(24))),
    )
    rows = (replace(row, fit=fit) for row, fit in zip((chosen, lost, other), fits, strict=True))
    said = [*remarks(Comparison(tuple(rows)))]
    assert (
        "Extrapolation beyond the training data: q reaches 28 rad/s in the test, 2 in training."
        in said
    )
    assert [sentence for sentence in said if "injects" in sentence] == [
        "fossen by ls diverged in segment dive after 12.3 s, segment turn after 0.1 s. Its damping "
        "injects energy into q beyond 9 rad/s: a replay may diverge there."
    ]
    alone = [*remarks(Comparison((replace(other, fit=fits[2]),)))]
    assert alone[0].startswith("uncoupled by ls: its damping injects energy into u ")


@pytest.mark.parametrize(
    ("grades", "excited"), [("dddddd", True), ("ddddmw", True), ("nnnnnn", False)]
)
def test_the_third_sentence_rests_on_the_grades(comparison, grades, excited, snapshot):
    assert verdict(comparison, graded(grades, excited=excited))[2] == snapshot


def test_without_an_error_nothing_is_recommended(comparison):
    lost = hd.Comparison(comparison.rows[1:2])
    assert verdict(lost)[0].startswith("No model can be recommended")
    assert "outcomes: diverged" in verdict(lost)[0]
