import dataclasses
from functools import partial

import numpy as np
import pytest
from scipy.signal import savgol_filter

import hydrodamp as hd
import oracle
from hydrodamp.conditioning import derivatives
from hydrodamp.conditioning.derivatives import rates_from_attitude, velocity_from_position
from hydrodamp.data.attitude import quaternion_from_euler, rotation_matrices
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError, ProblemError
from hydrodamp.ingest.inspection.quality_report import report_quality


def motion(time):
    """Rolling over and over while pitching and yawing."""
    euler = np.column_stack((0.9 * time, 0.6 * np.sin(0.8 * time), 2 * np.sin(0.3 * time)))
    slopes = np.column_stack((0.9 + 0 * time, 0.48 * np.cos(0.8 * time), 0.6 * np.cos(0.3 * time)))
    return quaternion_from_euler(euler), oracle.body_rates(euler, slopes)


@pytest.mark.parametrize("irregular", [False, True])
def test_a_tumbling_vehicle(irregular):
    rng = np.random.default_rng(1)
    steps = rng.uniform(0.02, 0.08, 600) if irregular else np.full(600, 0.05)
    time = np.cumsum(steps)
    attitude, rates = motion(time)
    signs = rng.choice([-1.0, 1.0], size=(600, 1))
    log = Log.from_arrays(time, {"u": np.ones(600)}, attitude=signs * attitude)
    made = rates_from_attitude(log, seconds=0.2)
    assert made.velocity_names == ("u", "p", "q", "r")
    np.testing.assert_allclose(made.velocity[3:-3, 3:], rates[3:-3], atol=5e-3)
    assert made.notes == ("derived: `p q r` from attitude, by local quadratics over 5 samples",)


def test_what_is_recorded_stays_unless_named():
    time = np.arange(0, 10, 0.1)
    attitude, _ = motion(time)
    recorded = {"p": 7 + 0 * time, "q": 0 * time, "r": 0 * time}
    log = Log.from_arrays(time, recorded, attitude=attitude)
    assert rates_from_attitude(log) is log
    made = rates_from_attitude(log, ["q"])
    assert (made.velocity[:, 3] == 7).all()
    assert np.ptp(made.velocity[:, 4]) > 0.1


@pytest.mark.parametrize("angle", [0, 1])
def test_the_rate_of_a_constant_angle_is_recorded_or_not_measured(angle, refused):
    """Turns of the other angles give body rates along its axis, which no sensor confirms."""
    time = np.arange(0, 60, 0.1)
    euler = np.column_stack((0.4 * np.sin(0.9 * time), 0.4 * np.sin(0.5 * time), 0.6 * time))
    euler[:, angle] = 0.0
    moves = {"u": np.sin(time), "v": np.cos(time), "w": np.sin(0.7 * time)}
    log = Log.from_arrays(time, moves, attitude=euler, wrench=np.zeros((600, 6)))
    made, name = rates_from_attitude(log), "pq"[angle]
    assert made.velocity_names == (*"uvw", *"pqr".replace(name, ""))
    assert {*derivatives.constant_angles(made, name)} < {*report_quality(made).missing}
    vehicle = dataclasses.replace(hd.fleet["vt690"], actuators=())
    refused(ProblemError, hd.prepare, vehicle, made, hd.catalog["linear"])
    fewer = dataclasses.replace(vehicle, axes=tuple("XYZKMN".replace("KM"[angle], "")))
    assert hd.prepare(fewer, log, hd.catalog["linear"]).n_samples == 600
    rates = dict(zip("pqr", made.velocity.T[3:], strict=True)) | {name: np.sin(1.1 * time)}
    gyro = Log.from_arrays(time, moves | rates, attitude=euler, wrench=np.zeros((600, 6)))
    assert rates_from_attitude(gyro) is gyro
    assert not hd.check_quality(gyro)
    assert hd.prepare(vehicle, gyro, hd.catalog["linear"]).n_samples == 600


