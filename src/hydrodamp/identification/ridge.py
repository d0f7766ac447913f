"""Ridge regression: axis by axis, columns scaled, strength by cross-validation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES
from hydrodamp.basis.term import Term
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.linear import LinearEstimator, Regression, Solver
from hydrodamp.identification.rows import Equations, Folds, Split, folds
from hydrodamp.identification.triangle import column_size, solve_axis, spanned
from hydrodamp.identification.weak import WeakEquations
from hydrodamp.models.model import DampingModel

# Strengths tried first, four a decade from none that matters to all but zero, and how many next,
# between the neighbours of the one chosen.
_GRID = np.logspace(-12.0, 2.0, 57)
_FINER = 21

# One strength for all axes, or six in the order X Y Z K M N.
Strengths = float | tuple[float, ...]


@dataclass(frozen=True)
class CrossValidated:
    """A strength for each axis, chosen by cross-validation over segments.

    Parameters
    ----------
    n : int, optional
        How many folds; one a segment by default, five blocks of a single segment. See
        :func:`hydrodamp.folds`.
    gap : float
        Rows closer than this to each other across a cut are left out [s].
    """

    n: int | None = None
    gap: float = 1.0


@dataclass(frozen=True)
class Ridge(LinearEstimator):
    """Least squares that prefers small coefficients.

    Minimises ``|Ξ κ − σ|² / n + strength · |S κ|²`` on each axis, S the root mean
    square of each column: a strength has no unit and does not depend on the length of
    the log or the unit of a column. Directions the data hardly determine shrink to
    zero, the others stay. Standard errors say nothing of what shrinking hides.

    Parameters
    ----------
    equations : Equations, optional
        Where the rows come from.
    strength : float, tuple of 6 floats or CrossValidated
        One for all axes, one an axis X Y Z K M N, or chosen by cross-validation.

    Raises
    ------
    MethodError
        If a strength is negative, or there are too few rows for the folds.

    Examples
    --------
    >>> Ridge().key, Ridge(strength=1e-3).strength
    ('ridge', 0.001)
    """

    equations: Equations = field(default_factory=WeakEquations)
    strength: Strengths | CrossValidated = field(default=CrossValidated())

    def __post_init__(self) -> None:
        """Refuse strengths that are none."""
        if isinstance(self.strength, CrossValidated):
            return
        values = np.asarray(self.strength, dtype=np.float64)
        if values.shape not in ((), (6,)) or not np.all(np.isfinite(values) & (values >= 0.0)):
            raise MethodError(
                "`strength` must be zero or positive, one number or six, one an axis X Y Z K M N; "
                f"got {self.strength!r}"
            )

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "ridge"

    def _solver(self, regression: Regression) -> Solver:
        if isinstance(self.strength, CrossValidated):
            choice: _Validation | _Given = _Validation(regression, self.strength)
        else:
            choice = _Given(np.broadcast_to(np.asarray(self.strength, dtype=np.float64), (6,)))

        def solve(model: DampingModel) -> Fit:
            triangle, remarks, solved = regression.triangle, list(choice.remarks), []
            for axis, (terms, strength, error) in enumerate(
                zip(model.terms, *choice(model), strict=True)
            ):
                solved.append(solve_axis(triangle, terms, axis, strength))
                if terms:
                    used = float(solved[-1].share.sum())
                    remarks.append(_said(axis, len(terms), strength, error, used))
            return regression.fit(self, model, solved, tuple(remarks))

        return solve


@dataclass(frozen=True)
class _Given:
    """Strengths that need no choosing."""

    strength: FloatArray
    remarks: tuple[str, ...] = ()

    def __call__(self, model: DampingModel) -> tuple[list[float], list[float]]:
        """Return the strengths, and no error on any fold, for any model."""
        return self.strength.tolist(), [np.nan] * 6


@dataclass(frozen=True, eq=False)
class _Validation:
    """Strengths by cross-validation; the folds are made when a model first asks for them."""

    regression: Regression
    settings: CrossValidated

    @cached_property
    def folds(self) -> tuple[Folds, tuple[Split, ...]]:
        """Which fold each row belongs to, and the triangles of each fold."""
        rows = self.regression.rows
        if rows is None:
            raise MethodError("cross-validation needs the rows: give the `strength` itself")
        made = folds(rows, self.settings.n, self.settings.gap)
        return made, made.splits(rows)

    @property
    def remarks(self) -> tuple[str, ...]:
        """How the folds were made."""
        return (f"Ridge strengths by cross-validation: {self.folds[0].made}.",)

    def __call__(self, model: DampingModel) -> tuple[list[float], list[float]]:
        """Choose a strength for each axis of a model; return them and the errors on the folds."""
        made, splits = self.folds
        fewest = min(split.train.n_samples for split in splits)
        axis = int(np.argmax([len(row) for row in model.terms]))
        if fewest < (needed := len(model.terms[axis])):
            raise MethodError(
                f"cross-validation ({made.made}) leaves {fewest} rows to learn from where "
                f"axis {AXES[axis]} of model '{model.key}' has {needed} terms: give a longer log, "
                "other folds, or the strength itself."
            )
        found = [self._chosen(axis, terms) for axis, terms in enumerate(model.terms)]
        return [strength for strength, _ in found], [error for _, error in found]

    def _chosen(self, axis: int, terms: Sequence[Term]) -> tuple[float, float]:
        """Return the strength of one axis, first from a coarse grid and then from a finer one."""
        if not terms:
            return 0.0, 0.0
        size = column_size(self.regression.triangle, terms)
        errors = _errors(self.folds[1], terms, axis, size, _GRID)
        best = int(errors.argmin())
        low, high = _GRID[[max(best - 1, 0), min(best + 1, len(_GRID) - 1)]].tolist()
        finer = np.geomspace(low, high, _FINER)
        order = np.argsort(both := np.append(_GRID, finer), kind="stable")
        errors = np.append(errors, _errors(self.folds[1], terms, axis, size, finer))[order]
        best = int(errors.argmin())
        return float(both[order][best]), float(np.sqrt(errors[best]))


def _errors(
    splits: Sequence[Split],
    terms: Sequence[Term],
    axis: int,
    size: FloatArray,
    strength: FloatArray,
) -> FloatArray:
    """Return the mean square not predicted on the folds, one a strength."""
    lost = sum(_lost(split, terms, axis, size, strength) for split in splits)
    return np.asarray(lost / sum(split.test.n_samples for split in splits))


def _lost(
    split: Split, terms: Sequence[Term], axis: int, size: FloatArray, strength: FloatArray
) -> FloatArray:
    """Return the squares not predicted on one fold, one sum a strength."""
    span = spanned(split.train.columns(terms), terms, size)
    square = span.singular**2
    kept = square / (square + strength[:, None] * split.train.n_samples)
    amounts = kept * (span.directions.T @ split.train.target(axis))
    rest = split.test.target(axis)[:, None] - split.test.columns(terms) @ (
        span.coefficients @ amounts.T
    )
    squares: FloatArray = np.sum(rest * rest, axis=0)
    return squares


def _said(axis: int, n_terms: int, strength: float, error: float, used: float) -> str:
    """Return what became of an axis, as one sentence."""
    known, at_edge = np.isfinite(error), ""
    if known and strength >= _GRID[-1]:
        at_edge = ", the largest tried: nothing the axis has predicts it"
    elif known and strength <= _GRID[0]:
        at_edge = ", the least tried: no ridge predicts better"
    folds = f", {error:.3g} {'N' if axis < 3 else 'N m'} not predicted on the folds"
    return (
        f"{AXES[axis]}: ridge strength {strength:.2g}{at_edge}{folds if known else ''}; "
        f"{used:.1f} effective of {n_terms} coefficients."
    )
