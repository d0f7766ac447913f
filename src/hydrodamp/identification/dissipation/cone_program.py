"""The nearest point under linear and matrix inequalities: one cone program, by Clarabel."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy import sparse

from hydrodamp.arrays import FloatArray

_SOLVED = ("Solved", "AlmostSolved")
_INFEASIBLE = ("PrimalInfeasible", "AlmostPrimalInfeasible")


@dataclass(frozen=True, eq=False)
class Inequalities:
    """``rows·x ≤ bound`` and ``matrices·(x, free, multipliers) + offset ⪯ 0``."""

    rows: FloatArray
    bound: FloatArray
    matrices: Any = None
    offset: FloatArray = field(default_factory=lambda: np.zeros(0))
    size: int = 0
    n_free: int = 0
    n_multipliers: int = 0

    @property
    def n_blocks(self) -> int:
        """How many matrices there are."""
        length = self.size * (self.size + 1) // 2
        return len(self.offset) // length if length else 0


@dataclass(frozen=True, eq=False)
class Nearest:
    """What the solver came to."""

    point: FloatArray
    further: FloatArray
    pressing: FloatArray
    outcome: str

    @property
    def solved(self) -> bool:
        """Whether the point may be used."""
        return self.outcome in _SOLVED and bool(np.all(np.isfinite(self.point)))

    @property
    def infeasible(self) -> bool:
        """Whether the solver has proven that no point satisfies the inequalities."""
        return self.outcome in _INFEASIBLE


def nearest(root: FloatArray, point: FloatArray, inequalities: Inequalities) -> Nearest:
    """Solve ``min ½|root (x − point)|²`` under inequalities."""
    import clarabel  # type: ignore[import-untyped]

    n, further = len(point), inequalities.n_free + inequalities.n_multipliers
    table, right = _stacked(root, point, inequalities)
    cones = [clarabel.ZeroConeT(n)]
    cones += [clarabel.NonnegativeConeT(len(inequalities.rows) + inequalities.n_multipliers)]
    cones += [clarabel.PSDTriangleConeT(inequalities.size)] * inequalities.n_blocks
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1  # the same bits on every machine, and other models run beside
    weight = sparse.diags_array(np.repeat([0.0, 1.0, 0.0], [n, n, further]))
    solution = clarabel.DefaultSolver(
        sparse.csc_matrix(weight), np.zeros(2 * n + further), table, right, cones, settings
    ).solve()
    found = np.array(solution.x)
    return Nearest(
        point=found[:n],
        further=found[2 * n :],
        pressing=np.array(solution.z)[n : n + len(inequalities.rows)],
        outcome=str(solution.status),
    )


def _stacked(root: FloatArray, point: FloatArray, given: Inequalities) -> tuple[Any, FloatArray]:
    """Return A and b of ``A (x, r, further) + s = b``: first the residual, then the cones."""
    n, count = len(point), given.n_multipliers
    width = 2 * n + given.n_free + count
    table: list[Any] = [
        _beside(sparse.csr_array(root), -sparse.eye_array(n), sparse.csr_array((n, width - 2 * n))),
        _beside(sparse.csr_array(given.rows), sparse.csr_array((len(given.rows), width - n))),
        -sparse.eye_array(count, width, k=width - count),
    ]
    right = [root @ point, given.bound, np.zeros(count)]
    if given.n_blocks:
        idle = sparse.csr_array((len(given.offset), n))
        table.append(_beside(given.matrices[:, :n], idle, given.matrices[:, n:]))
        right.append(-given.offset)
    return sparse.csc_matrix(sparse.vstack(table)), np.concatenate(right)


def _beside(*parts: Any) -> Any:
    return sparse.hstack(parts)
