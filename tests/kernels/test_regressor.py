"""Atoms and their products against the paper's definitions (section II-C)."""

from __future__ import annotations

import numpy as np
import pytest

from hydrodamp import kernels

NU = np.array([1.5, -0.4, 0.3, 0.2, -0.1, 0.05])
DOWN = np.array([0.6, 0.0, 0.8])
CHANNELS = np.array([-2.0, 3.0])


def atom(number, *, nu=NU, speed=1.2):
    table = np.array([[number, 0, 0, 0]])
    arrays = (np.atleast_2d(nu), DOWN[None], CHANNELS[None], np.array([speed]))
    return kernels.regressor(table, *arrays)[0, 0]


def test_every_atom_in_its_place():
    total, crossflow = np.sqrt(1.5**2 + 0.4**2 + 0.3**2), 0.5
    expected = [1, *NU, *np.abs(NU), total, crossflow, -crossflow, crossflow, 1.2 / total - 1]
    expected += [*DOWN, *CHANNELS, *np.abs(CHANNELS)]
    found = [atom(number) for number in range(25)]
    np.testing.assert_allclose(found, expected, rtol=1e-15)


@pytest.mark.parametrize("number", [2, 8, 14, 15, 16])
def test_no_crossflow_is_no_kink(number):
    assert atom(number, nu=np.array([1.0, 0, 0, 0, 0, 0])) == 0.0


def test_the_propulsion_ratio_is_guarded_at_rest():
    assert atom(17, nu=np.zeros(6), speed=2e-6) == pytest.approx(1.0)


def test_a_term_is_the_product_of_its_four_atoms():
    table = np.array([[1, 7, 22, 22], [0, 0, 0, 0], [0, 2, 0, 12]])
    found = kernels.regressor(table, NU[None], DOWN[None], CHANNELS[None], np.ones(1))
    np.testing.assert_allclose(found, [[1.5 * 1.5 * 9.0, 1.0, -0.4 * 0.05]], rtol=1e-15)


def test_not_a_number_is_seen():
    lost = NU.copy()
    lost[1] = np.nan
    assert np.isnan(atom(14, nu=lost))


def test_no_samples_and_no_terms():
    empty = [np.zeros((0, width)) for width in (6, 3, 0)]
    assert kernels.regressor([[1, 0, 0, 0]], *empty, np.zeros(0)).shape == (0, 1)
    none = np.zeros((0, 4))
    assert kernels.regressor(none, NU[None], DOWN[None], CHANNELS[None], np.ones(1)).shape == (1, 0)
