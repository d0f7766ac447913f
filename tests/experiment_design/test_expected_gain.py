"""The expected gain of a further dive over a log."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.experiment_design.plan import expected_gain


@pytest.fixture(scope="module")
def identified():
    campaign, model = hd.reenact(duration=40.0), hd.catalog["fossen"]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    fit = hd.WeakForm().identify(problem, model)
    return problem, fit, hd.grade_fit(problem, fit)


@pytest.mark.slow
def test_a_short_log_gains_from_a_planned_dive(identified):
    message = expected_gain(*identified)
    assert "`hydrodamp plan --damping FILE --duration 600`" in message
    reduction = int(message.partition("errors by ")[2].partition(" %")[0])
    assert 0 < reduction < 100


@pytest.mark.slow
def test_there_is_no_message_if_all_coefficients_are_determined(identified):
    problem, fit, grades = identified
    good = tuple(
        replace(axis, grades=(hd.Grade.DETERMINED,) * len(axis.labels)) for axis in grades.axes
    )
    assert expected_gain(problem, fit, replace(grades, axes=good)) == ""


def test_a_vehicle_without_actuators_gets_no_prediction(identified):
    problem, fit, grades = identified
    log = replace(
        problem.log,
        wrench=np.zeros((problem.log.n, 6)),
        command_names=(),
        commands=np.zeros((0, 0)),
    )
    bare = replace(problem.vehicle, actuators=())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", hd.HydrodampWarning)
        message = expected_gain(hd.prepare(bare, log, fit.model), fit, grades)
    assert "needs a vehicle that can be steered" in message
