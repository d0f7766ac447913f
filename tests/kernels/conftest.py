"""Plants and records to try the kernels on."""

from types import SimpleNamespace

import numpy as np
import pytest

from hydrodamp.kernels.plant import FIXED_ATOMS, Inputs, Plant


def mass_matrix(rng):
    """A symmetric positive-definite matrix with a light roll axis."""
    mix = rng.standard_normal((6, 6))
    return np.diag([40.0, 75.0, 75.0, 0.3, 9.0, 9.0]) + 0.02 * mix @ mix.T


def plant(rng, *, n_terms=12, n_channels=2, free=(True,) * 6):
    """Random terms of up to four atoms over all atoms there are."""
    factors = rng.integers(0, FIXED_ATOMS + 2 * n_channels, (n_terms, 4))
    factors[::2, 2:] = 0
    return Plant(mass_matrix(rng), free, factors, n_channels)


def inputs(rng, *, n=40, n_channels=2, step=0.1):
    """A smooth record on an irregular clock."""
    time = np.cumsum(step * rng.uniform(0.7, 1.3, n))
    swing = np.sin(np.outer(time, rng.uniform(0.5, 1.5, 6)) + rng.uniform(0, 6, 6))
    down = rng.standard_normal((n, 3)) * 0.1 + [0.0, 0.0, 1.0]
    return Inputs(
        time,
        swing * [0.5, 0.3, 0.3, 0.2, 0.2, 0.2] + [1.5, 0, 0, 0, 0, 0],
        down / np.linalg.norm(down, axis=1, keepdims=True),
        rng.standard_normal((n, 6)) * [3, 3, 3, 0.1, 1, 1],
        np.repeat(rng.standard_normal((-(-n // 3), n_channels)), 3, axis=0)[:n],
        rng.uniform(1, 2, (n, 1)) + np.array([0.0, 0.01]),
        np.random.default_rng(7).standard_normal((n, 3)),
    )


def attitude(rng, n):
    """Unit quaternions, any."""
    q = rng.standard_normal((n, 4))
    return q / np.linalg.norm(q, axis=1, keepdims=True)


def linear_plant(rng, free=(True,) * 6):
    """The six linear terms with drag, and products that bring every atom in."""
    factors = [[i, 0, 0, 0] for i in range(1, 7)]
    factors += [[1, 7, 0, 0], [2, 12, 0, 0], [12, 15, 0, 0], [11, 16, 0, 0], [9, 14, 0, 0]]
    factors += [[1, 1, 17, 0], [3, 14, 17, 0], [13, 6, 0, 0], [18, 0, 0, 0], [19, 20, 0, 0]]
    factors += [[1, 7, 21, 0], [21, 23, 0, 0], [1, 7, 22, 22]]
    made = Plant(mass_matrix(rng), free, factors, 2)
    matrix = 0.05 * rng.standard_normal((made.n_terms, 6)) * np.diag(made.mass_matrix)
    matrix[:6] -= np.diag(np.diag(made.mass_matrix))
    return made, matrix


@pytest.fixture(scope="session")
def make():
    """The builders above, by name."""
    return SimpleNamespace(
        mass_matrix=mass_matrix,
        plant=plant,
        inputs=inputs,
        attitude=attitude,
        linear_plant=linear_plant,
    )
