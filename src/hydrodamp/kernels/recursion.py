"""Settings and state of recursive least squares, arrays only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.errors import ProblemError
from hydrodamp.kernels.entries import Entries
from hydrodamp.kernels.track import Track


@dataclass(frozen=True, eq=False)
class Recursion:
    """The settings of recursive least squares with directional forgetting.

    Parameters
    ----------
    entries : Entries
        The coefficients that move.
    unit : array_like, shape (n,)
        Standard deviation of each coefficient before any data, over that of the
        noise of a row; zero holds it.
    block : float
        Length of a block [s]; a row spans two.
    forgetting : float, optional
        Share of the information along a row that the row replaces, below one.

    Raises
    ------
    ProblemError
        If a shape is wrong or a number out of range.
    """

    entries: Entries
    unit: FloatArray
    block: float
    forgetting: float = 0.0

    def __post_init__(self) -> None:
        """Copy, check and freeze the array."""
        try:
            unit = frozen(self.unit, (self.entries.n,), "unit")
        except ValueError as error:
            raise ProblemError(str(error)) from error
        if not np.all(np.isfinite(unit) & (unit >= 0.0)):
            raise ProblemError("`unit` must be finite and zero or more")
        if not (np.isfinite(self.block) and self.block > 0.0):
            raise ProblemError(f"`block` must be positive and finite; got {self.block}")
        if not 0.0 <= self.forgetting < 1.0:
            raise ProblemError(f"`forgetting` must lie in [0, 1); got {self.forgetting}")
        object.__setattr__(self, "unit", unit)


@dataclass(frozen=True, eq=False, slots=True)
class Estimate:
    """What recursive least squares knows.

    Attributes
    ----------
    coefficients : ndarray, shape (n,)
        The estimate.
    information : ndarray, shape (n_squares,)
        What the data tell, one matrix an axis, packed, in the unit of each
        coefficient; that of the prior is the identity and not counted in.
    noise : ndarray, shape (6,)
        Running variance of what rows leave over, [N s]^2 or [N m s]^2; later rows
        count more, for a bad start is no noise.
    rows : ndarray, shape (6,)
        How many rows there were.
    """

    coefficients: FloatArray
    information: FloatArray
    noise: FloatArray
    rows: FloatArray

    @classmethod
    def before(cls, entries: Entries, coefficients: FloatArray) -> Estimate:
        """Return what is known before any data."""
        estimate = np.array(coefficients, dtype=np.float64)
        return cls(estimate, np.zeros(entries.n_squares), np.zeros(6), np.zeros(6))


@dataclass(frozen=True, eq=False, slots=True)
class Recurred:
    """What a run of recursive least squares leaves behind.

    Attributes
    ----------
    estimate : Estimate
        After the last step.
    block : ndarray, shape (2 + 3 (n_terms + 6),)
        The block under way; see :func:`hydrodamp.kernels.block_step`.
    track : Track
        Noise variances and coefficients on the way, where asked for.
    """

    estimate: Estimate
    block: FloatArray
    track: Track


def block_size(n_terms: int) -> int:
    """Return how many numbers the block under way has.

    Parameters
    ----------
    n_terms : int
        Rows of the table of equation 1.

    Returns
    -------
    size : int
        Two for the clock, then sum, first moment and risen half of a row.
    """
    return 2 + 3 * (n_terms + 6)
