"""Arguments of the estimators' kernels that must fit each other."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.errors import ProblemError
from hydrodamp.kernels.arguments import floats
from hydrodamp.kernels.entries import Entries
from hydrodamp.kernels.plant import Plant


def fitting(plant: Plant, entries: Entries, coefficients: npt.ArrayLike) -> FloatArray:
    """Return coefficients as float64, one an entry of the plant's table.

    Parameters
    ----------
    plant : Plant
        Whose terms they are.
    entries : Entries
        Where they stand.
    coefficients : array_like, shape (n,)
        One an entry.

    Returns
    -------
    coefficients : ndarray, shape (n,)
        The same numbers.

    Raises
    ------
    ProblemError
        If the table has not one row a term, or there is not one number an entry.
    """
    if len(entries.known) != plant.n_terms:
        raise ProblemError(
            f"`entries.known` must have {plant.n_terms} rows, as the plant has terms; "
            f"got {len(entries.known)}"
        )
    return floats(coefficients, (entries.n,), "coefficients")


def steps_in(segments: IntArray) -> int:
    """Return how many steps between samples some segments have.

    Parameters
    ----------
    segments : ndarray of int64, shape (s, 2)
        First sample of each and the one after its last.

    Returns
    -------
    steps : int
        One fewer than samples in each.
    """
    return int((np.diff(segments, axis=1) - 1).sum())
