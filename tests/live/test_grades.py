"""Grades of an estimate line are those of `identify`, from the same function."""

import pytest

import hydrodamp as hd
from hydrodamp.identification.grades import Grade
from hydrodamp.identification.identifiability import grade_fit
from hydrodamp.live.estimator import diagnostic_status
from hydrodamp.live.samples import rows_of
from live.conftest import MODEL, run_live

WORDS = [grade.word for grade in Grade]


@pytest.fixture(scope="module")
def line(reference):
    return reference["rls"].lines[-1]


@pytest.mark.slow
def test_a_cause_is_given_where_a_coefficient_is_not_determined_and_only_there(line):
    for one in line["coefficients"].values():
        assert (one["cause"] is not None) == (one["grade"] == "not determined")


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.slow
def test_nothing_is_determined_that_identify_does_not_determine(seed):
    campaign = hd.reenact(seed=seed, duration=200.0)
    line = run_live(rows_of(campaign.train), campaign.vehicle).lines[-1]
    problem = hd.prepare(campaign.vehicle, campaign.train, MODEL)
    wanted = grade_fit(problem, hd.RecursiveLeastSquares().identify(problem, MODEL)).grades
    found = {label: one["grade"] for label, one in line["coefficients"].items()}
    determined = {label for label, grade in found.items() if grade == "determined"}
    assert determined
    assert determined <= {label for label, grade in wanted.items() if grade is Grade.DETERMINED}
    apart = [abs(WORDS.index(found[label]) - WORDS.index(wanted[label].word)) for label in found]
    assert sum(apart) <= 0.5 * len(apart)


def test_nothing_is_determined_after_two_seconds(rows, run):
    early = run(rows[:21]).lines[-1]
    assert {one["grade"] for one in early["coefficients"].values()} <= {"weak", "not determined"}


def test_a_change_is_a_warning_of_the_diagnostics(line):
    assert not diagnostic_status(line)[0]
    alarm = line["alarm"] | {"last": {"time": 90.0, "since": 80.0, "axes": ["X"]}}
    is_warning, message, values = diagnostic_status(line | {"alarm": alarm})
    assert is_warning
    assert message.startswith("the vehicle has changed at about 80 s on X")
    assert values["determined"] in message
