"""Recursive least squares: rows exact on any clock, bounds whatever the rows, the fold."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

import oracle
from hydrodamp.errors import ProblemError
from hydrodamp.kernels import core
from hydrodamp.kernels.core import Recursion
from hydrodamp.kernels.plant import Plant

ALL_FREE = (True,) * 6
SEEDS = st.integers(0, 2**32 - 1)


def listed(rng, plant, free=ALL_FREE):
    """Some places on every free axis but heave, and a table of what is known."""
    chosen = (rng.random((6, plant.n_terms)) < 0.5) & np.array(free)[:, None]
    chosen[2] = False
    axes, rows = np.nonzero(chosen)
    return rows, axes, np.where(chosen.T, 0.0, rng.standard_normal((plant.n_terms, 6)))


def moving(rows, axes, n_terms, unit=None, forgetting=0.0):
    """Coefficients that move, on a plant of which nothing is known."""
    plant = Plant(np.eye(6), ALL_FREE, [[1, 0, 0, 0]] * n_terms, 0)
    unit = np.ones(len(rows)) if unit is None else unit
    return Recursion(plant, rows, axes, np.zeros((n_terms, 6)), unit, 1.0, forgetting)


def absorbed(recursion, estimate, rows):
    for row in rows:
        estimate = core.absorb(recursion, estimate, row)
    return estimate


def test_without_forgetting_it_is_least_squares_with_a_prior():
    """Oracle: numpy.linalg.lstsq on the rows and one more row a coefficient."""
    rng = np.random.default_rng(3)
    unit, start = np.array([0.5, 2.0, 1.0, 3.0, 0.1]), rng.standard_normal(5)
    recursion = moving([0, 1, 3, 0, 2], [0, 0, 0, 5, 5], 4, unit)
    rows = rng.standard_normal((40, 10))
    found = absorbed(recursion, recursion.initial_estimate(start), rows)
    for axis in (0, 5):
        part, information = recursion.axis_block(axis, found.information)
        design = np.vstack([rows[:, recursion.rows[part]], np.diag(1.0 / unit[part])])
        target = np.concatenate([rows[:, 4 + axis], start[part] / unit[part]])
        expected = np.linalg.lstsq(design, target, rcond=None)[0]
        np.testing.assert_allclose(found.coefficients[part], expected, rtol=1e-10)
        scaled = design[: -len(expected)] * unit[part]
        np.testing.assert_allclose(information, scaled.T @ scaled, rtol=1e-10, atol=1e-12)
    assert found.rows.tolist() == [40, 0, 0, 0, 0, 40]


KINDS = ("rich", "constant", "zero", "tiny", "two")


def wild_rows(rng, kind, n, size):
    """Rows that excite everything, one direction, nothing, next to nothing, or two."""
    rows = rng.standard_normal((n, size))
    if kind == "constant":
        rows[:] = rows[0]
    if kind in ("zero", "tiny"):
        rows[:, :-6] *= 0.0 if kind == "zero" else 1e-8
    if kind == "two":
        rows = rows[rng.integers(0, 2, n)]
    return rows


@pytest.mark.slow
@given(SEEDS, st.floats(0.001, 0.5), st.lists(st.sampled_from(KINDS), min_size=1, max_size=4))
def test_information_is_bounded_and_no_row_bursts(seed, forgetting, kinds):
    """0 <= S <= c I, c = max(1, max |phi|^2 / forgetting); a jump stays below the surprise."""
    rng = np.random.default_rng(seed)
    unit = 10.0 ** rng.uniform(-1, 1, 4)
    recursion = moving([0, 1, 2, 3], [1, 1, 1, 1], 4, unit, forgetting)
    estimate, most = recursion.initial_estimate(np.zeros(4)), 0.0
    for row in np.vstack([wild_rows(rng, kind, 12, 10) for kind in kinds]):
        surprise = abs(row[5] - estimate.coefficients @ row[:4])
        most = max(most, float(np.sum((unit * row[:4]) ** 2)))
        after = core.absorb(recursion, estimate, row)
        jump = np.linalg.norm((after.coefficients - estimate.coefficients) / unit)
        assert jump <= surprise * (1.0 + 1e-9)
        estimate = after
        values = np.linalg.eigvalsh(estimate.information.reshape(4, 4))
        bound = max(1.0, most / forgetting)
        assert values[0] >= -1e-12 * bound
        assert values[-1] <= bound * (1.0 + 1e-12)
    assert np.isfinite(estimate.coefficients).all()


def run_arguments(make, free=ALL_FREE):
    rng = np.random.default_rng(11)
    plant, inputs = make.plant(rng, free=free), make.inputs(rng, n=60)
    places = listed(rng, plant, free)
    n = len(places[0])
    recursion = Recursion(plant, *places, 10.0 ** rng.uniform(-1, 1, n), 0.35, 0.1)
    estimate = recursion.initial_estimate(rng.standard_normal(n))
    return recursion, estimate, inputs, np.array([[0, 25], [25, 26], [28, 60]])


@pytest.mark.parametrize("free", [ALL_FREE, (True, True, False, False, False, True)])
def test_it_is_the_oracles(make, free):
    arguments = run_arguments(make, free)
    found, expected = core.recur(*arguments), oracle.recur(*arguments)
    for name in ("coefficients", "information", "noise", "rows", "iv_state"):
        ours, theirs = getattr(found, name), getattr(expected, name)
        scale = np.abs(theirs).max(initial=1.0)
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-11 * scale)


def test_arguments_that_do_not_fit_are_refused(make):
    recursion, estimate, inputs, _ = run_arguments(make)
    with pytest.raises(ProblemError, match="row"):
        core.absorb(recursion, estimate, np.ones(3))
    samples = inputs.sample(0), inputs.sample(1)
    with pytest.raises(ProblemError, match=r"state must have shape \(56,\).*got \(\(3,\)"):
        core.block_step(recursion, np.zeros(3), *samples)
    few = make.inputs(np.random.default_rng(1), n=2, n_channels=0)
    block = core.new_block(recursion.plant)
    with pytest.raises(ProblemError, match="a sample 2 channels"):
        core.block_step(recursion, block, few.sample(0), samples[1])
