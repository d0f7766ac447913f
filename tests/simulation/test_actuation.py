"""The actuation as channels of terms."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.simulation.actuation import actuation, with_gains

LINEAR = hd.catalog["linear"]


def test_a_gain_in_a_model_is_a_gain_of_the_recorded_wrench(vehicle, exact_log, tmp_path):
    """Twice the wrench less one wrench is the wrench, held or between two samples."""
    truth = hd.Damping.from_dict(LINEAR, dict.fromkeys(LINEAR.labels, 0.0) | {"X_u": -8.0})
    log = exact_log(truth).between(0.0, 5.0)
    doubled = replace(log, wrench=2.0 * log.wrench)
    freed = with_gains(vehicle, doubled, LINEAR)
    values = dict.fromkeys(freed.labels, 0.0) | {"X_u": -8.0}
    values |= {
        label: -0.5 for label in freed.labels if "_actuation_" in label and "rise" not in label
    }
    hd.write_damping(hd.Damping.from_dict(freed, values), tmp_path / "freed.json")
    damping = hd.read_damping(tmp_path / "freed.json")
    held = hd.simulate(vehicle, damping, doubled).velocity
    values |= {label: -0.25 for label in values if "_rise_" in label}
    middle = hd.simulate(vehicle, hd.Damping.from_dict(freed, values), doubled).velocity
    right = hd.simulate(vehicle, truth, log).velocity
    assert np.nanmax(abs(middle - right)) < 0.1 * np.nanmax(abs(held - right))


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
    assert problem.columns.channels[-1] == "actuation_rise_Y"
    assert problem.inputs.channels[:, -1].tolist() == [1.0, 0.0, -2.0, 0.0]
    assert [label for label in freed.labels if "_actuation_" in label][:2] == [
        "X_actuation_X",
        "X_actuation_rise_X",
    ]


def test_without_a_known_wrench_there_is_no_gain(vehicle):
    log = hd.Log(
        time=np.arange(3.0),
        velocity=np.ones((3, 6)),
        commands=np.ones((3, 1)),
        command_names=("stick",),
    )
    with pytest.raises(hd.ProblemError, match="no gain can be free"):
        with_gains(vehicle, log, LINEAR)
    sticks = LINEAR.with_terms({"X": "stick", "Y": "actuation_Y"})
    with pytest.raises(hd.ProblemError, match="no command 'actuation_Y', which a term uses"):
        hd.prepare(vehicle, log, sticks)
