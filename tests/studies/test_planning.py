"""The study of planned dives: true damping, and the table."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.experiment_design.autopilot_design import design_autopilot
from hydrodamp.experiment_design.closed_loop import ClosedLoopSimulator
from hydrodamp.experiment_design.ensemble import extended_model, prior_damping, sample_ensemble
from hydrodamp.simulation.campaign.reenact import CampaignSetup
from planning import DiveStatistics, compare, simulator_of_truth, table

AXES = np.array(["X", "Y"])


def statistics(errors):
    estimates = np.array([[0.0, 0.0], [2.0, 2.0]])
    return DiveStatistics(estimates, np.array(errors), np.array([0.1, 0.3]), 1.0)


def test_a_variance_four_times_smaller_is_a_gain_of_four():
    result = compare(np.ones(2), statistics([[1.0, 2.0]] * 2), statistics([[2.0, 4.0]] * 2), AXES)
    assert result["gain"] == pytest.approx(4.0)
    assert result["realised"] == {"X": 1.0, "Y": 2.0}
    assert result["gain of scatter"] == pytest.approx(1.0)
    assert result["replay"] == pytest.approx([0.2, 0.2])
    assert "| `key` | off | 1.00 2.00 | 4.0 4.0 | 4.0 |" in table({"key": {"off": result}})


def test_the_wrench_of_a_truth_is_that_of_the_campaign():
    vehicle, model = hd.fleet["vt690"], hd.catalog["fossen"]
    known = prior_damping(vehicle, model, None)
    sizes = np.zeros(extended_model(vehicle, model, known).n_coefficients)
    envelope = hd.Envelope()
    ensemble = sample_ensemble(vehicle, model, known, sizes, 1, 0)
    autopilot = design_autopilot(vehicle, known, envelope)
    closed_loop = ClosedLoopSimulator.of(vehicle, autopilot, envelope, ensemble)
    simulator, _ = simulator_of_truth(closed_loop, "drifting")
    velocity = np.array([[2.0, 0.2, -0.1, 0.0, 0.1, 0.2]])
    commands = np.array([[0.1, -0.1, 2000.0]])
    truth = CampaignSetup.of("crossflow").truth
    angles = truth.effective_fins(velocity, commands[:, :2])
    strips = truth.strips.wrench(velocity)
    # Y_uud = 9.0728 (vehicle file): u|u| = 4.
    sway = simulator.disturbance(velocity, commands)[0, 1] - strips[0, 1]
    assert sway == pytest.approx(4.0 * 9.0728 * (angles[0, 0] - 0.1))
    off, _ = simulator_of_truth(closed_loop, "off")
    assert off.disturbance(velocity, commands) == pytest.approx(np.zeros((1, 6)))
