"""Forward sensitivities against automatic differentiation of an independent replay."""

from __future__ import annotations

import autograd.numpy as anp
import numpy as np
from autograd import jacobian

from hydrodamp import kernels

SAMPLES, TERMS = 3, 4
SEGMENT = np.array([[0, SAMPLES]])
MAX_STEP = 0.05


def atoms(velocity, down, channels, propulsion):
    """The atoms in the order of the plant, written again for automatic differentiation."""
    speed = anp.sqrt(anp.sum(velocity[:3] ** 2))
    cross = anp.sqrt(anp.sum(velocity[1:3] ** 2))
    fixed = [
        anp.ones(1),
        velocity,
        anp.abs(velocity),
        anp.array([speed, cross, anp.sign(velocity[1]) * cross, anp.sign(velocity[2]) * cross]),
        anp.array([propulsion / speed - 1.0]),
        anp.array(down),
        anp.array(channels),
        anp.abs(anp.array(channels)),
    ]
    return anp.concatenate(fixed)


def acceleration(plant, matrix, velocity, at):
    """Equation 1, with the Coriolis wrench as two cross products."""
    down, wrench, channels, propulsion = at
    values = atoms(velocity, down, channels, propulsion)
    terms = anp.prod(values[plant.factors], axis=1)
    momentum = anp.dot(plant.mass_matrix, velocity)
    turning = anp.concatenate(
        [
            anp.cross(momentum[:3], velocity[3:]),
            anp.cross(momentum[:3], velocity[:3]) + anp.cross(momentum[3:], velocity[3:]),
        ]
    )
    return anp.linalg.solve(plant.mass_matrix, turning + anp.dot(terms, matrix) + wrench)


def replay(plant, matrix, first, inputs, stop):
    """Classical Runge-Kutta steps of equal length, none above the longest allowed."""
    velocity, path = first, [first]
    for k in range(stop - 1):
        length = inputs.time[k + 1] - inputs.time[k]
        steps = int(np.ceil(length / MAX_STEP * (1 - 1e-9)))
        h = length / steps

        def at(share, k=k):
            blend = [(1 - share) * x[k] + share * x[k + 1] for x in (inputs.down, inputs.wrench)]
            return (*blend, inputs.channels[k], inputs.propulsion[k, 0])

        for i in range(steps):
            k1 = acceleration(plant, matrix, velocity, at(i / steps))
            k2 = acceleration(plant, matrix, velocity + h / 2 * k1, at((i + 0.5) / steps))
            k3 = acceleration(plant, matrix, velocity + h / 2 * k2, at((i + 0.5) / steps))
            k4 = acceleration(plant, matrix, velocity + h * k3, at((i + 1) / steps))
            velocity = velocity + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        path.append(velocity)
    return anp.stack(path)


def test_automatic_differentiation_gives_the_same(make):
    rng = np.random.default_rng(5)
    plant = make.plant(rng, n_terms=TERMS)
    inputs, matrix = make.inputs(rng, n=SAMPLES), rng.standard_normal((TERMS, 6))
    first = np.array(inputs.velocity[0])
    places = np.array([(j, i) for j in range(TERMS) for i in range(6)])
    velocity, found, _ = kernels.sensitivities(
        plant, matrix, places, inputs, SEGMENT, max_step=MAX_STEP
    )

    np.testing.assert_allclose(velocity, replay(plant, matrix, first, inputs, SAMPLES), rtol=1e-11)
    by_matrix = jacobian(lambda table: replay(plant, table, first, inputs, SAMPLES))(matrix)
    by_start = jacobian(lambda start: replay(plant, matrix, start, inputs, SAMPLES))(first)
    scale = np.abs(by_matrix).max()
    np.testing.assert_allclose(
        found[:, :, : 6 * TERMS],
        by_matrix.reshape(SAMPLES, 6, 6 * TERMS),
        rtol=1e-9,
        atol=1e-11 * scale,
    )
    np.testing.assert_allclose(found[:, :, 6 * TERMS :], by_start, rtol=1e-9, atol=1e-11)
