from dataclasses import replace

import numpy as np

import hydrodamp as hd
from hydrodamp.identification.adequacy import Adequacy, ScoreTest
from hydrodamp.report.narrative import explain_failure, remarks
from hydrodamp.validation.compare import Comparison


def test_an_unfinished_comparison_says_so(comparison, snapshot):
    lacking = replace(comparison, provenance={"unfinished": "7 of 9 rows: interrupted"})
    shared = replace(comparison, provenance={"overlap": "0:5 s"})
    failed = hd.Comparison(comparison.rows[3:4])
    texts = (*remarks(lacking), str(shared.verdict()), *explain_failure(failed))
    assert "\n".join(texts) == snapshot


def test_beyond_the_training_and_feeding_are_told_of_chosen_and_lost_rows(comparison, snapshot):
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
    alone = Comparison((replace(other, fit=fits[2]),))
    assert "\n".join([*remarks(Comparison(tuple(rows))), *remarks(alone)]) == snapshot


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
