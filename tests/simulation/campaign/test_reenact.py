"""The campaign as logs."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
import oracle
from hydrodamp.errors import MethodError
from hydrodamp.simulation.campaign.conditions import WHITE_NOISE, Conditions, true_damping
from hydrodamp.simulation.campaign.reenact import CampaignSetup


@pytest.mark.slow
def test_logs_have_a_segment_a_run_and_three_commands(campaign):
    """Four runs and three joins to train on, two runs to test on, 10 Hz."""
    names = [segment.name for segment in campaign.train.segments]
    assert names == ["depth-2600", "yaw-1800", "yaw-2133", "yaw-2600"]
    assert [segment.name for segment in campaign.test.segments] == ["depth-2133", "yaw-2350"]
    for log in (campaign.train, campaign.test):
        assert log.command_names == ("rudder", "elevator", "rpm")
        assert log.acceleration is None
        assert all(len(segment) == 301 for segment in log.segments)
        assert np.all(np.diff(log.time) > 0.0)
    first = campaign.train.segments[0]
    np.testing.assert_allclose(np.diff(campaign.train.time[first.start : first.stop]), 0.1)
    assert campaign.truth == "sname"
    assert "K_up" in campaign.note


@pytest.mark.slow
def test_measured_log_is_the_exact_one_with_published_noise(campaign):
    """0.0133 m/s of the DVL, 8.7e-4 rad/s of the gyro; each run has its own errors."""
    noise = campaign.train.velocity - campaign.exact_train.velocity
    errors = WHITE_NOISE.sample_sensor_errors(3, 6, 301)[:, :4, :6]
    np.testing.assert_allclose(noise, np.concatenate([*errors.swapaxes(0, 1)]), atol=1e-12)
    np.testing.assert_allclose(noise[:, :3].std(axis=0), 0.0133, rtol=0.1)
    np.testing.assert_allclose(noise[:, 3:].std(axis=0), 8.7e-4, rtol=0.1)
    np.testing.assert_array_equal(campaign.train.commands, campaign.exact_train.commands)


@pytest.mark.slow
def test_same_arguments_same_campaign():
    """Determinism by seed, bit for bit; another seed is another campaign."""
    first, again, other = (hd.reenact(seed, duration=5.0) for seed in (3, 3, 4))
    for name in ("train", "test", "exact_train", "exact_test"):
        one, two = getattr(first, name), getattr(again, name)
        np.testing.assert_array_equal(one.velocity, two.velocity)
    assert not np.array_equal(first.train.commands, other.train.commands)


@pytest.mark.slow
@pytest.mark.parametrize("truth", ["sname", "crossflow"])
def test_every_run_is_under_control(truth):
    """Speed near 0.001 rpm, roll small, drift a few degrees, fins within 20 degrees."""
    campaign = hd.reenact(seed=0, truth=truth, duration=60.0)
    for log in (campaign.exact_train, campaign.exact_test):
        check_control(log)


def check_control(log):
    """Assert that a vehicle never left its operating range."""
    surge = log.velocity[:, 0]
    cruise = 0.001 * log.command("rpm")
    assert np.all((surge > 0.85 * cruise) & (surge < 1.02 * cruise))
    assert np.max(np.abs(np.degrees(np.arctan2(log.velocity[:, 1:3], surge[:, None])))) < 8.0
    assert np.max(np.abs(np.degrees(np.arcsin(log.down[:, 1])))) < 6.0
    assert np.max(np.abs(np.degrees(np.arcsin(log.down[:, 0])))) < 22.0
    fins = np.column_stack((log.command("rudder"), log.command("elevator")))
    assert np.max(np.abs(fins)) <= np.radians(20.0)


@pytest.mark.parametrize(
    "arguments", [{"truth": "snam"}, {"seed": -1}, {"duration": 0.5}, {"duration": np.nan}]
)
def test_impossible_arguments_are_refused(arguments, refused):
    """With what is required and what was got."""
    refused(MethodError, hd.reenact, **arguments)


@pytest.mark.slow
def test_side_by_side_or_one_by_one():
    """Campaigns of several seeds at once are those of each seed, to rounding."""
    together = CampaignSetup.of("sname").simulate([3, 4], 10.0, WHITE_NOISE)
    for seed, one in zip((3, 4), together, strict=True):
        alone = hd.reenact(seed, duration=10.0)
        for name in ("train", "test", "exact_train", "exact_test"):
            velocity = getattr(one, name).velocity
            np.testing.assert_allclose(velocity, getattr(alone, name).velocity, atol=1e-9)


@pytest.mark.slow
def test_a_plan_sails_at_the_rate_of_its_autopilot():
    """Commands five times as often, samples likewise; the motion is nearly the same."""
    plan = CampaignSetup.of("sname")
    fast = replace(plan, period=0.02, training_runs=plan.training_runs[1:2])
    (ten,), (fifty,) = (one.simulate((0,), 8.0, Conditions(0.0)) for one in (plan, fast))
    assert fifty.train.n == 401
    assert [segment.name for segment in fifty.train.segments] == ["yaw-1800"]
    np.testing.assert_allclose(np.diff(fifty.train.time), 0.02)
    same = ten.exact_train.select("yaw-1800").velocity
    np.testing.assert_allclose(fifty.exact_train.velocity[::5], same, atol=0.01)


@pytest.mark.slow
def test_exact_log_satisfies_equation_1():
    """M dnu/dt = H(M nu) nu + tau + known + pushes, each part by the project's own means."""
    campaign = hd.reenact(5, duration=10.0)
    log, vehicle = campaign.exact_test, campaign.vehicle
    commands = {name: log.command(name) for name in log.command_names}
    expected = oracle.coriolis(vehicle.mass_matrix, log.velocity)
    expected += true_damping().wrench(log.velocity)
    expected += vehicle.known_wrench(log.velocity, log.down, commands)
    np.testing.assert_allclose(log.acceleration @ vehicle.mass_matrix, expected, atol=1e-9)
