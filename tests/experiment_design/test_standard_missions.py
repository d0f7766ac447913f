"""Predicted errors of standard missions: only what a fit determines is trusted."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.experiment_design.context import limit_by_log
from hydrodamp.experiment_design.standard_missions import (
    UNSTABLE,
    describe_missions,
    predict_missions,
)
from value_changes import set_values


@pytest.fixture
def fit(boat, known):
    """Coefficients with standard errors of one per cent."""
    known = replace(known, covariance=np.diag((0.01 * known.coefficients) ** 2))
    ranges = {"u": (0.8, 1.6), "v": (-0.3, 0.3), "r": (-0.3, 0.3)}
    return hd.Fit(known, "oe", hd.Status.OK, vehicle=boat, training_range=ranges)


@pytest.mark.slow
def test_speeds_are_those_of_the_log_and_beyond(fit):
    missions = predict_missions(fit)
    assert {each.kind for each in missions} == {"heading"}  # a boat does not dive
    speeds = [each.speed for each in missions]
    np.testing.assert_allclose(speeds, [0.68, 0.8, 1.2, 1.6, 1.84])
    assert [each.is_inside for each in missions] == [False, True, True, True, False]
    # At speed the boat is unstable without its autopilot, so errors grow exponentially.
    assert [bool(each.untrusted) for each in missions] == [False] * 4 + [True]
    first, last = describe_missions(fit)
    assert first.startswith("Predicted error (95 %) of heading steps at 0.8 to 1.6 m/s: u ±")
    assert last.startswith("Do not trust heading steps at 1.8 m/s (v ±")
    assert "unstable there without its autopilot" in last
    assert [each.is_unstable for each in missions] == [False] * 3 + [True] * 2


@pytest.mark.slow
def test_steps_are_within_the_motion_of_the_log(fit):
    calm = replace(fit, training_range={"u": (0.8, 1.6), "v": (-0.1, 0.1), "r": (-0.05, 0.05)})
    for small, large in zip(predict_missions(calm), predict_missions(fit), strict=True):
        assert small.motion["r"] < np.degrees(0.05) < large.motion["r"] < np.degrees(0.3)


@pytest.mark.slow
def test_the_error_of_a_form_is_named_first_even_where_nothing_is_trusted(fit):
    wrong = replace(fit, form_errors={"Y": (0.5, 1.0, 0.1), "N": (0.5, 1.0, 0.1)})
    first, *further = describe_missions(wrong)
    assert first.startswith("Predicted error (95 %): larger than the motion")
    ends = "m/s): record them at that speed."
    assert any(text.endswith(ends) or UNSTABLE in text for text in further)


@pytest.mark.slow
def test_the_error_is_in_proportion_to_the_standard_errors(fit):
    twice = replace(fit, damping=replace(fit.damping, covariance=4.0 * fit.damping.covariance))
    for small, large in zip(predict_missions(fit), predict_missions(twice), strict=True):
        assert large.half_width["r"] == pytest.approx(2.0 * small.half_width["r"])


@pytest.fixture
def loose(fit):
    """A fit of which the log does not determine N_ur."""
    index = fit.model.index("N_ur")
    wide = (index, index), (10.0 * fit.damping["N_ur"]) ** 2
    return replace(fit, damping=set_values(fit.damping, "covariance", wide))


@pytest.mark.slow
def test_an_undetermined_coefficient_is_not_trusted(loose):
    assert all("r" in each.untrusted for each in predict_missions(loose))
    assert any(text.startswith("Do not trust heading") for text in describe_missions(loose))


def test_without_vehicle_or_speed_the_reason_is_given(fit):
    astern = replace(fit, training_range={"u": (-1.0, 1.0)})
    passive = replace(fit, vehicle=replace(fit.vehicle, actuators=()))
    for nothing, reason in (
        (replace(fit, vehicle=None), "no vehicle"),
        (astern, "surge is about zero or astern"),
        (passive, "cannot be steered: it has no actuators"),
    ):
        (text,) = describe_missions(nothing)
        assert text.startswith("Errors of other missions are not predicted: ")
        assert reason in text


def test_commands_without_limits_keep_to_their_range_in_the_log(fit):
    rudder = next(item for item in fit.vehicle.actuators if isinstance(item, hd.Fin))
    others = [item for item in fit.vehicle.actuators if item is not rudder]
    boat = replace(fit.vehicle, actuators=(*others, replace(rudder, limit=None)))
    known = replace(fit, vehicle=boat, command_range={rudder.command: (-0.3, 0.2)})
    limits = limit_by_log(boat, hd.Envelope(), known).commands
    assert (limits[rudder.command].lowest, limits[rudder.command].highest) == (-0.3, 0.2)
    assert limit_by_log(fit.vehicle, hd.Envelope(), known).commands == {}  # the vehicle's


def test_speeds_of_a_dive_are_those_of_the_log_of_the_fit(fit):
    hovering = replace(fit, training_range={"u": (-0.7, 0.7)})
    assert limit_by_log(fit.vehicle, hd.Envelope(), hovering).speed == (0.0, 0.7)
    stated = hd.Envelope(speed=(0.2, 0.4))
    assert limit_by_log(fit.vehicle, stated, hovering).speed == (0.2, 0.4)
