"""Atoms, their products and the moving frame against the paper's definitions (section II)."""

import numpy as np
import pytest

from hydrodamp.kernels import core

NU = np.array([1.5, -0.4, 0.3, 0.2, -0.1, 0.05])
DOWN = np.array([0.6, 0.0, 0.8])
CHANNELS = np.array([-2.0, 3.0])


def terms(table, *, nu=NU, speed=1.2):
    return core.regressor(table, nu[None], DOWN[None], CHANNELS[None], np.array([speed]))[0]


def atom(number, **more):
    return terms([[number, 0, 0, 0]], **more)[0]


def test_every_atom_in_its_place():
    total, crossflow = np.sqrt(1.5**2 + 0.4**2 + 0.3**2), 0.5
    expected = [1, *NU, *np.abs(NU), total, crossflow, -crossflow, crossflow, 1.2 / total - 1]
    expected += [*DOWN, *CHANNELS, *np.abs(CHANNELS)]
    np.testing.assert_allclose([atom(number) for number in range(25)], expected, rtol=1e-15)


def test_the_propulsion_ratio_is_guarded_at_rest_and_not_a_number_is_seen():
    assert atom(17, nu=np.zeros(6), speed=2e-6) == pytest.approx(1.0)
    assert np.isnan(atom(14, nu=np.where(np.arange(6) == 1, np.nan, NU)))


def test_no_samples_and_no_terms():
    empty = [np.zeros((0, width)) for width in (6, 3, 0)]
    assert core.regressor([[1, 0, 0, 0]], *empty, np.zeros(0)).shape == (0, 1)
    assert terms(np.zeros((0, 4))).shape == (0,)


def test_the_moving_frame_by_hand():
    """A point mass of 2 kg at 3 m/s turning at 0.5 rad/s: Y = -m u r. A hull: N = (m11-m22) u v."""
    wrench = core.coriolis(2.0 * np.eye(6), np.array([[3.0, 0, 0, 0, 0, 0.5]]))
    np.testing.assert_allclose(wrench, [[0, -3.0, 0, 0, 0, 0]], atol=1e-15)
    hull = np.diag([30.0, 60.0, 60.0, 1.0, 5.0, 5.0])
    wrench = core.coriolis(hull, np.array([[2.0, 0.5, 0, 0, 0, 0]]))
    assert wrench[0, 5] == pytest.approx((30.0 - 60.0) * 2.0 * 0.5)
