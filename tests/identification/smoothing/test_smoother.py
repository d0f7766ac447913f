"""Smoothing: kinematics, covariance of the steps, the most probable motion, noise levels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import least_squares

import hydrodamp as hd
from hydrodamp.data.attitude import quaternion_from_euler, turn
from hydrodamp.identification.smoothing.noise import Noise, sensor_noise
from hydrodamp.identification.smoothing.smoother import Pass, noise_levels, smooth
from hydrodamp.identification.smoothing.track import Track, turned
from hydrodamp.identification.smoothing.transition import Steps, accelerations, transitions

LEVELS = Noise([0.01, 0.02, 0.01, 1e-3, 2e-3, 1e-3], [1e-4] * 3, [1.0, 0.5, 2.0, 0.1, 0.2, 0.3])


@pytest.fixture(scope="module")
def campaign() -> hd.Campaign:
    return hd.reenact(seed=3, duration=20.0)


@pytest.fixture(scope="module")
def damping(campaign) -> hd.Damping:
    """The truth, from exact accelerations: Prestero's terms and K_up."""
    model = hd.catalog["prestero"].with_terms({"K": "up"})
    return hd.identify(model, campaign.vehicle, campaign.exact_train, hd.LeastSquares()).damping


def short(log: hd.Log, n: int = 8) -> hd.Log:
    """The first samples of the first two segments, on an irregular clock."""
    log = log.select(*[part.name for part in log.segments[:2]])
    spans = [log.elapsed[part.start] for part in log.segments]
    parts = [log.between(start, start + n / 10 - 0.05) for start in spans]
    jitter = np.random.default_rng(0).uniform(-0.03, 0.03, 2 * n)
    cut = hd.concatenate(parts)
    return replace(cut, time=cut.time + jitter)


def random_track(problem: hd.Problem, size: float, seed: int = 1) -> Track:
    rng = np.random.default_rng(seed)
    shift = rng.normal(size=(problem.n_samples, 9)) * size
    return Track(problem.inputs.velocity + shift[:, :6], shift[:, 6:])


def test_a_turn_is_found_again():
    rng = np.random.default_rng(5)
    attitude = quaternion_from_euler(rng.uniform(-1.0, 1.0, (50, 3)))
    vectors = rng.normal(size=(50, 3))
    np.testing.assert_allclose(turn(attitude, turned(attitude, vectors)), vectors, atol=1e-12)


def test_steps_never_cross_a_join(campaign):
    problem = hd.prepare(campaign.vehicle, short(campaign.train), hd.catalog["fossen"])
    steps = Steps.of(problem)
    assert steps.first.tolist() == [*range(7), *range(8, 15)]
    assert steps.joined.tolist() == [True] * 6 + [False] + [True] * 6
    assert steps.width == 9


def sloped(problem, damping, track, direction):
    """The slope of the defect in a direction, and its central difference."""
    steps, matrix = Steps.of(problem), problem.matrix(damping)
    ends = [
        Track(track.velocity + way * direction[:, :6], track.turn + way * direction[:, 6:])
        for way in (1e-5, -1e-5)
    ]
    high, low = (transitions(problem, steps, matrix, end).defect for end in ends)
    slope = transitions(problem, steps, matrix, track).at_steps(direction)
    return slope, (high - low) / 2e-5


def test_slopes_by_velocity_are_those_of_the_defect(campaign, damping):
    problem = hd.prepare(campaign.vehicle, short(campaign.train), damping.model)
    direction = np.random.default_rng(2).normal(size=(problem.n_samples, 9)) * ([1] * 6 + [0] * 3)
    slope, found = sloped(problem, damping, random_track(problem, 1e-3), direction)
    np.testing.assert_allclose(slope[:, :6], found[:, :6], rtol=1e-6, atol=1e-5)
    # Rates turn the attitude by their mean; the curvature of the rates is left out.
    bend = np.abs(slope[:, 6:] - found[:, 6:])
    assert bend.max() < 0.1 * np.abs(slope[:, 6:]).max()


def test_slopes_by_turn_are_those_of_the_defect(campaign, damping):
    """To first order in the turn of a step, here some 0.01 rad; gravity's share is left out."""
    problem = hd.prepare(campaign.vehicle, short(campaign.train), damping.model)
    direction = np.random.default_rng(3).normal(size=(problem.n_samples, 9)) * ([0] * 6 + [1] * 3)
    slope, found = sloped(problem, damping, random_track(problem, 1e-3), direction)
    # Gravity bends the rates, too: by h/12 of W z_G / I, below 0.1 of the 10 1/s of a turn.
    np.testing.assert_allclose(slope[:, 6:], found[:, 6:], rtol=0, atol=0.1)


