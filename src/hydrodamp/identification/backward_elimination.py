"""Forward selection and backward elimination of regressors from their normal matrix.

Forward selection takes the regressor of the largest error-reduction ratio (orthogonal least
squares); stability selection repeats it on complementary half samples; backward elimination drops
the regressor whose loss κ_j² / (N⁻¹)_jj is least; cross-validation with the one-standard-error
rule chooses the size. ``normal`` is [Φ y]ᵀ[Φ y], shape (n + 1, n + 1).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, factorisation

# Share of a regressor's square [1] that must be orthogonal to the selected ones.
_MIN_ORTHOGONAL_SHARE = 1e-6

# Ridge [1] on normal matrices of unit diagonal.
_RIDGE = 1e-10

# Folds of the cross-validation.
_N_FOLDS = 10

# Regressors selected on each half sample, and pairs of complementary half samples.
_MAX_STABLE_TERMS, _N_PAIRS = 40, 25

# Share of the residual square that a command must explain: a correlation of 0.3.
_MIN_EXPLAINED_SHARE = 0.09


def forward_selection(normal: FloatArray, max_terms: int, first: Sequence[int] = ()) -> IntArray:
    """Select regressors by their error-reduction ratio, those in ``first`` before the others."""
    n = len(normal) - 1
    scale = _scale(np.diag(normal))
    unit = normal / (scale[:, None] * scale)
    orthogonal, available = np.diag(unit)[:n].copy(), np.ones(n, dtype=np.bool_)
    rows = np.zeros((min(max_terms + len(first), n), n + 1))
    order: list[int] = []
    for step in range(len(rows)):
        previous = rows[: len(order)]
        if step < len(first):
            index = first[step]
        else:
            covariance = unit[:-1, -1] - previous[:, :-1].T @ previous[:, -1]
            eligible = available & (orthogonal > _MIN_ORTHOGONAL_SHARE)
            divisor = np.where(eligible, orthogonal, 1.0)
            reduction = np.where(eligible, covariance**2 / divisor, 0.0)
            index = int(np.argmax(reduction))
            if not reduction[index] > 0.0:
                break
        available[index] = False
        if orthogonal[index] > _MIN_ORTHOGONAL_SHARE:
            projection = previous[:, index] @ previous
            row = (unit[index] - projection) / np.sqrt(orthogonal[index])
            rows[len(order)] = row
            orthogonal -= row[:n] ** 2
            order.append(index)
    return np.array(order, dtype=np.int64)


def selection_frequencies(blocks: FloatArray, first: Sequence[int] = ()) -> FloatArray:
    """Return the share of complementary half samples of blocks that select each regressor."""
    rng = np.random.default_rng(0)
    count = np.zeros(blocks.shape[1] - 1)
    for _ in range(_N_PAIRS):
        order = rng.permutation(len(blocks))
        for half in np.split(order, [len(blocks) // 2]):
            count[forward_selection(blocks[half].sum(axis=0), _MAX_STABLE_TERMS, first)] += 1.0
    return count / (2.0 * _N_PAIRS)


def select_significant(normal: FloatArray, n_known: int) -> IntArray:
    """Select regressors after the known ones while each explains its share of the residual."""
    order = forward_selection(normal, len(normal), range(n_known))
    start = int(np.sum(order < n_known))
    errors = [
        squared_error(normal, order[:n], solve_subset(normal, order[:n]))
        for n in range(start, len(order) + 1)
    ]
    significant = [
        after <= (1.0 - _MIN_EXPLAINED_SHARE) * before for before, after in pairwise(errors)
    ]
    return order[start : start + [*significant, False].index(False)]


def backward_elimination(
    normal: FloatArray, start: IntArray, retained: IntArray, groups: Sequence[IntArray] = ()
) -> tuple[IntArray, ...]:
    """Return nested subsets, each without the least useful regressor; one of a group remains."""
    subset = np.sort(start)
    subsets = [subset]
    while True:
        members = [np.intersect1d(group, subset) for group in groups]
        last_members = [group for group in members if len(group) == 1]
        removable = ~np.isin(subset, np.concatenate([retained, *last_members]))
        if not removable.any():
            return tuple(subsets)
        inverse, scale = _inverse(normal, subset)
        coefficients = inverse @ (normal[subset, -1] / scale)
        loss = np.where(removable, coefficients**2 / np.diag(inverse), np.inf)
        subset = np.delete(subset, int(np.argmin(loss)))
        subsets.append(subset)


def solve_subset(normal: FloatArray, subset: IntArray) -> FloatArray:
    """Return the least-squares coefficients of some regressors."""
    inverse, scale = _inverse(normal, subset)
    return np.asarray(inverse @ (normal[subset, -1] / scale) / scale)


def squared_error(normal: FloatArray, subset: IntArray, coefficients: FloatArray) -> float:
    """Return the sum of squared residuals."""
    inner = normal[np.ix_(subset, subset)] @ coefficients - 2.0 * normal[subset, -1]
    return float(normal[-1, -1] + coefficients @ inner)


def select_size(blocks: FloatArray, subsets: Sequence[IntArray]) -> tuple[IntArray, str]:
    """Select the smallest subset by the one-standard-error rule on paired differences of blocks."""
    block_errors = cross_validated_errors(blocks, subsets)
    errors = block_errors.sum(axis=1)
    best = int(np.argmin(errors))
    # Paired: the error of a block depends on its motion more than on the subset.
    difference = block_errors - block_errors[best]
    standard_error = difference.std(axis=1, ddof=1) * np.sqrt(len(blocks))
    subset = subsets[np.flatnonzero(errors - errors[best] <= standard_error)[-1]]
    return subset, (
        f"{len(subset)} coefficients, the smallest of {len(subsets)} nested models whose "
        "cross-validated error exceeds the lowest one "
        f"(that of {len(subsets[best])}) by no more than one standard error of the difference."
    )


def cross_validated_errors(blocks: FloatArray, subsets: Sequence[IntArray]) -> FloatArray:
    """Return the error of every subset on every block (n_subsets, n), fitted without its fold."""
    n = len(blocks)
    fold = np.arange(n) % min(_N_FOLDS, n)
    total = blocks.sum(axis=0)
    errors = np.zeros((len(subsets), n))
    for number in np.unique(fold):
        test = np.flatnonzero(fold == number)
        training = total - blocks[test].sum(axis=0)
        for row, subset in enumerate(subsets):
            coefficients = solve_subset(training, subset)
            errors[row, test] = [squared_error(blocks[k], subset, coefficients) for k in test]
    return errors


@factorisation("normal matrix")
def _inverse(normal: FloatArray, subset: IntArray) -> tuple[FloatArray, FloatArray]:
    matrix = normal[np.ix_(subset, subset)]
    scale = _scale(np.diag(matrix))
    scaled = matrix / (scale[:, None] * scale) + _RIDGE * np.eye(len(subset))
    return np.asarray(np.linalg.inv(scaled), dtype=np.float64), scale


def _scale(square: FloatArray) -> FloatArray:
    return np.sqrt(np.where(square > 0.0, square, 1.0))
