"""Forward orthogonal least squares and elimination, against solutions by hand."""

from __future__ import annotations

import numpy as np
import pytest

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.identification.selection.error_reduction import error, forward, nested, solved
from hydrodamp.identification.selection.stability import frequencies


def problem(
    seed: int = 0, rows: int = 400, columns: int = 12
) -> tuple[FloatArray, FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    design = rng.normal(size=(rows, columns)) @ (np.eye(columns) + 0.3)
    truth = np.zeros(columns)
    truth[[2, 7, 9]] = 3.0, -2.0, 1.0
    target = design @ truth + 0.1 * rng.normal(size=rows)
    stacked = np.column_stack([design, target])
    return design, target, stacked.T @ stacked


def residual(design: FloatArray, target: FloatArray, chosen: IntArray) -> float:
    return float(np.linalg.lstsq(design[:, chosen], target)[1][0])


def test_each_step_takes_the_column_that_lowers_the_residual_most() -> None:
    design, target, normal = problem()
    path = forward(normal, 4)
    for step in range(len(path.order)):
        before = path.order[:step].tolist()
        trials = {
            column: residual(design, target, np.array([*before, column]))
            for column in range(12)
            if column not in before
        }
        assert path.order[step] == min(trials, key=lambda column: trials[column])
        left = trials[int(path.order[step])] / float(target @ target)
        assert 1.0 - path.ratio[: step + 1].sum() == pytest.approx(left, rel=1e-6)


def test_the_true_columns_come_out() -> None:
    _, _, normal = problem()
    sets = nested(normal, forward(normal, 8).order, np.array([], dtype=np.int64))
    assert [len(chosen) for chosen in sets] == list(range(8, -1, -1))
    assert sets[-4].tolist() == [2, 7, 9]
    assert solved(normal, sets[-4]) == pytest.approx([3.0, -2.0, 1.0], abs=0.05)


def test_the_error_is_that_of_least_squares() -> None:
    design, target, normal = problem()
    chosen = np.array([1, 2, 7])
    expected = residual(design, target, chosen)
    assert error(normal, chosen, solved(normal, chosen)) == pytest.approx(expected, rel=1e-6)


def test_elimination_drops_what_costs_least() -> None:
    design, target, normal = problem()
    first, second = nested(normal, np.arange(12), np.array([], dtype=np.int64))[:2]
    losses = [residual(design, target, np.delete(first, place)) for place in range(12)]
    assert residual(design, target, second) == pytest.approx(min(losses))


def test_held_columns_and_the_last_of_a_group_stay() -> None:
    _, _, normal = problem()
    sets = nested(normal, np.arange(12), np.array([0]), [np.array([3, 4]), np.array([99])])
    assert 0 in sets[-1]
    assert len(sets[-1]) == 2
    assert set(sets[-1]) & {3, 4}


def test_first_columns_are_taken_first_and_copies_never() -> None:
    design, target, _ = problem()
    stacked = np.column_stack([design, design[:, 2], np.zeros(len(design)), target])
    path = forward(stacked.T @ stacked, 20, first=(5, 13))
    assert path.order[0] == 5
    assert 13 not in path.order
    assert len({2, 12} & set(path.order.tolist())) == 1


def test_nothing_is_chosen_where_there_is_nothing_to_explain() -> None:
    design, target, _ = problem()
    stacked = np.column_stack([design, 0.0 * target])
    assert len(forward(stacked.T @ stacked, 3).order) == 0


def test_true_columns_are_chosen_on_every_half_and_others_by_chance() -> None:
    design, target, _ = problem(rows=800)
    stacked = np.column_stack([design, target]).reshape(20, 40, -1)
    share = frequencies(np.einsum("bij,bik->bjk", stacked, stacked), most=4, pairs=20)
    assert np.all(share[[2, 7, 9]] == 1.0)
    assert share.sum() == pytest.approx(4.0)
    assert np.delete(share, [2, 7, 9]).max() < 0.6
