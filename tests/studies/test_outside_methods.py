"""What a user would pick instead: every method recovers the coefficients of its own form."""

import numpy as np
import pytest

import outside_methods
from outside_methods import Names, Run

NAMES = Names(("u", "r"), ("thrust", "rudder"), ("thrust", "u*rudder", "r*|u|"))
LABELS = ("1", "u", "r", "u|u|", "r|r|", "u^2", "ur", "r^2", "thrust", "u*rudder", "r*|u|")
SURGE = {"u": -0.4, "u|u|": -0.3, "r^2": 0.2, "thrust": 0.5}
YAW = {"r": -0.5, "r|r|": -0.2, "u*rudder": 0.6}
TRUE = np.array([[values.get(label, 0.0) for label in LABELS] for values in (SURGE, YAW)])


@pytest.fixture(name="run", scope="module")
def run_fixture():
    """A vehicle under random steps, with a clock that is not regular."""
    rng = np.random.default_rng(0)
    n = 1000
    time = np.cumsum(rng.uniform(0.04, 0.06, n))
    inputs = np.repeat(rng.uniform(-1.0, 1.0, (n // 20, 2)), 20, axis=0)
    empty = Run(time, np.zeros((n, 2)), inputs)
    return empty._replace(velocity=outside_methods.replay(TRUE, NAMES.columns, empty))


@pytest.mark.parametrize(
    ("method", "tolerance"), [("numpy-ls", 0.1), ("scipy-oe", 1e-3), ("filter-error", 1e-3)]
)
def test_the_coefficients_of_a_vehicle_are_recovered(run, method, tolerance):
    found, columns = outside_methods.fit(method, [run], NAMES)
    force = columns(run.velocity, run.inputs) @ (found - TRUE).T
    assert np.abs(force).max() < tolerance
    again = outside_methods.replay(found, columns, run)
    assert np.abs(again - run.velocity).max() < tolerance


def test_sindy_recovers_a_polynomial():
    pytest.importorskip("pysindy")
    n = 2000
    names = Names(("u",), ("c",), ("c",))
    inputs = np.repeat(np.random.default_rng(1).uniform(-1.0, 1.0, (n // 40, 1)), 40, axis=0)
    time = 0.01 * np.arange(n)
    true = np.array([[0.0, -1.0, 0.0, -0.5, 2.0]])  # 1, u, u|u|, u^2, c
    run = Run(time, np.zeros((n, 1)), inputs)
    run = run._replace(velocity=outside_methods.replay(true, names.columns, run))
    found, columns = outside_methods.fit("pysindy", [run], names)
    again = outside_methods.replay(found, columns, run)
    assert np.abs(again - run.velocity).max() < 0.05


def test_the_derivative_of_innovations_is_that_of_differences(run):
    window = Run(*(np.asarray(each)[None, :30] for each in run))
    gain, limit = np.array([0.2, 0.3]), np.full(2, 10.0)
    error, slope = outside_methods._innovations(TRUE, gain, window, NAMES, limit)
    step = 1e-6
    for k in range(TRUE.size):
        moved = TRUE.copy()
        moved.flat[k] += step
        there = outside_methods._innovations(moved, gain, window, NAMES, limit)[0]
        assert np.allclose((there - error) / step, slope[..., k], atol=1e-4)


def test_a_replay_that_grows_is_cut():
    names = Names(("u",), (), ())
    run = Run(np.arange(100.0), np.ones((100, 1)), np.empty((100, 0)))
    found = outside_methods.replay(np.array([[0.0, 1.0, 0.0, 0.0]]), names.columns, run)
    assert np.isnan(found[-1]).all()
    assert np.isfinite(found[:2]).all()
