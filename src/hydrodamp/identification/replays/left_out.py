"""How far the end of a search moves when a part of the log is left out."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.identification.replays.refine import Place, Search, refine
from hydrodamp.identification.replays.shooting import cut
from hydrodamp.simulation.problem import Problem

FEWEST = 4
"""Searches that must have an end."""

_ROUNDS = 4
"""Gauss-Newton steps from the end of the whole search: enough to take up what is missing."""


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Ends of the search without one part of the log after another."""

    coefficients: FloatArray
    length: float

    @property
    def n_parts(self) -> int:
        """How many searches have an end."""
        return len(self.coefficients)

    @property
    def covariance(self) -> FloatArray:
        """Jackknife covariance, shape (p, p), of rank one less than parts."""
        away = self.coefficients - self.coefficients.mean(axis=0)
        covariance: FloatArray = (self.n_parts - 1) / self.n_parts * (away.T @ away)
        return covariance


def left_out(search: Search, place: Place, n_parts: int) -> LeftOut | None:
    """Search again without one part of the log after another."""
    length = search.problem.duration / n_parts
    windows, parts = _parts(search.problem, length, n_parts)
    ends = []
    for part in np.unique(parts):
        rest = replace(search, problem=_of(search.problem, windows[parts != part]))
        path = refine(rest, rest.shooting(np.inf), place, _ROUNDS)
        if path is not None:
            ends.append(path.places[-1].coefficients)
    return LeftOut(np.array(ends), length) if len(ends) >= FEWEST else None


def _parts(problem: Problem, length: float, n_parts: int) -> tuple[IntArray, IntArray]:
    """Cut segments into windows, and number the part of the log that each belongs to."""
    windows = cut(problem, length)
    sizes = np.diff(windows, axis=1).ravel()
    middle = np.cumsum(sizes) - 0.5 * sizes
    return windows, np.floor(n_parts * middle / problem.n_samples).astype(np.int64)


def _of(problem: Problem, windows: IntArray) -> Problem:
    """Return the problem of some windows, a segment each."""
    kept = np.concatenate([np.arange(start, stop) for start, stop in windows.tolist()])
    ends = np.cumsum(np.diff(windows, axis=1).ravel())
    return replace(
        problem,
        inputs=problem.inputs.part(kept),
        segments=np.column_stack([np.append(0, ends[:-1]), ends]),
    )
