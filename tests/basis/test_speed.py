"""The speed a propulsion ratio divides by: the kernels' own, to the bit."""

from __future__ import annotations

import numpy as np

import oracle
from hydrodamp.basis.basis import SLOWEST, Basis, guarded_speed


def test_a_batch_gives_the_bits_of_a_sample_and_of_the_kernels():
    velocity = np.random.default_rng(4).normal(size=(500, 6))
    batch = guarded_speed(velocity)
    assert [float(guarded_speed(row)) for row in velocity] == batch.tolist()
    np.testing.assert_array_equal(Basis.of("U").evaluate(velocity)[:, 0], batch)
    assert not Basis.of("u(eta-1)").evaluate(velocity).any()


def test_it_is_guarded_where_the_kernels_guard_it():
    assert SLOWEST == oracle.SLOWEST
    assert guarded_speed(np.zeros(6)) == SLOWEST
