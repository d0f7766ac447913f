"""Choosing terms one by one, forward and backward, and how many."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, factorisation

# Share of a column's square that must be left for it to be chosen.
_FRESH = 1e-6

# Added to scaled normal matrices before they are solved.
_RIDGE = 1e-10

# Blocks are left out in this many turns.
_FOLDS = 10

# Columns chosen on each half sample, and pairs of complementary ones that are drawn.
_DRAWN, _PAIRS = 40, 25

# Share of the leftovers that a column takes that moves an axis: a correlation of 0.3.
_MOVED = 0.09


def forward(normal: FloatArray, most: int, first: Sequence[int] = ()) -> IntArray:
    """Choose columns one by one, each the one that explains most of what is left.

    The error-reduction ratio; the columns ``first`` are taken before all others.
    """
    n = len(normal) - 1
    scale = _scale(np.diag(normal))
    unit = normal / (scale[:, None] * scale)
    left, open_ = np.diag(unit)[:n].copy(), np.ones(n, dtype=np.bool_)
    rows = np.zeros((min(most + len(first), n), n + 1))
    order: list[int] = []
    for step in range(len(rows)):
        known = rows[: len(order)]
        if step < len(first):
            chosen = first[step]
        else:
            right = unit[:-1, -1] - known[:, :-1].T @ known[:, -1]
            fresh = open_ & (left > _FRESH)
            taken = np.where(fresh, right**2 / np.where(fresh, left, 1.0), 0.0)
            chosen = int(np.argmax(taken))
            if not taken[chosen] > 0.0:
                break
        open_[chosen] = False
        if left[chosen] > _FRESH:
            row = (unit[chosen] - known[:, chosen] @ known) / np.sqrt(left[chosen])
            rows[len(order)] = row
            left -= row[:n] ** 2
            order.append(chosen)
    return np.array(order, dtype=np.int64)


def frequencies(blocks: FloatArray, first: Sequence[int] = ()) -> FloatArray:
    """Return the share of complementary half samples on which each column is chosen."""
    rng = np.random.default_rng(0)
    count = np.zeros(blocks.shape[1] - 1)
    for _ in range(_PAIRS):
        drawn = rng.permutation(len(blocks))
        for part in np.split(drawn, [len(blocks) // 2]):
            count[forward(blocks[part].sum(axis=0), _DRAWN, first)] += 1.0
    return count / (2.0 * _PAIRS)


def moving(normal: FloatArray, known: int) -> IntArray:
    """Choose columns after the known ones while each takes its share of what is left over."""
    order = forward(normal, len(normal), range(known))
    start = int(np.sum(order < known))
    left = [
        error(normal, order[:n], solved(normal, order[:n])) for n in range(start, len(order) + 1)
    ]
    enough = [after <= (1.0 - _MOVED) * before for before, after in pairwise(left)]
    return order[start : start + [*enough, False].index(False)]


def nested(
    normal: FloatArray, start: IntArray, held: IntArray, groups: Sequence[IntArray] = ()
) -> tuple[IntArray, ...]:
    """Drop columns one by one, each the one whose loss costs least; the last of a group stays."""
    chosen = np.sort(start)
    sets = [chosen]
    while True:
        alone = [np.intersect1d(group, chosen) for group in groups]
        fixed = np.concatenate([held, *(group for group in alone if len(group) == 1)])
        free = ~np.isin(chosen, fixed)
        if not free.any():
            return tuple(sets)
        inverse, scale = _inverse(normal, chosen)
        coefficients = inverse @ (normal[chosen, -1] / scale)
        loss = np.where(free, coefficients**2 / np.diag(inverse), np.inf)
        chosen = np.delete(chosen, int(np.argmin(loss)))
        sets.append(chosen)


def solved(normal: FloatArray, chosen: IntArray) -> FloatArray:
    """Return the coefficients of some columns."""
    inverse, scale = _inverse(normal, chosen)
    return np.asarray(inverse @ (normal[chosen, -1] / scale) / scale)


def error(normal: FloatArray, chosen: IntArray, coefficients: FloatArray) -> float:
    """Return the sum of squares that coefficients leave of the target."""
    inner = normal[np.ix_(chosen, chosen)] @ coefficients - 2.0 * normal[chosen, -1]
    return float(normal[-1, -1] + coefficients @ inner)


def sized(blocks: FloatArray, sets: Sequence[IntArray]) -> tuple[int, str]:
    """Choose the smallest set whose paired excess over the best is within its standard error."""
    rows = left_out(blocks, sets)
    errors = rows.sum(axis=1)
    best = int(np.argmin(errors))
    # Blocks are hard or easy for all sets alike, so each is compared with itself.
    allowed = (rows - rows[best]).std(axis=1, ddof=1) * np.sqrt(len(blocks))
    place = int(np.flatnonzero(errors - errors[best] <= allowed)[-1])
    return place, (
        f"{len(sets[place])} coefficients, the smallest of {len(sets)} nested models whose error "
        f"on blocks left out, block by block, exceeds the lowest (that of {len(sets[best])}) by "
        "no more than one standard error of the difference."
    )


def left_out(blocks: FloatArray, sets: Sequence[IntArray]) -> FloatArray:
    """Return the error of every set on every block, its coefficients solved without it."""
    n = len(blocks)
    fold = np.arange(n) % min(_FOLDS, n)
    total = blocks.sum(axis=0)
    errors = np.zeros((len(sets), n))
    for turn in np.unique(fold):
        out = np.flatnonzero(fold == turn)
        rest = total - blocks[out].sum(axis=0)
        for number, chosen in enumerate(sets):
            coefficients = solved(rest, chosen)
            errors[number, out] = [error(blocks[place], chosen, coefficients) for place in out]
    return errors


@factorisation("normal matrix")
def _inverse(normal: FloatArray, chosen: IntArray) -> tuple[FloatArray, FloatArray]:
    part = normal[np.ix_(chosen, chosen)]
    scale = _scale(np.diag(part))
    scaled = part / (scale[:, None] * scale) + _RIDGE * np.eye(len(chosen))
    return np.asarray(np.linalg.inv(scaled), dtype=np.float64), scale


def _scale(square: FloatArray) -> FloatArray:
    return np.sqrt(np.where(square > 0.0, square, 1.0))
