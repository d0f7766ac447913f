"""Folds for cross-validation: whole segments where there are several, else long blocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import IntArray
from hydrodamp.errors import MethodError
from hydrodamp.identification.rows import Rows
from hydrodamp.identification.triangle import Triangle, merge

# Folds made of several segments, and of a single one, unless asked for.
_MOST, _BLOCKS = 10, 5


@dataclass(frozen=True)
class Split:
    """What one fold leaves to learn from, and the fold itself."""

    train: Triangle
    test: Triangle


@dataclass(frozen=True, eq=False)
class Folds:
    """Which fold each row belongs to.

    Attributes
    ----------
    part : ndarray of int, shape (m,)
        Number of the fold from 0, or -1 for a row in the margin of a cut.
    n : int
        How many folds there are, at least two; none is empty.
    made : str
        How they were made, in words.
    """

    part: IntArray
    n: int
    made: str

    def splits(self, rows: Rows) -> tuple[Split, ...]:
        """Return the triangles of every fold: each row is folded in once.

        Parameters
        ----------
        rows : Rows
            Those the folds were made of.

        Returns
        -------
        splits : tuple of Split
            One a fold. The training triangles are merged from those of the folds.
        """
        tests = [rows.taken(self.part == fold).triangle() for fold in range(self.n)]
        return tuple(
            Split(merge(tests[:fold] + tests[fold + 1 :]), test) for fold, test in enumerate(tests)
        )


def folds(rows: Rows, n: int | None = None, gap: float = 1.0) -> Folds:
    """Divide rows into folds.

    Parameters
    ----------
    rows : Rows
        In the order of time within each segment.
    n : int, optional
        How many folds. By default one a segment, but at most ten, and five where
        there is a single segment. Fewer than there are segments: segments are dealt
        out in turn. More: the longest are cut into blocks of equal length.
    gap : float
        How far apart the rows on the two sides of a cut must lie [s]: closer ones
        are in no fold. Joins between segments need none.

    Returns
    -------
    folds : Folds
        The number of the fold of each row, and how it was come by.

    Raises
    ------
    MethodError
        If fewer than two folds are asked for, the gap is negative, or the rows are too
        few.

    Examples
    --------
    >>> import numpy as np
    >>> from hydrodamp.basis.basis import Basis
    >>> time = np.arange(6.0)
    >>> rows = Rows(Basis(()), np.zeros((6, 0)), np.zeros((6, 6)), time.astype(int) // 3, time)
    >>> folds(rows).part.tolist(), folds(rows).made
    ([0, 0, 0, 1, 1, 1], '2 folds, one a segment')
    >>> folds(rows, n=3).part.tolist()
    [0, 1, 1, 2, 2, 2]
    """
    if not gap >= 0.0:
        raise MethodError(f"`gap` must be zero or positive [s]; got {gap}")
    _, number, lengths = np.unique(rows.segment, return_inverse=True, return_counts=True)
    usual = _BLOCKS if len(lengths) < 2 else min(len(lengths), _MOST)
    wanted = usual if n is None else n
    if wanted < 2:
        raise MethodError(f"cross-validation needs at least 2 folds; got {wanted}")
    if wanted > rows.n:
        raise MethodError(
            f"{wanted} folds cannot be made of {rows.n} rows: give a longer log or fewer folds"
        )
    if wanted <= len(lengths):
        each = "one a segment" if wanted == len(lengths) else f"{len(lengths)} segments in turn"
        return Folds(number % wanted, wanted, f"{wanted} folds, {each}")
    return _blocks(rows, lengths, wanted, gap)


def _blocks(rows: Rows, lengths: IntArray, wanted: int, gap: float) -> Folds:
    """Cut the longest segments until there are enough blocks."""
    pieces = np.ones(len(lengths), dtype=np.int64)
    for _ in range(wanted - len(lengths)):
        pieces[np.argmax(lengths / pieces)] += 1
    ends = np.cumsum(lengths)
    edges = np.concatenate(
        [
            end - length + np.arange(count) * length // count
            for end, length, count in zip(ends, lengths, pieces, strict=True)
        ]
    )
    part = np.repeat(np.arange(wanted), np.diff(np.append(edges, rows.n)))
    for cut in np.setdiff1d(edges, ends - lengths).tolist():
        instant = (rows.time[cut - 1] + rows.time[cut]) / 2.0
        near = np.abs(rows.time - instant) < gap / 2.0
        part[near & (rows.segment == rows.segment[cut])] = -1
    if len(empty := np.setdiff1d(np.arange(wanted), part)):
        raise MethodError(
            f"{rows.n} rows are too few for {wanted} folds {gap:g} s apart: fold "
            f"{empty[0] + 1} is left without a row. Give a longer log, fewer folds or a "
            "smaller gap."
        )
    cut_up = "one segment" if len(lengths) == 1 else f"{len(lengths)} segments"
    return Folds(part, wanted, f"{wanted} folds, blocks of {cut_up}")