def test_at_samples_is_the_transpose_of_at_steps(campaign, damping):
    problem = hd.prepare(campaign.vehicle, short(campaign.train), damping.model)
    steps, rng = Steps.of(problem), np.random.default_rng(4)
    here = transitions(problem, steps, problem.matrix(damping), Track.recorded(problem))
    errors, weights = rng.normal(size=(16, 9)), rng.normal(size=(steps.n, 9))
    left, right = here.at_steps(errors) * weights, errors * here.at_samples(weights, 16)
    assert left.sum() == pytest.approx(right.sum(), rel=1e-12)


def test_an_exact_motion_lacks_nothing(campaign, damping):
    """Neither in equation 1, nor, to the fifth order of the step, in the kinematics."""
    problem = hd.prepare(campaign.vehicle, campaign.exact_train, damping.model)
    steps, matrix = Steps.of(problem), problem.matrix(damping)
    defect = transitions(problem, steps, matrix, Track.recorded(problem)).defect
    noisy = hd.prepare(campaign.vehicle, campaign.train, damping.model)
    other = transitions(noisy, steps, matrix, Track.recorded(noisy)).defect
    assert np.all(np.abs(defect[:, 6:]).max(axis=0) < 1e-2 * other[:, 6:].std(axis=0))
    assert np.all(defect[:, :6].std(axis=0) < 0.2 * other[:, :6].std(axis=0))


def dense_covariance(here: Pass) -> np.ndarray:
    steps = here.linear.steps
    size = here.problem.n_samples * steps.width
    unit = np.eye(size).reshape(size, here.problem.n_samples, steps.width)
    spread = np.stack([here.linear.at_steps(one).ravel() for one in unit], axis=1)
    variance = np.tile(here.noise.of_samples(steps), here.problem.n_samples)
    density = np.zeros((steps.n, steps.width))
    density[:, : len(steps.free)] = here.noise.of_steps(steps) / steps.length[:, None]
    return (spread * variance) @ spread.T + np.diag(density.ravel())


def test_the_banded_factor_is_the_dense_one(campaign, damping):
    problem = hd.prepare(campaign.vehicle, short(campaign.train), damping.model)
    steps, matrix = Steps.of(problem), problem.matrix(damping)
    here = Pass.along(problem, steps, matrix, Track.recorded(problem), LEVELS)
    covariance = dense_covariance(here)
    lower = cholesky(covariance, lower=True)
    rows = np.random.default_rng(6).normal(size=(steps.n * steps.width, 3))
    white = solve_triangular(lower, rows, lower=True)
    scale = np.abs(white).max()
    np.testing.assert_allclose(here.errors.whiten(rows), white, rtol=0, atol=1e-8 * scale)
    weighed = np.linalg.solve(covariance, rows)
    atol = 1e-7 * np.abs(weighed).max()
    np.testing.assert_allclose(here.errors.weigh(rows), weighed, rtol=0, atol=atol)
    expected = 2 * np.log(np.diag(lower)).sum()
    assert here.errors.log_determinant == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("cut", [2, 5, 13])
def test_rows_may_be_whitened_in_parts(campaign, damping, cut):
    problem = hd.prepare(campaign.vehicle, short(campaign.train), damping.model)
    steps, matrix = Steps.of(problem), problem.matrix(damping)
    errors = Pass.along(problem, steps, matrix, Track.recorded(problem), LEVELS).errors
    rows = np.random.default_rng(7).normal(size=(steps.n * steps.width, 2))
    place = cut * steps.width
    first = errors.whiten(rows[:place])
    second = errors.whiten(rows[place:], place, first)
    np.testing.assert_allclose(np.vstack([first, second]), errors.whiten(rows), rtol=1e-9)


def test_the_smoothed_log_is_the_most_probable_one(campaign, damping):
    """The oracle is scipy's Levenberg-Marquardt on the same departures, no attitude."""
    vehicle = replace(campaign.vehicle, axes=("X", "Y", "N"))
    log = replace(short(campaign.train), attitude=None)
    problem = hd.prepare(vehicle, log, damping.model)
    steps, matrix, free = Steps.of(problem), problem.matrix(damping), vehicle.free
    recorded = problem.inputs.velocity[:, free]
    density = LEVELS.disturbance[free] / np.sqrt(steps.length)[:, None]

    def departures(values):
        velocity = np.zeros((log.n, 6))
        velocity[:, free] = values.reshape(-1, 3)
        track = Track(velocity, np.zeros((log.n, 3)))
        asked = transitions(problem, steps, matrix, track).defect / density
        return np.concatenate(
            [
                ((recorded - velocity[:, free]) / LEVELS.velocity[free]).ravel(),
                asked.ravel(),
            ]
        )

    best = least_squares(departures, recorded.ravel(), method="lm", xtol=1e-12)
    smoothed = smooth(problem, damping, LEVELS)
    np.testing.assert_allclose(smoothed.velocity[:, free], best.x.reshape(-1, 3), rtol=0, atol=1e-6)
    assert smoothed.attitude is None
    np.testing.assert_array_equal(smoothed.velocity[:, ~free], log.velocity[:, ~free])


