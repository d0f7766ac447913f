"""Frames and reference points, by moving a vehicle."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.export.gazebo import term_sign
from hydrodamp.export.plant import FLU
from hydrodamp.kernels.core import coriolis

MODELS = [hd.catalog[key] for key in hd.PAPER_MODELS]


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.key)
def test_a_wrench_in_flu_is_the_turned_wrench(model):
    velocity, random = np.random.default_rng(1).normal(size=(20, 6)), np.random.default_rng(2)
    damping = hd.Damping(model, random.normal(size=model.n_coefficients))
    turned = damping.matrix * FLU[:, None] * [term_sign(term) for term in model.basis]
    there = model.basis.evaluate(velocity * FLU) @ turned.T
    np.testing.assert_allclose(there * FLU, damping.wrench(velocity), rtol=1e-12, atol=1e-12)


def test_momentum_turns_with_the_frame():
    mass, velocity = hd.fleet["vt690"].mass_matrix, np.random.default_rng(1).normal(size=(9, 6))
    there = coriolis(FLU[:, None] * mass * FLU, velocity * FLU) * FLU
    np.testing.assert_allclose(there, coriolis(mass, velocity), atol=1e-12)