def helix(seed=None):
    """A climbing turn; returns what a sensor would have measured too."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(np.full(500, 0.1) if seed is None else rng.uniform(0.05, 0.15, 500))
    euler = np.column_stack((0.2 * np.sin(time), -0.3 + 0 * time, 0.25 * time))
    attitude = quaternion_from_euler(euler)
    place = np.column_stack((4 * np.sin(0.25 * time), -4 * np.cos(0.25 * time), -0.2 * time))
    speed = np.column_stack((np.cos(0.25 * time), np.sin(0.25 * time), -0.2 + 0 * time))
    body = np.einsum("nji,nj->ni", rotation_matrices(attitude), speed)
    log = Log.from_arrays(time, {"r": 0 * time}, attitude=attitude, position=place)
    return log, body


@pytest.mark.parametrize("seed", [None, 1])
def test_the_way_made_is_found_in_body_axes(seed):
    log, body = helix(seed)
    made = velocity_from_position(log, seconds=0.5)
    assert made.velocity_names == ("u", "v", "w", "r")
    np.testing.assert_allclose(made.velocity[:, :3], body, atol=3e-3)
    np.testing.assert_array_equal(made.velocity[:, 3:], log.velocity[:, 3:])
    assert made.notes[-1].startswith("derived: `u v w` over ground from position")


def test_a_planar_log_gets_no_heave():
    log, _ = helix()
    flat = dataclasses.replace(log, position=log.position * (1, 1, 0))
    made = velocity_from_position(flat)
    assert made.velocity_names == ("u", "v", "r")
    assert velocity_from_position(made) is made


def test_a_depth_alone_gives_no_horizontal_velocity():
    log, _ = helix()
    made = velocity_from_position(dataclasses.replace(log, position=log.position * (0, 0, 1)))
    assert made.velocity_names == ("w", "r")


STEP = 1e-3


def swinging(arm):
    """A vehicle that moves on every axis, an accelerometer aside, and the true derivative.

    Oracle: the position of the accelerometer differenced twice, gravity taken off.
    """
    time = np.arange(0.0, 6.0, STEP)
    euler = np.sin(np.outer(time, (1.1, 0.7, 0.5))) * (0.4, 0.3, 0.8)
    place = np.column_stack((np.sin(0.9 * time), 0.5 * np.cos(time), 0.3 * np.sin(0.6 * time)))
    attitude = quaternion_from_euler(euler)
    turned = rotation_matrices(attitude)
    sensor = place + turned @ np.array(arm)
    falling = np.gradient(np.gradient(sensor, STEP, axis=0), STEP, axis=0)
    force = np.einsum("nji,nj->ni", turned, falling - (0, 0, derivatives.GRAVITY))
    speed = np.einsum("nji,nj->ni", turned, np.gradient(place, STEP, axis=0))
    wheel = np.einsum("nji,njk->nik", turned, np.gradient(turned, STEP, axis=0))
    rates = np.column_stack((wheel[:, 2, 1], wheel[:, 0, 2], wheel[:, 1, 0]))
    velocity = np.column_stack((speed, rates))
    true = np.gradient(velocity, STEP, axis=0)
    rows = slice(10, -10, 20)
    log = Log(time[rows], velocity[rows], attitude=attitude[rows], specific_force=force[rows])
    return log, true[rows]


@pytest.mark.parametrize("arm", [(0.0, 0.0, 0.0), (0.6, -0.2, 0.1)])
def test_equation_1_gives_the_derivative_at_the_reference_point(arm):
    log, true = swinging(arm)
    made = derivatives.acceleration_from_accelerometer(log, arm, seconds=0.1)
    assert made.acceleration is not None
    np.testing.assert_allclose(made.acceleration[5:-5], true[5:-5], atol=2e-3)


ACCELERATIONS = derivatives.acceleration_from_accelerometer
LACKING = {rates_from_attitude: ["attitude"], velocity_from_position: ["position", "attitude"]}
LACKING[ACCELERATIONS] = ["specific_force", "attitude"]
WRONG = [partial(rates_from_attitude, names=["u", "r"]), partial(velocity_from_position, names="p")]
WRONG += [partial(ACCELERATIONS, lever_arm=arm) for arm in ((1, 2), "abc")]
CALLS = [(step, name) for step, names in LACKING.items() for name in names]


@pytest.mark.parametrize(("step", "lacking"), [*CALLS, *((step, "") for step in WRONG)])
def test_what_is_lacking_or_wrong_is_named(step, lacking, refused):
    zeros = dict.fromkeys(("position", "specific_force"), np.zeros((2, 3)))
    log = Log([0.0, 1.0], np.ones((2, 6)), attitude=[[1, 0, 0, 0]] * 2, **zeros)
    without = {lacking: None} if lacking else {}
    refused(LogError, lambda: step(dataclasses.replace(log, **without)))


def test_an_even_clock_gives_savitzky_and_golay():
    """Oracle: scipy.signal.savgol_filter."""
    values, bounds = np.random.default_rng(2).normal(size=60), np.array([[0, 60]])
    differences = derivatives.differences_from_centre(values[:, np.newaxis])
    fit = derivatives.fit_local_polynomials(np.arange(60) / 10, bounds, differences, 9)
    slope = savgol_filter(values, 9, 2, deriv=1, delta=0.1)
    np.testing.assert_allclose(fit.slope[:, 0], slope, atol=1e-9)
    np.testing.assert_allclose(fit.value[:, 0] + values, savgol_filter(values, 9, 2), atol=1e-9)
