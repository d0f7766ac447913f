"""Coefficients listed axis by axis: what a method moves, apart from what is known."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, IntArray, frozen
from hydrodamp.errors import ProblemError
from hydrodamp.kernels.plant import whole_numbers


@dataclass(frozen=True, eq=False)
class Entries:
    """Where the coefficients that move stand in the table of equation 1.

    Parameters
    ----------
    rows : array_like of int, shape (n,)
        The row of each in the table: its term.
    axes : array_like of int, shape (n,)
        Its axis, 0 (X) to 5 (N), never falling.
    known : array_like, shape (n_terms, 6)
        The coefficients that do not move, zero where one does.

    Attributes
    ----------
    starts : ndarray of int64, shape (7,)
        Axis i has the coefficients ``starts[i]`` up to ``starts[i + 1]``.

    Raises
    ------
    ProblemError
        If a row or an axis does not exist, or the axes are out of order.

    Examples
    --------
    >>> entries = Entries([0, 1, 1], [0, 0, 5], np.zeros((2, 6)))
    >>> entries.starts.tolist(), entries.n_squares
    ([0, 2, 2, 2, 2, 2, 3], 5)
    """

    rows: IntArray
    axes: IntArray
    known: FloatArray
    starts: IntArray = field(init=False)

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        rows = whole_numbers(self.rows, "rows").copy()
        axes = whole_numbers(self.axes, "axes").copy()
        try:
            known = frozen(self.known, (None, 6), "known")
        except ValueError as error:
            raise ProblemError(str(error)) from error
        if rows.ndim != 1 or rows.shape != axes.shape:
            raise ProblemError(
                f"`rows` and `axes` must have one shape (n,); got {rows.shape} and {axes.shape}"
            )
        if np.any((rows < 0) | (rows >= len(known)) | (axes < 0) | (axes > 5)):
            raise ProblemError(f"`rows` must lie in 0..{len(known) - 1} and `axes` in 0..5")
        if np.any(np.diff(axes) < 0):
            raise ProblemError("`axes` must not fall: list the coefficients axis by axis")
        starts = np.concatenate([[0], np.cumsum(np.bincount(axes, minlength=6))])
        for name, array in {"rows": rows, "axes": axes, "starts": starts}.items():
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        object.__setattr__(self, "known", known)

    @property
    def n(self) -> int:
        """How many coefficients there are."""
        return len(self.rows)

    @property
    def n_squares(self) -> int:
        """How many numbers one square matrix an axis has, all together."""
        return int((np.diff(self.starts) ** 2).sum())

    def of(self, axis: int) -> slice:
        """Return where the coefficients of an axis stand among all."""
        return slice(int(self.starts[axis]), int(self.starts[axis + 1]))

    def squares(self, packed: FloatArray) -> list[FloatArray]:
        """Return one square matrix an axis, as views of a packed array.

        Parameters
        ----------
        packed : ndarray, shape (n_squares,)
            One behind the other, row by row.

        Returns
        -------
        matrices : list of ndarray, shape (n_i, n_i)
            Six of them; some may be empty.
        """
        sizes = np.diff(self.starts)
        ends = np.cumsum(sizes**2)
        return [packed[end - n * n : end].reshape(n, n) for n, end in zip(sizes, ends, strict=True)]

    @staticmethod
    def packed(matrices: Iterable[npt.ArrayLike]) -> FloatArray:
        """Return square matrices one behind the other, the inverse of :meth:`squares`."""
        flat = [np.asarray(matrix, dtype=np.float64).ravel() for matrix in matrices]
        return np.concatenate([np.zeros(0), *flat])
