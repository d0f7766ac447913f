"""What a planned dive would add to a log, told after the log was identified."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.experiment_design.outlook import expected_gain


@pytest.fixture(scope="module")
def found():
    campaign, model = hd.reenact(duration=40.0), hd.catalog["fossen"]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    fit = hd.WeakForm().identify(problem, model)
    return problem, fit, hd.grade_fit(problem, fit)


def test_a_log_of_few_minutes_leaves_something_to_add(found):
    told = expected_gain(*found)
    assert "coefficients are less than determined. A planned dive of ten minutes" in told
    assert "`hydrodamp plan --damping FILE --duration 600`" in told
    less = int(told.partition("errors ")[2].partition(" %")[0])
    assert 0 < less < 100


def test_where_all_is_determined_nothing_is_told(found):
    problem, fit, grades = found
    good = tuple(
        replace(one, grades=(hd.Grade.DETERMINED,) * len(one.labels)) for one in grades.axes
    )
    assert expected_gain(problem, fit, replace(grades, axes=good)) == ""


def test_a_vehicle_that_cannot_be_steered_gets_the_pointer_alone(found):
    problem, fit, grades = found
    log = replace(
        problem.log,
        wrench=np.zeros((problem.log.n, 6)),
        command_names=(),
        commands=np.zeros((0, 0)),
    )
    bare = replace(problem.vehicle, actuators=())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", hd.HydrodampWarning)
        told = expected_gain(hd.prepare(bare, log, fit.model), fit, grades)
    assert told.endswith("once it is known how the vehicle is steered.")
