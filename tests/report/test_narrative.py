from dataclasses import replace

import numpy as np

import hydrodamp as hd
from hydrodamp.identification.adequacy import Adequacy, ScoreTest
from hydrodamp.report.narrative import explain_failure, remarks
from hydrodamp.validation.compare import Comparison


def test_scores_on_fitted_data_and_unfinished_runs_say_so(comparison):
    lacking = replace(comparison, provenance={"unfinished": "7 of 9 rows: interrupted"})
    assert next(remarks(lacking)).startswith("Incomplete comparison (7 of 9 rows: interrupted)")
    shared = replace(comparison, provenance={"overlap": "0:5 s"})
    assert "Training and test data share 0:5 s" in str(shared.verdict())


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


def test_without_a_replay_nothing_is_recommended(comparison):
    failed = hd.Comparison(comparison.rows[3:4])
    assert explain_failure(failed)[0].startswith("No model can be recommended")
    assert "outcomes: too few samples" in explain_failure(failed)[0]


def test_the_forms_of_several_models_are_one_sentence(comparison):
    sound = Adequacy.judge({"K": ScoreTest(9.0, 10, 2000)}, {"K": 0.0}, {})
    lacking = Adequacy.judge({"K": ScoreTest(210.0, 10, 2000, ("K_p|u|",))}, {"K": 0.0}, {})
    forms = (lacking, None, sound)
    rows = tuple(
        replace(row, fit=replace(row.fit, adequacy=form))
        for row, form in zip(comparison.rows[:3], forms, strict=True)
    )
    sentence = "Forms by score tests: adequate uncoupled; effective linear."
    assert [*remarks(Comparison(rows))].count(sentence) == 1
    assert not any("Forms by" in each for each in remarks(Comparison(rows[:1])))
