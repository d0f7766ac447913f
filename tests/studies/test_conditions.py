"""The studies' own conditions: colour as stated, streams apart, what an accelerometer adds."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from conditions import COLOURED, accelerated, training_pushes
from hydrodamp.simulation.campaign.conditions import WHITE_NOISE, Conditions


def autocorrelation(series, lag):
    """Of series of mean zero, shape (n, n_runs, n_columns), averaged over runs."""
    return (series[lag:] * series[:-lag]).mean(axis=(0, 1)) / (series**2).mean(axis=(0, 1))


@pytest.mark.parametrize(("period", "lag"), [(0.1, 1), (0.1, 2), (0.1, 5), (0.02, 10)])
def test_coloured_errors_forget_as_stated(period, lag):
    """Autocorrelation exp(-lag / time): DVL 0.4 s, gyro 0.1 s, attitude 0.5 s, depth 0.4 s."""
    times = np.array([0.4] * 3 + [0.1] * 3 + [0.5] * 3 + [0.4])
    errors = COLOURED.sample_sensor_errors(7, n_runs=6, n_samples=20000, period=period)
    forgotten = np.exp(-period * lag / times)
    np.testing.assert_allclose(autocorrelation(errors, lag), forgotten, atol=0.025)


def test_pushes_are_as_strong_and_last_as_stated():
    """Autocorrelation exp(-1/2) after one second, correlated on no two axes."""
    pushes = COLOURED.sample_disturbances(8, n_runs=6, n_samples=40000)
    np.testing.assert_allclose(pushes.std(axis=(0, 1)), COLOURED.push, rtol=0.03)
    np.testing.assert_allclose(autocorrelation(pushes, 10), np.exp(-0.5), atol=0.025)
    correlation = np.corrcoef(pushes.reshape(-1, 6).T) - np.eye(6)
    assert np.max(np.abs(correlation)) < 0.06


@pytest.mark.parametrize(
    "draw",
    [WHITE_NOISE.sample_sensor_errors, COLOURED.sample_sensor_errors, COLOURED.sample_disturbances],
)
@pytest.mark.parametrize(("n_runs", "n_samples"), [(2, 50), (6, 20)])
def test_beginning_of_a_run_depends_on_its_seed_alone(draw, n_runs, n_samples):
    """Fewer runs or samples cut the same streams short."""
    np.testing.assert_array_equal(draw(9, n_runs, n_samples), draw(9, 6, 50)[:n_samples, :n_runs])
    assert not np.any(draw(8, n_runs, n_samples) == draw(9, n_runs, n_samples))


def test_levels_are_those_of_white_errors():
    white, coloured = (one.sample_sensor_errors(5, 6, 10000) for one in (WHITE_NOISE, COLOURED))
    np.testing.assert_allclose(coloured.std(axis=(0, 1)), white.std(axis=(0, 1)), rtol=0.03)


def test_pushes_stand_in_equation_1():
    campaign = hd.reenact(5, duration=5.0, conditions=COLOURED)
    calm = hd.reenact(5, duration=5.0, conditions=replace(COLOURED, push=(0.0,) * 6))
    pushes = training_pushes(campaign, 5, COLOURED)
    assert pushes.any()
    first = campaign.exact_train.acceleration[0] - calm.exact_train.acceleration[0]
    pushed = campaign.vehicle.mass_matrix @ first
    np.testing.assert_allclose(pushed, pushes[0], atol=1e-9)


def test_accelerometers_change_nothing_else():
    """The translational acceleration is the exact one but for the noise of all that is in it."""
    plain = hd.reenact(seed=3, duration=30.0)
    one = accelerated(plain, 3, 1.0)
    bare = replace(one.train, acceleration=None, specific_force=None)
    np.testing.assert_array_equal(bare.velocity, plain.train.velocity)
    assert np.isnan(one.test.acceleration[:, 3:]).all()
    noise = one.train.acceleration[:, :3] - one.exact_train.acceleration[:, :3]
    assert np.all((noise.std(axis=0) > 1.9e-3) & (noise.std(axis=0) < 5e-3))
    silent = hd.reenact(1, duration=5.0, conditions=Conditions(0.0))
    still, exact = accelerated(silent, 1, 0.0), silent.exact_train.acceleration
    np.testing.assert_allclose(still.train.acceleration[:, :3], exact[:, :3], atol=1e-12)
