"""The actuation as channels of terms."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import ProblemError
from hydrodamp.simulation.checks import actuation, with_gains

LINEAR = hd.catalog["linear"]


@pytest.mark.slow
def test_the_wrench_of_actuators_is_theirs_without_weight():
    campaign = hd.reenact(duration=10.0)
    heavy = replace(campaign.vehicle, weight=2.0 * campaign.vehicle.weight)
    commands = {name: campaign.train.command(name) for name in campaign.train.command_names}
    log = campaign.train
    known = heavy.known_wrench(log.velocity, log.down, commands)
    acting = known - heavy.restoring_wrench(log.down)
    np.testing.assert_allclose(actuation(heavy, log), acting, atol=1e-9)


def test_no_rise_reaches_across_a_join_and_locked_axes_have_no_gain(vehicle):
    log = hd.Log.from_arrays(
        [0.0, 0.1, 0.0, 0.1],
        np.ones((4, 6)),
        wrench=np.outer([1.0, 2.0, 7.0, 5.0], np.ones(6)),
        segment="aabb",
        attitude=np.zeros((4, 3)),
    )
    planar = replace(vehicle, axes=("X", "Y", "N"))
    freed = with_gains(planar, log, LINEAR)
    problem = hd.prepare(planar, log, freed)
    assert problem.equations.channels[-1] == "actuation_rise_Y"
    assert problem.inputs.channels[:, -1].tolist() == [1.0, 0.0, -2.0, 0.0]
    gains = [label for label in freed.labels if "_actuation_" in label]
    assert gains[:2] == ["X_actuation_X", "X_actuation_rise_X"]


def test_without_a_known_wrench_there_is_no_gain(vehicle, refused):
    log = hd.Log.from_arrays(np.arange(3.0), np.ones((3, 6)), commands={"stick": np.ones(3)})
    refused(ProblemError, with_gains, vehicle, log, LINEAR)
    sticks = LINEAR.with_terms({"X": "stick", "Y": "actuation_Y"})
    refused(ProblemError, hd.prepare, vehicle, log, sticks)
