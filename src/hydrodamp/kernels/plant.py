"""The plant of eq. 1 as arrays, and which of its coefficients move."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import BoolArray, FloatArray, IndexArray, IntArray, frozen
from hydrodamp.errors import ProblemError

FIXED_ATOMS = 21  # atoms that every plant has; channels and their absolute values follow


@dataclass(frozen=True, eq=False)
class Plant:
    """What the equation of motion needs besides its coefficients.

    The order of atoms that ``factors`` (n_terms, 4) points into, for m channels, is: 0 the
    constant one, 1-6 u v w p q r, 7-12 their absolute values, 13 U, 14 V, 15 V_v, 16 V_w,
    17 (eta-1), 18-20 the down vector in the body frame, then m channels, then their m absolute
    values. The mass matrix is rigid body plus added mass, symmetric (but for rounding) and
    positive definite on the ``free`` axes; the velocity of a locked one stays zero.
    """

    mass_matrix: FloatArray
    free: BoolArray
    factors: IndexArray
    n_channels: int
    mass_columns: FloatArray = field(init=False, repr=False)  # the transpose, as C reads it

    def __post_init__(self) -> None:
        """Copy and freeze the arrays, the mass matrix made symmetric."""
        free = np.array(self.free, dtype=np.bool_).reshape(6)
        free.setflags(write=False)
        mass = frozen(self.mass_matrix, (6, 6), "mass_matrix")
        mass = frozen(np.where(np.logical_and.outer(free, free), 0.5 * (mass + mass.T), mass))
        object.__setattr__(self, "mass_matrix", mass)
        object.__setattr__(self, "mass_columns", frozen(mass.T))
        object.__setattr__(self, "free", free)
        object.__setattr__(self, "factors", checked_factors(self.factors, self.n_channels))

    @property
    def n_terms(self) -> int:
        """Return the number of terms, the rows of a coefficient matrix."""
        return len(self.factors)


@dataclass(frozen=True, eq=False)
class Entries:
    """Where the coefficients that move stand in the table of equation 1, axis by axis.

    ``rows`` (n,) says which term each belongs to, ``axes`` (n,) which axis, 0 (X) to 5 (N),
    never falling; ``known`` (n_terms, 6) holds what does not move, zero where one does. Axis i
    has the coefficients ``starts[i]`` up to ``starts[i + 1]``.
    """

    rows: IndexArray
    axes: IndexArray
    known: FloatArray
    starts: IndexArray = field(init=False)

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        rows, axes = whole_numbers(self.rows, "rows"), whole_numbers(self.axes, "axes")
        known = frozen(self.known, (None, 6), "known")
        if np.any((rows < 0) | (rows >= len(known)) | (axes < 0) | (axes > 5)):
            raise ProblemError(f"`rows` must lie in 0..{len(known) - 1} and `axes` in 0..5")
        if rows.shape != axes.shape or np.any(np.diff(axes) < 0):
            raise ProblemError("`axes` must not fall, one a row: list coefficients axis by axis")
        starts = np.concatenate([[0], np.cumsum(np.bincount(axes, minlength=6))])
        for name, array in {"rows": rows, "axes": axes, "starts": starts}.items():
            narrow = array.astype(np.int32)
            narrow.setflags(write=False)
            object.__setattr__(self, name, narrow)
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
        """Return six square matrices, one an axis, as views of an array that holds them."""
        sizes = np.diff(self.starts)
        ends = np.cumsum(sizes**2)
        return [packed[end - n * n : end].reshape(n, n) for n, end in zip(sizes, ends, strict=True)]


def checked_factors(factors: npt.ArrayLike, n_channels: int) -> IndexArray:
    """Return ``factors`` as a read-only int32 table whose atoms all exist."""
    table = whole_numbers(factors, "factors")
    n_atoms = FIXED_ATOMS + 2 * n_channels
    if table.ndim != 2 or table.shape[1] != 4 or np.any((table < 0) | (table >= n_atoms)):
        raise ProblemError(
            f"`factors` must have shape (n_terms, 4) and lie in 0..{n_atoms - 1} with {n_channels} "
            f"channels; got {table.shape}, {table.min(initial=0)}..{table.max(initial=0)}"
        )
    narrow = table.astype(np.int32)
    narrow.setflags(write=False)
    return narrow


def whole_numbers(values: npt.ArrayLike, name: str) -> IntArray:
    """Return ``values`` as C-contiguous int64; nothing is cut off or wrapped round."""
    given = np.asarray(values)
    if given.size and given.dtype.kind not in "iu":
        raise ProblemError(f"`{name}` must be whole numbers; got {given.dtype}")
    return np.ascontiguousarray(given, dtype=np.int64)
