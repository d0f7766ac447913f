"""Forward sensitivities against differences of the replay itself."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from hydrodamp.kernels import core
from hydrodamp.kernels.plant import PlantSlopes

SEGMENTS = np.array([[0, 7], [8, 16]])
INSIDE = np.delete(np.arange(16), 7)  # a row of the Jacobian for each sample of a segment
STEP = 1e-5

# Central differences of step 1e-5 are off by 1e-10 of the third derivative and by
# rounding of 1e-16/1e-5; the derivatives are of order 0.1 to 10.
TOLERANCE = 2e-8


FREE = (True,) * 6, (True, True, False, False, False, True)


@pytest.fixture(params=itertools.product(FREE, (False, True)))
def case(request, make):
    """All axes free or three, the attitude measured or simulated."""
    rng, (free, simulated) = np.random.default_rng(21), request.param
    plant, matrix = make.linear_plant(rng, free)
    inputs = make.inputs(rng, n=16)
    return plant, matrix, inputs, make.attitude(rng, 16) if simulated else None


def centred(plant, changed, attitude):
    """(replay(+) - replay(-)) / 2 STEP for ``changed(size) -> (matrix, inputs)``."""
    runs = (
        core.replay(plant, *changed(sign * STEP), SEGMENTS, attitude=attitude) for sign in (1, -1)
    )
    ends = [velocity for velocity, *_ in runs]
    return (ends[0] - ends[1])[INSIDE] / (2 * STEP)


def test_on_every_coefficient(case):
    plant, matrix, inputs, attitude = case
    places = [(j, i) for j in range(plant.n_terms) for i in range(0, 6, 2)]
    *_, jacobian = core.replay(
        plant, matrix, inputs, SEGMENTS, tuple(np.transpose(places)), attitude=attitude
    )
    for column, (term, axis) in enumerate(places):

        def changed(size, term=term, axis=axis):
            other = matrix.copy()
            other[term, axis] += size
            return other, inputs

        expected = centred(plant, changed, attitude)
        np.testing.assert_allclose(jacobian[:, :, column], expected, rtol=0, atol=TOLERANCE)


@pytest.mark.parametrize("component", range(6))
def test_on_the_initial_velocity(case, component):
    plant, matrix, inputs, attitude = case
    *_, jacobian = core.replay(plant, matrix, inputs, SEGMENTS, ([0], [0]), attitude=attitude)

    def changed(size):
        velocity = inputs.velocity.copy()
        velocity[SEGMENTS[:, 0], component] += size
        return matrix, replace(inputs, velocity=velocity)

    expected = centred(plant, changed, attitude)
    np.testing.assert_allclose(jacobian[:, :, 1 + component], expected, rtol=0, atol=TOLERANCE)


def random_slopes(rng, plant, n):
    """Two parameters that change everything on which a replay depends."""
    mass = rng.standard_normal((2, 6, 6))
    return PlantSlopes(
        mass + np.swapaxes(mass, 1, 2),
        rng.standard_normal((2, 4, 6)),
        rng.standard_normal((2, n, 6)),
        rng.standard_normal((2, n, plant.n_channels)),
    )


def test_on_parameters_of_plant_and_inputs(case):
    plant, matrix, inputs, attitude = case
    slopes = random_slopes(np.random.default_rng(23), plant, inputs.n)
    options = {"attitude": attitude, "slopes": slopes}
    *_, jacobian = core.replay(plant, matrix, inputs, SEGMENTS, ([8], [1]), **options)
    for k in range(2):
        ends = []
        for size in (STEP, -STEP):
            moved, other = matrix.copy(), plant.mass_matrix + size * slopes.mass_matrix[k]
            moved[:4] += size * slopes.known[k]
            changes = {
                "wrench": inputs.wrench + size * slopes.wrench[k],
                "channels": inputs.channels + size * slopes.channels[k],
            }
            arguments = replace(plant, mass_matrix=other), moved, replace(inputs, **changes)
            ends.append(core.replay(*arguments, SEGMENTS, attitude=attitude)[0][INSIDE])
        expected = (ends[0] - ends[1]) / (2 * STEP)
        tolerance = TOLERANCE * max(np.abs(expected).max(), 1.0)
        np.testing.assert_allclose(jacobian[:, :, 1 + k], expected, rtol=0, atol=tolerance)


def test_condensed_it_is_the_sum_over_blocks_by_the_root_of_their_length(case):
    plant, matrix, inputs, attitude = case
    arguments = (plant, matrix, inputs, SEGMENTS, ([0, 8], [1, 0]))
    *_, jacobian = core.replay(*arguments, attitude=attitude)
    *_, condensed = core.replay(*arguments, attitude=attitude, block=3)
    blocks = [(0, 3), (3, 6), (6, 7), (7, 10), (10, 13), (13, 15)]
    means = [jacobian[a:b].sum(axis=0) / np.sqrt(b - a) for a, b in blocks]
    np.testing.assert_allclose(condensed, means, rtol=1e-12, atol=1e-13)


def test_at_rest_every_derivative_is_finite(make):
    """U = V = 0 and every |.| at its kink: the derivative there is taken as 0."""
    rng = np.random.default_rng(22)
    plant, matrix = make.linear_plant(rng)
    still = replace(make.inputs(rng, n=4), velocity=np.zeros((4, 6)), wrench=np.zeros((4, 6)))
    nothing = np.zeros((4, 3))
    still = replace(still, channels=np.zeros((4, 2)), down=nothing, down_slope=nothing)
    segments = np.array([[0, 4]])
    velocity, _, jacobian = core.replay(plant, matrix, still, segments, ([8], [1]))
    np.testing.assert_array_equal(velocity, 0.0)
    assert np.all(np.isfinite(jacobian))
    np.testing.assert_array_equal(jacobian[0, :, 1:], np.eye(6))
