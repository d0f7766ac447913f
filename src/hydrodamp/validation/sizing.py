"""How many terms: the smallest model that left-out blocks cannot tell from the best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import nnls

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.identification.selection.error_reduction import error, solved

#: Blocks are left out in this many turns.
_FOLDS = 10

#: Added to scaled normal matrices before they are factored.
_RIDGE = 1e-10


@dataclass(frozen=True, eq=False)
class Sized:
    """The size chosen among nested sets."""

    place: int
    error: FloatArray
    words: str


def sized(blocks: FloatArray, sets: Sequence[IntArray], power: FloatArray) -> Sized:
    """Choose the smallest set that is within one standard error of the best."""
    total = blocks.sum(axis=0)
    rows = left_out(blocks, sets)
    prices = np.array([price(total, chosen, power[:, chosen]) for chosen in sets])
    errors = rows.sum(axis=1) + prices
    best = int(np.argmin(errors))
    allowed = rows[best].std(ddof=1) * np.sqrt(len(blocks))
    place = int(np.flatnonzero(errors <= errors[best] + allowed)[-1])
    share = 100.0 * prices[place] / max(errors[place], np.finfo(np.float64).tiny)
    words = (
        f"{len(sets[place])} coefficients, the smallest of {len(sets)} nested models whose error "
        f"on blocks left out is within one standard error of the lowest (that of "
        f"{len(sets[best])}). {share:.2g} % of its error is the price of damping that takes power "
        "on the whole operating box."
    )
    return Sized(place, errors, words)


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


def price(normal: FloatArray, chosen: IntArray, power: FloatArray) -> float:
    """Return by how much the least error rises where the power must not be positive."""
    part = normal[np.ix_(chosen, chosen)]
    scale = np.sqrt(np.where(np.diag(part) > 0.0, np.diag(part), 1.0))
    scaled = part / (scale[:, None] * scale) + _RIDGE * np.eye(len(chosen))
    root = np.linalg.cholesky(scaled).T
    normals = solve_triangular(root, (power / scale).T, trans="T")
    length = np.linalg.norm(normals, axis=0)
    normals = normals[:, length > 0.0] / length[length > 0.0]
    wished = root @ (scale * solved(normal, chosen))
    if not normals.shape[1] or np.all(wished @ normals <= 0.0):
        return 0.0
    size = float(np.linalg.norm(wished))
    kept = float(nnls(normals, wished / size)[1])
    return round(size**2 * (1.0 - kept**2), 9)
