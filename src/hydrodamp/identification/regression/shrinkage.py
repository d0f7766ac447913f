"""How strongly to shrink, chosen by what is predicted best on folds left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES
from hydrodamp.basis.term import Term
from hydrodamp.errors import MethodError
from hydrodamp.identification.rows.equations import Rows
from hydrodamp.identification.rows.folds import Folds, Split, folds
from hydrodamp.identification.rows.rank import spanned
from hydrodamp.identification.rows.triangle import Triangle
from hydrodamp.models.model import DampingModel

_GRID = np.logspace(-12.0, 2.0, 57)
"""Strengths tried first: four a decade, from none that matters to all but zero."""

least_strength, largest_strength = float(_GRID[0]), float(_GRID[-1])
"""Ends of the grid, where the choice says nothing of a best strength."""

_FINER = 21
"""Strengths tried next, between the neighbours of the one chosen."""


@dataclass(frozen=True)
class CrossValidated:
    """A strength for each axis, chosen by cross-validation over segments.

    Parameters
    ----------
    n : int, optional
        How many folds; one a segment by default, five blocks of a single segment. See
        :func:`hydrodamp.identification.rows.folds.folds`.
    gap : float
        Rows closer than this to each other across a cut are left out [s].
    slack : float
        Take the largest strength whose error is within this many standard errors of the
        least; 1 is the one-standard-error rule of Breiman et al. (1984).

    Raises
    ------
    MethodError
        If the slack is negative.
    """

    n: int | None = None
    gap: float = 1.0
    slack: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a slack that means nothing."""
        if not self.slack >= 0.0:
            raise MethodError(f"`slack` must be zero or positive; got {self.slack}")


@dataclass(frozen=True)
class Curve:
    """Errors of prediction over strengths, on the folds left out."""

    strength: FloatArray
    error: FloatArray
    spread: FloatArray

    def chosen(self, slack: float = 0.0) -> int:
        """Return the place of the largest strength near enough to the least error."""
        least = int(self.error.argmin())
        allowed = self.error[least] + slack * self.spread[least]
        return int(np.flatnonzero(self.error <= allowed)[-1]) if slack else least

    def joined(self, other: Curve) -> Curve:
        """Return the curve over the strengths of both."""
        order = np.argsort(np.append(self.strength, other.strength), kind="stable")
        return Curve(
            np.append(self.strength, other.strength)[order],
            np.append(self.error, other.error)[order],
            np.append(self.spread, other.spread)[order],
        )


def column_size(triangle: Triangle, terms: Sequence[Term]) -> FloatArray:
    """Return the root mean square of columns; one where a column is zero."""
    columns = triangle.r[:, [triangle.basis.index(term) for term in terms]]
    size: FloatArray = np.linalg.norm(columns, axis=0) / np.sqrt(triangle.n_samples)
    size[size == 0.0] = 1.0
    return size


def curve(
    splits: Sequence[Split],
    terms: Sequence[Term],
    axis: int,
    size: FloatArray,
    strength: FloatArray = _GRID,
) -> Curve:
    """Return the errors of prediction of one axis over strengths."""
    lost = np.array([_lost(split, terms, axis, size, strength) for split in splits])
    rows = np.array([split.test.n_samples for split in splits])
    means = lost / rows[:, None]
    spread = means.std(axis=0, ddof=1) / np.sqrt(len(splits))
    return Curve(strength, lost.sum(axis=0) / rows.sum(), spread)


def refined(
    splits: Sequence[Split], terms: Sequence[Term], axis: int, size: FloatArray, slack: float = 0.0
) -> tuple[float, float]:
    """Return the strength chosen for one axis, and its error."""
    coarse = curve(splits, terms, axis, size)
    place = coarse.chosen(slack)
    low, high = coarse.strength[[max(place - 1, 0), min(place + 1, len(_GRID) - 1)]].tolist()
    both = coarse.joined(curve(splits, terms, axis, size, np.geomspace(low, high, _FINER)))
    best = both.chosen(slack)
    return float(both.strength[best]), float(np.sqrt(both.error[best]))


@dataclass(frozen=True, eq=False)
class Validation:
    """Folds of some rows, made when a model first asks for them."""

    rows: Rows
    settings: CrossValidated

    @cached_property
    def folds(self) -> Folds:
        """Which fold each row belongs to."""
        return folds(self.rows, self.settings.n, self.settings.gap)

    @cached_property
    def splits(self) -> tuple[Split, ...]:
        """The triangles of each fold."""
        return self.folds.splits(self.rows)

    @cached_property
    def triangle(self) -> Triangle:
        """The triangle of all rows, margins of the folds included."""
        return self.rows.triangle()

    @property
    def made(self) -> tuple[str, ...]:
        """How the folds were made, as a sentence."""
        return (f"Ridge strengths by cross-validation: {self.folds.made}.",)

    def strengths(self, model: DampingModel) -> tuple[FloatArray, FloatArray]:
        """Choose a strength for each axis of a model."""
        self._check(model)
        found = np.zeros((6, 2))
        for axis, terms in enumerate(model.terms):
            if terms:
                size = column_size(self.triangle, terms)
                found[axis] = refined(self.splits, terms, axis, size, self.settings.slack)
        return found[:, 0], found[:, 1]

    def _check(self, model: DampingModel) -> None:
        fewest = min(split.train.n_samples for split in self.splits)
        axis = int(np.argmax([len(row) for row in model.terms]))
        needed = len(model.terms[axis])
        if fewest < needed:
            raise MethodError(
                f"cross-validation ({self.folds.made}) leaves {fewest} rows to learn from where "
                f"axis {AXES[axis]} of model '{model.key}' has {needed} terms: give a longer log, "
                "other folds, or the strength itself."
            )


def _lost(
    split: Split, terms: Sequence[Term], axis: int, size: FloatArray, strength: FloatArray
) -> FloatArray:
    """Return the squares not predicted on one fold, one sum a strength."""
    chosen = [split.train.basis.index(term) for term in terms]
    target = len(split.train.basis) + axis
    span = spanned(split.train.r[:, chosen], terms, size)
    amounts = span.directions.T @ split.train.r[:, target]
    kept = shrunk(span.singular, strength[:, None], split.train.n_samples)
    coefficients = span.coefficients @ (kept * amounts).T
    rest = split.test.r[:, [target]] - split.test.r[:, chosen] @ coefficients
    squares: FloatArray = np.sum(rest * rest, axis=0)
    return squares


def shrunk(singular: FloatArray, strength: FloatArray | float, n_rows: int) -> FloatArray:
    """Return what ridge leaves of each direction, between zero and one."""
    square = singular * singular
    share: FloatArray = square / (square + strength * n_rows)
    return share
