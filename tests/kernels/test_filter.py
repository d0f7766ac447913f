"""The filtered replay against a Kalman filter in NumPy on one-step replays."""

from dataclasses import replace

import numpy as np
import pytest

from hydrodamp.kernels import core
from hydrodamp.kernels.kalman import Noise, filter_replay
from hydrodamp.kernels.plant import PlantSlopes

SEGMENTS = np.array([[0, 12], [13, 25]])
ENTRIES = np.array([0, 8, 6]), np.array([0, 1, 5])
FREE = (True,) * 6, (True, True, False, False, False, True)
SAMPLE_OF_ROW = np.delete(np.arange(25), 12)


def make_noise(free):
    """Pushes and errors of the size of the motion."""
    push = np.where(free, [4.0, 5.0, 5.0, 0.2, 1.0, 1.0], 0.0)
    return Noise(push, np.full(6, 0.05), np.linspace(0.2, 0.7, 6), 0.7, 0.1)


@pytest.fixture(params=FREE)
def case(request, make):
    rng = np.random.default_rng(5)
    plant, matrix = make.linear_plant(rng, request.param)
    inputs = make.inputs(rng, n=25)
    measured = inputs.velocity + 0.05 * rng.standard_normal((25, 6))
    return plant, matrix, inputs, measured, make_noise(request.param)


def reference(plant, matrix, inputs, measured, segment, noise):
    """Innovations over their factor, log of its diagonal and slopes, by the textbook recursion."""
    start, stop = segment
    free = np.flatnonzero(plant.free)
    f, p = len(free), len(ENTRIES[0])
    sensor, push = noise.sensor[free], noise.push[free]
    inverse = core.mass_inverse(plant)[np.ix_(free, free)]
    output = np.hstack([np.eye(f), np.zeros((f, f)), np.eye(f)])
    z, slopes = np.zeros(3 * f), np.zeros((3 * f, p + f))
    z[:f], slopes[:f, p:] = inputs.velocity[start, free], np.eye(f)
    covariance = np.diag(np.concatenate([np.zeros(f), push**2, sensor**2]))
    for k in range(start, stop):
        innovation_covariance = output @ covariance @ output.T + np.diag(1e-4 * sensor**2)
        factor = np.linalg.cholesky(innovation_covariance)
        error = measured[k, free] - output @ z
        yield (
            np.linalg.solve(factor, error),
            np.log(np.diag(factor)),
            np.linalg.solve(factor, output @ slopes),
        )
        gain = covariance @ output.T @ np.linalg.inv(innovation_covariance)
        z, slopes = z + gain @ error, slopes - gain @ output @ slopes
        covariance = covariance - gain @ output @ covariance
        if k + 1 == stop:
            return
        step = inputs.time[k + 1] - inputs.time[k]
        velocity = inputs.velocity[k : k + 2].copy()
        velocity[0, free] = z[:f]
        pair = inputs.select(np.arange(k, k + 2), velocity)
        moved, _, jacobian = core.replay(plant, matrix, pair, np.array([[0, 2]]), ENTRIES)
        columns = jacobian[1][free]
        transition = columns[:, p + free]
        by_push = (np.eye(f) + transition) @ inverse * step / 2
        decay = np.exp(-step / noise.time_constant)
        correlation = noise.correlation[free] ** (step / noise.step)
        matrices = np.zeros((3 * f, 3 * f))
        matrices[:f, : 2 * f] = np.hstack([transition, by_push])
        matrices[f:, f:] = np.diag(np.append(np.full(f, decay), correlation))
        process = np.append(push**2 * (1 - decay**2), sensor**2 * (1 - correlation**2))
        next_z = matrices @ z
        next_z[:f] = moved[1, free] + by_push @ z[f : 2 * f]
        slopes = matrices @ slopes
        slopes[:f, :p] += columns[:, :p]
        covariance = matrices @ covariance @ matrices.T
        covariance[f:, f:] += np.diag(process)
        z = next_z


def test_it_is_the_extended_kalman_filter(case):
    plant, matrix, inputs, measured, noise = case
    free, p = np.flatnonzero(plant.free), len(ENTRIES[0])
    innovations, log_std, slopes = filter_replay(
        plant, matrix, inputs, measured, SEGMENTS, noise, ENTRIES
    )
    expected = [
        row
        for segment in SEGMENTS
        for row in reference(plant, matrix, inputs, measured, segment, noise)
    ]
    found = innovations[:, free], log_std[:, free]
    for each, series in zip(zip(*expected, strict=True), found, strict=False):
        np.testing.assert_allclose(series[SAMPLE_OF_ROW], each, rtol=1e-9, atol=1e-9)
    columns = slopes[:, free][:, :, np.append(np.arange(p), p + free)]
    np.testing.assert_allclose(columns, [row[2] for row in expected], rtol=1e-9, atol=1e-9)


def test_a_parameter_that_is_a_coefficient_has_its_slopes(case):
    plant, matrix, inputs, measured, noise = case
    known, n = np.zeros((1, 3, 6)), inputs.n
    known[0, 2, 1] = 1.0
    slopes = PlantSlopes(
        np.zeros((1, 6, 6)), known, np.zeros((1, n, 6)), np.zeros((1, n, plant.n_channels))
    )
    arguments = plant, matrix, inputs, measured, SEGMENTS, noise, ([2], [1])
    *_, columns = filter_replay(*arguments, slopes=slopes)
    np.testing.assert_allclose(columns[:, :, 1], columns[:, :, 0], rtol=1e-9, atol=1e-12)


def test_without_pushes_the_innovations_are_those_of_the_open_loop(case):
    plant, matrix, inputs, measured, noise = case
    silent = replace(noise, push=np.zeros(6), correlation=np.zeros(6))
    innovations, *_ = filter_replay(plant, matrix, inputs, measured, SEGMENTS, silent)
    simulated, *_ = core.replay(plant, matrix, inputs, SEGMENTS)
    free = np.array(plant.free)
    residuals = (measured - simulated) / (0.05 * np.sqrt(1.0 + 1e-4))  # and its white share
    np.testing.assert_allclose(
        innovations[SAMPLE_OF_ROW][:, free], residuals[SAMPLE_OF_ROW][:, free], rtol=1e-9
    )
