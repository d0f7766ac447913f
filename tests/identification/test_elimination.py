"""Choosing columns forward, stably and backward, and how many, against solutions by hand."""

import numpy as np
import pytest

from hydrodamp.identification.backward_elimination import (
    forward,
    frequencies,
    left_out,
    nested,
    sized,
    solved,
)


def problem(seed=0, rows=400, columns=12):
    rng = np.random.default_rng(seed)
    design = rng.normal(size=(rows, columns)) @ (np.eye(columns) + 0.3)
    truth = np.zeros(columns)
    truth[[2, 7, 9]] = 3.0, -2.0, 1.0
    target = design @ truth + 0.1 * rng.normal(size=rows)
    stacked = np.column_stack([design, target])
    return design, target, stacked.T @ stacked


def residual(design, target, chosen):
    return float(np.linalg.lstsq(design[:, chosen], target)[1][0])


def test_each_step_takes_the_column_that_lowers_the_residual_most():
    design, target, normal = problem()
    order = forward(normal, 4)
    for step in range(len(order)):
        before = order[:step].tolist()
        trials = {
            column: residual(design, target, np.array([*before, column]))
            for column in range(12)
            if column not in before
        }
        assert order[step] == min(trials, key=lambda column: trials[column])


def test_elimination_drops_what_costs_least():
    design, target, normal = problem()
    first, second = nested(normal, np.arange(12), np.array([], dtype=np.int64))[:2]
    losses = [residual(design, target, np.delete(first, place)) for place in range(12)]
    assert residual(design, target, second) == pytest.approx(min(losses))


def test_first_columns_are_taken_first_and_copies_never():
    design, target, _ = problem()
    stacked = np.column_stack([design, design[:, 2], np.zeros(len(design)), target])
    order = forward(stacked.T @ stacked, 20, first=(5, 13))
    assert order[0] == 5
    assert 13 not in order
    assert len({2, 12} & set(order.tolist())) == 1


def test_nothing_is_chosen_where_there_is_nothing_to_explain():
    design, target, _ = problem()
    stacked = np.column_stack([design, 0.0 * target])
    assert len(forward(stacked.T @ stacked, 3)) == 0


def test_true_columns_are_chosen_on_every_half_and_others_by_chance(monkeypatch):
    design, target, _ = problem(rows=800)
    stacked = np.column_stack([design, target]).reshape(20, 40, -1)
    monkeypatch.setattr("hydrodamp.identification.backward_elimination._DRAWN", 4)
    share = frequencies(np.einsum("bij,bik->bjk", stacked, stacked))
    assert np.all(share[[2, 7, 9]] == 1.0)
    assert share.sum() == pytest.approx(4.0)
    assert np.delete(share, [2, 7, 9]).max() < 0.6


def blocks(seed=1, n=20, columns=6):
    rng = np.random.default_rng(seed)
    design = rng.normal(size=(n, 30, columns))
    truth = np.array([1.0, -2.0, 0.0, 0.0, 0.0, 0.0])
    target = design @ truth + 0.5 * rng.normal(size=(n, 30))
    rows = np.concatenate([design, target[:, :, None]], axis=2)
    return np.asarray(np.einsum("bij,bik->bjk", rows, rows))


def test_a_block_is_predicted_by_the_others():
    parts = blocks(n=5)
    chosen = np.array([0, 1, 4])
    errors = left_out(parts, [chosen])
    for number in range(5):
        rest = parts.sum(axis=0) - parts[number]
        kappa = np.append(-solved(rest, chosen), 1.0)
        part = parts[number][np.ix_([*chosen, 6], [*chosen, 6])]
        assert errors[0, number] == pytest.approx(kappa @ part @ kappa)


def test_sizes_are_compared_block_by_block():
    # The third column helps a little in every block; how hard the blocks are differs far more.
    rng = np.random.default_rng(5)
    design, level = rng.normal(size=(20, 60, 3)), np.linspace(1.0, 30.0, 20)[:, None]
    target = design @ [1.0, -2.0, 0.0] + np.where(np.arange(60) < 30, level, -level)
    target += 3.0 * design[:, :, 2]
    rows = np.concatenate([design, target[:, :, None]], axis=2)
    parts = np.asarray(np.einsum("bij,bik->bjk", rows, rows))
    sets = [np.array([0, 1, 2]), np.array([0, 1])]
    errors = left_out(parts, sets)
    excess = errors[1] - errors[0]
    assert excess.sum() < errors[0].std(ddof=1) * np.sqrt(20)  # told apart in pairs alone
    assert excess.sum() > excess.std(ddof=1) * np.sqrt(20)
    assert sized(parts, sets)[0] == 0
