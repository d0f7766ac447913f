"""Atoms and their products against the paper's definitions (section II-C)."""

from __future__ import annotations

import numpy as np
import pytest

NU = np.array([1.5, -0.4, 0.3, 0.2, -0.1, 0.05])
DOWN = np.array([0.6, 0.0, 0.8])
CHANNELS = np.array([-2.0, 3.0])


def atom(backend, number, *, nu=NU, speed=1.2):
    table = np.array([[number, 0, 0, 0]])
    arrays = (np.atleast_2d(nu), DOWN[None], CHANNELS[None], np.array([speed]))
    return backend.regressor(table, *arrays)[0, 0]


def test_every_atom_in_its_place(backend):
    total, crossflow = np.sqrt(1.5**2 + 0.4**2 + 0.3**2), 0.5
    expected = [1, *NU, *np.abs(NU), total, crossflow, -crossflow, crossflow, 1.2 / total - 1]
    expected += [*DOWN, *CHANNELS, *np.abs(CHANNELS)]
    found = [atom(backend, number) for number in range(25)]
    np.testing.assert_allclose(found, expected, rtol=1e-15)


@pytest.mark.parametrize("number", [2, 8, 14, 15, 16])
def test_no_crossflow_is_no_kink(backend, number):
    assert atom(backend, number, nu=np.array([1.0, 0, 0, 0, 0, 0])) == 0.0


def test_the_propulsion_ratio_is_guarded_at_rest(backend):
    assert atom(backend, 17, nu=np.zeros(6), speed=2e-6) == pytest.approx(1.0)


def test_a_term_is_the_product_of_its_four_atoms(backend):
    table = np.array([[1, 7, 22, 22], [0, 0, 0, 0], [0, 2, 0, 12]])
    found = backend.regressor(table, NU[None], DOWN[None], CHANNELS[None], np.ones(1))
    np.testing.assert_allclose(found, [[1.5 * 1.5 * 9.0, 1.0, -0.4 * 0.05]], rtol=1e-15)


def test_not_a_number_is_seen(backend):
    lost = NU.copy()
    lost[1] = np.nan
    assert np.isnan(atom(backend, 14, nu=lost))


def test_no_samples_and_no_terms(backend):
    empty = [np.zeros((0, width)) for width in (6, 3, 0)]
    assert backend.regressor([[1, 0, 0, 0]], *empty, np.zeros(0)).shape == (0, 1)
    none = np.zeros((0, 4))
    assert backend.regressor(none, NU[None], DOWN[None], CHANNELS[None], np.ones(1)).shape == (1, 0)