def test_a_loud_disturbance_leaves_the_record_as_it_is(campaign, damping):
    planar = replace(campaign.vehicle, axes=("X", "Y", "N"))
    problem = hd.prepare(planar, replace(campaign.train, attitude=None), damping.model)
    smoothed = smooth(problem, damping, LEVELS.disturbed(np.full(6, 1e6)))
    np.testing.assert_allclose(smoothed.velocity, campaign.train.velocity, rtol=0, atol=1e-4)


def test_noise_and_motion_are_found(campaign, damping):
    """The sensors' published levels, from 804 samples; a standard error is 2.5 % of them."""
    problem = hd.prepare(campaign.vehicle, campaign.train, damping.model)
    noise = noise_levels(problem, damping)
    np.testing.assert_allclose(noise.velocity, [0.01328] * 3 + [8.726e-4] * 3, rtol=0.08)
    np.testing.assert_allclose(noise.turn, [7.68e-5] * 3, rtol=0.08)
    smoothed = smooth(problem, damping, noise)
    exact = campaign.exact_train
    before = np.std(campaign.train.velocity - exact.velocity, axis=0)
    after = np.std(smoothed.velocity - exact.velocity, axis=0)
    assert np.all(after < [0.4, 0.4, 0.4, 0.7, 0.4, 0.4] * before)
    rest = smoothed.acceleration - exact.acceleration
    assert np.all(np.std(rest, axis=0) < 0.2 * np.std(exact.acceleration, axis=0))


def test_accelerations_are_those_of_equation_1(campaign, damping):
    """The campaign states its own; the coefficients are the truth's."""
    problem = hd.prepare(campaign.vehicle, campaign.exact_train, damping.model)
    every = np.arange(problem.n_samples)
    found = accelerations(problem, problem.matrix(damping), problem.inputs, every, every)
    np.testing.assert_allclose(found, campaign.exact_train.acceleration, rtol=0, atol=1e-9)


def test_sensor_noise_of_white_noise():
    """The standard error of the estimate is 1.5 % of it at 4000 samples."""
    rng = np.random.default_rng(8)
    velocity = rng.normal(size=(4000, 6)) * LEVELS.velocity
    log = hd.Log.from_arrays(np.arange(4000) / 10, velocity, wrench=np.zeros((4000, 6)))
    vehicle = replace(hd.fleet["vt690"], actuators=(), center_of_gravity=(0, 0, 0))
    level = replace(vehicle, weight=1.0, buoyancy=1.0)
    problem = hd.prepare(replace(level, axes=("X", "Y", "N")), log, hd.catalog["fossen"])
    found = sensor_noise(problem).velocity[[0, 1, 5]]
    np.testing.assert_allclose(found, LEVELS.velocity[[0, 1, 5]], rtol=0.06)


def test_two_samples_give_first_differences(campaign):
    """Half the squared difference is the variance of either."""
    log = campaign.train.between(0.0, 0.15)
    problem = hd.prepare(campaign.vehicle, log, hd.catalog["fossen"])
    expected = np.abs(np.diff(log.velocity, axis=0))[0] / np.sqrt(2.0)
    np.testing.assert_allclose(sensor_noise(problem).velocity, expected)


def test_noise_says_what_is_wrong():
    with pytest.raises(hd.MethodError, match="`velocity` must be positive"):
        Noise([0.0] * 6, [1.0] * 3, [0.0] * 6)
    with pytest.raises(hd.MethodError, match="`disturbance` must be zero or more"):
        Noise([1.0] * 6, [1.0] * 3, [-1.0] * 6)
    with pytest.raises(hd.MethodError, match="`turn` must have shape"):
        Noise([1.0] * 6, [1.0], [0.0] * 6)
    assert str(Noise([1.0] * 6, [1.0] * 3, [0.0] * 6)).endswith("disturbance none")


def test_a_model_that_runs_away_is_refused(campaign, damping):
    problem = hd.prepare(campaign.vehicle, short(campaign.train), damping.model)
    wild = hd.Damping(damping.model, np.full(damping.model.n_coefficients, 1e9))
    for verb in (noise_levels, smooth):
        with pytest.raises(hd.MethodError, match="runs away"):
            verb(problem, wild)
    with pytest.raises(hd.MethodError, match="runs away"):
        smooth(problem, wild, LEVELS)
