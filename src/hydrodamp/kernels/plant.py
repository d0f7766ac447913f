"""The plant of eq. 1 as arrays: mass matrix, free axes and the table of terms."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import BoolArray, FloatArray, IndexArray, IntArray, frozen
from hydrodamp.errors import ProblemError

FIXED_ATOMS = 21
"""Atoms that every plant has; channels and their absolute values follow."""


@dataclass(frozen=True, eq=False)
class Plant:
    """What the equation of motion needs besides its coefficients.

    The order of atoms that ``factors`` points into, for m channels, is:
    0 the constant one, 1-6 u v w p q r, 7-12 their absolute values,
    13 U, 14 V, 15 V_v, 16 V_w, 17 (eta-1), 18-20 the down vector in the body
    frame, then m channels, then their m absolute values.

    Parameters
    ----------
    mass_matrix : array_like, shape (6, 6)
        Rigid body plus added mass [kg, kg m, kg m^2], body frame, symmetric
        and positive definite on the free axes. In the paper this is M.
    free : array_like of bool, shape (6,)
        False where an axis is locked: its velocity stays zero.
    factors : array_like of int, shape (n_terms, 4)
        The atoms whose product is the term; 0 where a place is unused.
    n_channels : int
        How many command channels drive the terms.

    Attributes
    ----------
    mass_columns : ndarray, shape (6, 6)
        The transpose of ``mass_matrix``, as the compiled core reads it.

    Raises
    ------
    ProblemError
        If a shape is wrong, an atom does not exist, or the mass matrix is not
        symmetric (to rounding; it is then made so exactly) and positive
        definite on the free axes.

    Examples
    --------
    >>> Plant(np.eye(6), [True] * 6, [[1, 7, 0, 0]], 0).n_terms
    1
    """

    mass_matrix: FloatArray
    free: BoolArray
    factors: IndexArray
    n_channels: int
    mass_columns: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        try:
            mass = frozen(self.mass_matrix, (6, 6), "mass_matrix")
        except ValueError as error:
            raise ProblemError(str(error)) from error
        free = np.array(self.free, dtype=np.bool_)
        if free.shape != (6,):
            raise ProblemError(f"`free` must have shape (6,); got {free.shape}")
        free.setflags(write=False)
        if self.n_channels < 0:
            raise ProblemError(f"`n_channels` must be at least 0; got {self.n_channels}")
        _check_mass(mass, free)
        both_free = np.logical_and.outer(free, free)
        mass = frozen(np.where(both_free, 0.5 * (mass + mass.T), mass))
        object.__setattr__(self, "mass_matrix", mass)
        object.__setattr__(self, "mass_columns", frozen(mass.T))
        object.__setattr__(self, "free", free)
        object.__setattr__(self, "factors", checked_factors(self.factors, self.n_channels))

    @property
    def n_terms(self) -> int:
        """Return the number of terms, the rows of a coefficient matrix."""
        return len(self.factors)

    @property
    def effective_mass(self) -> FloatArray:
        """Return the mass matrix with locked rows and columns of the identity [kg, ...]."""
        both_free = np.logical_and.outer(self.free, self.free)
        return np.where(both_free, self.mass_matrix, np.eye(6))


def checked_factors(factors: npt.ArrayLike, n_channels: int) -> IndexArray:
    """Return ``factors`` as a read-only int32 table whose atoms all exist.

    Parameters
    ----------
    factors : array_like of int, shape (n_terms, 4)
        The atoms of every term.
    n_channels : int
        How many command channels there are.

    Returns
    -------
    table : ndarray of int32, shape (n_terms, 4)
        A C-contiguous copy.

    Raises
    ------
    ProblemError
        If the shape is wrong or an atom does not exist.

    Examples
    --------
    >>> checked_factors([[1, 2, 0, 0]], 0).dtype
    dtype('int32')
    """
    table = whole_numbers(factors, "factors")
    if table.ndim != 2 or table.shape[1] != 4:
        raise ProblemError(f"`factors` must have shape (n_terms, 4); got {table.shape}")
    n_atoms = FIXED_ATOMS + 2 * n_channels
    if table.size and (int(table.min()) < 0 or int(table.max()) >= n_atoms):
        raise ProblemError(
            f"`factors` must lie in 0..{n_atoms - 1} with {n_channels} channels; "
            f"got {int(table.min())}..{int(table.max())}"
        )
    narrow = table.astype(np.int32)
    narrow.setflags(write=False)
    return narrow


def whole_numbers(values: npt.ArrayLike, name: str) -> IntArray:
    """Return ``values`` as C-contiguous int64; nothing is cut off or wrapped round.

    Parameters
    ----------
    values : array_like of int
        Places in an array; an empty list will do.
    name : str
        How the message calls them.

    Returns
    -------
    values : ndarray of int64
        The same numbers.

    Raises
    ------
    ProblemError
        If they are not whole numbers.

    Examples
    --------
    >>> whole_numbers([[0, 3]], "segments").tolist()
    [[0, 3]]
    """
    given = np.asarray(values)
    if given.size and given.dtype.kind not in "iu":
        raise ProblemError(f"`{name}` must be whole numbers; got {given.dtype}")
    return np.ascontiguousarray(given, dtype=np.int64)


def _check_mass(mass: FloatArray, free: BoolArray) -> None:
    block = mass[np.ix_(free, free)]
    if not np.allclose(block, block.T, rtol=1e-9, atol=1e-9 * np.abs(block).max(initial=0.0)):
        raise ProblemError("`mass_matrix` must be symmetric on the free axes")
    if len(block) and not float(np.linalg.eigvalsh(block)[0]) > 0.0:
        raise ProblemError(
            "`mass_matrix` must be positive definite on the free axes; its smallest "
            f"eigenvalue is {np.linalg.eigvalsh(block)[0]:.6g}"
        )
