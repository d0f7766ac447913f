"""Forward, stability and backward selection and the size, against direct least squares."""

import numpy as np
import pytest

from hydrodamp.identification.backward_elimination import (
    backward_elimination,
    cross_validated_errors,
    forward_selection,
    select_size,
    selection_frequencies,
    solve_subset,
)


def problem(seed=0, rows=400, columns=12):
    rng = np.random.default_rng(seed)
    design = rng.normal(size=(rows, columns)) @ (np.eye(columns) + 0.3)
    truth = np.zeros(columns)
    truth[[2, 7, 9]] = 3.0, -2.0, 1.0
    target = design @ truth + 0.1 * rng.normal(size=rows)
    stacked = np.column_stack([design, target])
    return design, target, stacked.T @ stacked


def residual(design, target, subset):
    return float(np.linalg.lstsq(design[:, subset], target)[1][0])


def test_forward_selection_lowers_the_residual_most():
    design, target, normal = problem()
    order = forward_selection(normal, 4)
    for step in range(len(order)):
        before = order[:step].tolist()
        trials = {
            column: residual(design, target, np.array([*before, column]))
            for column in range(12)
            if column not in before
        }
        assert order[step] == min(trials, key=lambda column: trials[column])


def test_backward_elimination_raises_the_residual_least():
    design, target, normal = problem()
    first, second = backward_elimination(normal, np.arange(12), np.array([], dtype=np.int64))[:2]
    losses = [residual(design, target, np.delete(first, index)) for index in range(12)]
    assert residual(design, target, second) == pytest.approx(min(losses))


def test_first_regressors_come_first_and_duplicates_never():
    design, target, _ = problem()
    stacked = np.column_stack([design, design[:, 2], np.zeros(len(design)), target])
    order = forward_selection(stacked.T @ stacked, 20, first=(5, 13))
    assert order[0] == 5
    assert 13 not in order
    assert len({2, 12} & set(order.tolist())) == 1


def test_a_zero_target_selects_nothing():
    design, target, _ = problem()
    stacked = np.column_stack([design, 0.0 * target])
    assert len(forward_selection(stacked.T @ stacked, 3)) == 0


def test_true_regressors_are_selected_on_every_half_sample(monkeypatch):
    design, target, _ = problem(rows=800)
    stacked = np.column_stack([design, target]).reshape(20, 40, -1)
    monkeypatch.setattr("hydrodamp.identification.backward_elimination._MAX_STABLE_TERMS", 4)
    share = selection_frequencies(np.einsum("bij,bik->bjk", stacked, stacked))
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


def test_errors_are_those_of_held_out_blocks():
    normals = blocks(n=5)
    subset = np.array([0, 1, 4])
    errors = cross_validated_errors(normals, [subset])
    for number in range(5):
        training = normals.sum(axis=0) - normals[number]
        kappa = np.append(-solve_subset(training, subset), 1.0)
        test = normals[number][np.ix_([*subset, 6], [*subset, 6])]
        assert errors[0, number] == pytest.approx(kappa @ test @ kappa)


def test_sizes_are_compared_by_paired_differences():
    # The third column helps a little in every block; how hard the blocks are differs far more.
    rng = np.random.default_rng(5)
    design, level = rng.normal(size=(20, 60, 3)), np.linspace(1.0, 30.0, 20)[:, None]
    target = design @ [1.0, -2.0, 0.0] + np.where(np.arange(60) < 30, level, -level)
    target += 3.0 * design[:, :, 2]
    rows = np.concatenate([design, target[:, :, None]], axis=2)
    normals = np.asarray(np.einsum("bij,bik->bjk", rows, rows))
    subsets = [np.array([0, 1, 2]), np.array([0, 1])]
    errors = cross_validated_errors(normals, subsets)
    excess = errors[1] - errors[0]
    assert excess.sum() < errors[0].std(ddof=1) * np.sqrt(20)  # significant only when paired
    assert excess.sum() > excess.std(ddof=1) * np.sqrt(20)
    assert select_size(normals, subsets)[0] is subsets[0]
