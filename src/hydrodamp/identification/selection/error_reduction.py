"""Forward selection by the error-reduction ratio, and elimination backwards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray

#: Share of a column's square that must be left for it to be chosen.
_FRESH = 1e-6

#: Added to scaled normal matrices before they are solved.
_RIDGE = 1e-10


@dataclass(frozen=True, eq=False)
class Path:
    """Columns in the order they were chosen."""

    order: IntArray
    ratio: FloatArray


def forward(normal: FloatArray, most: int, first: Sequence[int] = ()) -> Path:
    """Choose columns one by one, each the one that explains most of what is left."""
    n = len(normal) - 1
    scale = _scale(np.diag(normal))
    unit = normal / (scale[:, None] * scale)
    left, open_ = np.diag(unit)[:n].copy(), np.ones(n, dtype=np.bool_)
    rows = np.zeros((min(most + len(first), n), n + 1))
    order: list[int] = []
    for step in range(len(rows)):
        chosen = first[step] if step < len(first) else _next(unit, rows, order, left, open_)
        if chosen is None:
            break
        open_[chosen] = False
        if left[chosen] > _FRESH:
            known = rows[: len(order)]
            row = (unit[chosen] - known[:, chosen] @ known) / np.sqrt(left[chosen])
            rows[len(order)] = row
            left -= row[:n] ** 2
            order.append(chosen)
    return Path(np.array(order, dtype=np.int64), rows[: len(order), -1] ** 2)


def _next(
    unit: FloatArray, rows: FloatArray, order: list[int], left: FloatArray, open_: np.ndarray
) -> int | None:
    known = rows[: len(order)]
    right = unit[:-1, -1] - known[:, :-1].T @ known[:, -1]
    fresh = open_ & (left > _FRESH)
    taken = np.where(fresh, right**2 / np.where(fresh, left, 1.0), 0.0)
    best = int(np.argmax(taken))
    return best if taken[best] > 0.0 else None


def nested(
    normal: FloatArray, start: IntArray, held: IntArray, groups: Sequence[IntArray] = ()
) -> tuple[IntArray, ...]:
    """Drop columns one by one, each the one whose loss costs least."""
    chosen = np.sort(start)
    sets = [chosen]
    while True:
        alone = [np.intersect1d(group, chosen) for group in groups]
        fixed = np.concatenate([held, *(group for group in alone if len(group) == 1)])
        free = ~np.isin(chosen, fixed)
        if not free.any():
            return tuple(sets)
        price = np.where(free, _prices(normal, chosen), np.inf)
        chosen = np.delete(chosen, int(np.argmin(price)))
        sets.append(chosen)


def solved(normal: FloatArray, chosen: IntArray) -> FloatArray:
    """Return the coefficients of some columns."""
    inverse, scale = _inverse(normal, chosen)
    return np.asarray(inverse @ (normal[chosen, -1] / scale) / scale)


def error(normal: FloatArray, chosen: IntArray, coefficients: FloatArray) -> float:
    """Return the sum of squares that coefficients leave of the target."""
    inner = normal[np.ix_(chosen, chosen)] @ coefficients - 2.0 * normal[chosen, -1]
    return float(normal[-1, -1] + coefficients @ inner)


def _prices(normal: FloatArray, chosen: IntArray) -> FloatArray:
    """Return by how much the error rises without each column."""
    inverse, scale = _inverse(normal, chosen)
    coefficients = inverse @ (normal[chosen, -1] / scale)
    return np.asarray(coefficients**2 / np.diag(inverse))


def _inverse(normal: FloatArray, chosen: IntArray) -> tuple[FloatArray, FloatArray]:
    part = normal[np.ix_(chosen, chosen)]
    scale = _scale(np.diag(part))
    scaled = part / (scale[:, None] * scale) + _RIDGE * np.eye(len(chosen))
    inverse = np.asarray(np.linalg.inv(scaled), dtype=np.float64)
    return inverse, scale


def _scale(square: FloatArray) -> FloatArray:
    return np.sqrt(np.where(square > 0.0, square, 1.0))
