"""Arguments of the kernels, checked once before a batch runs."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, IndexArray, IntArray
from hydrodamp.errors import ProblemError
from hydrodamp.kernels.inputs import PACKED, Inputs, Sample
from hydrodamp.kernels.plant import Plant, whole_numbers


def floats(values: npt.ArrayLike, shape: tuple[int, ...], name: str) -> FloatArray:
    """Return ``values`` as C-contiguous float64 of exactly this shape.

    Parameters
    ----------
    values : array_like
        Numbers; not copied where they already have the form.
    shape : tuple of int
        The shape required.
    name : str
        How the message calls the array.

    Returns
    -------
    array : ndarray
        The values.

    Raises
    ------
    ProblemError
        If the shape is another one.

    Examples
    --------
    >>> floats([1, 2], (2,), "pair")
    array([1., 2.])
    """
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.shape != shape:
        raise ProblemError(f"`{name}` must have shape {shape}; got {array.shape}")
    return array


def coefficients(plant: Plant, matrix: npt.ArrayLike, name: str = "matrix") -> FloatArray:
    """Return ``matrix`` as float64 of shape (n_terms, 6).

    Parameters
    ----------
    plant : Plant
        Whose terms they are.
    matrix : array_like, shape (n_terms, 6)
        One row a term.
    name : str, optional
        How the message calls the array.

    Returns
    -------
    matrix : ndarray, shape (n_terms, 6)
        The same numbers.
    """
    return floats(matrix, (plant.n_terms, 6), name)


def matching(plant: Plant, inputs: Inputs) -> None:
    """Refuse inputs whose channels are not the plant's.

    Parameters
    ----------
    plant : Plant
        Whose terms use the channels.
    inputs : Inputs
        Whose channels drive it.

    Raises
    ------
    ProblemError
        If the numbers of channels differ.
    """
    if inputs.n_channels != plant.n_channels:
        raise ProblemError(
            f"`inputs.channels` must have {plant.n_channels} columns, as the plant has channels; "
            f"got {inputs.n_channels}"
        )


def check_step(
    plant: Plant,
    a: npt.ArrayLike,
    gamma: npt.ArrayLike,
    matrix: npt.ArrayLike,
    error: npt.ArrayLike,
    *samples: Sample,
) -> None:
    """Refuse arguments of one identifier step that do not fit the plant.

    Parameters
    ----------
    plant : Plant
        Whose terms and channels count.
    a, error : array_like, shape (6,)
        Error gains, velocity error.
    gamma, matrix : array_like, shape (n_terms, 6)
        Adaptation gains, coefficients.
    *samples : Sample
        Both ends of the step.

    Raises
    ------
    ProblemError
        Naming what does not fit.
    """
    floats(a, (6,), "a")
    coefficients(plant, gamma, "gamma")
    coefficients(plant, matrix)
    floats(error, (6,), "error")
    check_samples(plant, *samples)


def check_samples(plant: Plant, *samples: Sample) -> None:
    """Refuse samples whose channels are not the plant's.

    Parameters
    ----------
    plant : Plant
        Whose terms use the channels.
    *samples : Sample
        One or more.

    Raises
    ------
    ProblemError
        If the numbers of channels differ.
    """
    for sample in samples:
        found = len(sample.values) - PACKED
        if found != plant.n_channels:
            raise ProblemError(
                f"a sample must have {plant.n_channels} channels, as the plant has; got {found}"
            )


def spans(segments: npt.ArrayLike, n: int) -> IntArray:
    """Return segments as int64 rows (start, stop) inside ``n`` samples.

    Parameters
    ----------
    segments : array_like of int, shape (s, 2)
        First sample of each segment and the one after its last.
    n : int
        How many samples there are.

    Returns
    -------
    segments : ndarray of int64, shape (s, 2)
        The same numbers.

    Raises
    ------
    ProblemError
        If a segment is empty or leaves the samples.

    Examples
    --------
    >>> spans([(0, 3)], 3).shape
    (1, 2)
    """
    rows = whole_numbers(segments, "segments")
    if rows.ndim != 2 or rows.shape[1] != 2:
        raise ProblemError(f"`segments` must have shape (s, 2); got {rows.shape}")
    for start, stop in rows.tolist():
        if not 0 <= start < stop <= n:
            raise ProblemError(
                f"`segments` must hold rows 0 <= start < stop <= {n}; got ({start}, {stop})"
            )
    return rows


def places(plant: Plant, parameters: npt.ArrayLike) -> IndexArray:
    """Return the places of free coefficients as int32 rows (term, axis).

    Parameters
    ----------
    plant : Plant
        Whose coefficients they are.
    parameters : array_like of int, shape (p, 2)
        Row and column of each parameter in the coefficient matrix.

    Returns
    -------
    parameters : ndarray of int32, shape (p, 2)
        The same numbers.

    Raises
    ------
    ProblemError
        If a place lies outside the coefficient matrix.
    """
    rows = whole_numbers(parameters, "parameters")
    rows = rows.reshape(0, 2) if rows.size == 0 else rows
    if rows.ndim != 2 or rows.shape[1] != 2:
        raise ProblemError(f"`parameters` must have shape (p, 2); got {rows.shape}")
    outside = (rows < 0) | (rows >= np.array([plant.n_terms, 6]))
    if outside.any():
        raise ProblemError(
            f"`parameters` must name a term below {plant.n_terms} and an axis below 6; "
            f"got {tuple(rows[outside.any(axis=1)][0].tolist())}"
        )
    return rows.astype(np.int32)


def positive(value: float, name: str) -> float:
    """Return ``value`` if it is above zero.

    Parameters
    ----------
    value : float
        A step or a limit.
    name : str
        How the message calls it.

    Returns
    -------
    value : float
        The same number.

    Raises
    ------
    ProblemError
        If it is zero, negative or not a number.

    Examples
    --------
    >>> positive(0.05, "max_step")
    0.05
    """
    if not value > 0.0:
        raise ProblemError(f"`{name}` must be positive; got {value}")
    return float(value)


def at_least(name: str, value: int, least: int) -> None:
    """Refuse a count below its least value.

    Parameters
    ----------
    name : str
        How the message calls it.
    value, least : int
        What was given and what is required.

    Raises
    ------
    ProblemError
        If ``value`` is below ``least``.
    """
    if value < least:
        raise ProblemError(f"`{name}` must be at least {least}; got {value}")


def rows_of(values: npt.ArrayLike, n: int, name: str) -> FloatArray:
    """Return ``values`` as C-contiguous float64 with ``n`` rows of any length.

    Parameters
    ----------
    values : array_like, shape (n, m)
        Numbers.
    n : int
        How many rows there must be.
    name : str
        How the message calls the array.

    Returns
    -------
    array : ndarray, shape (n, m)
        The values.

    Raises
    ------
    ProblemError
        If it is not a table of n rows.
    """
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.ndim != 2 or len(array) != n:
        raise ProblemError(f"`{name}` must have shape ({n}, m); got {array.shape}")
    return array


def destination(out: FloatArray | None, n: int, n_terms: int) -> FloatArray:
    """Return ``out``, checked, or a new array with contiguous columns.

    Parameters
    ----------
    out : ndarray or None
        What the caller gave.
    n, n_terms : int
        The shape required.

    Returns
    -------
    out : ndarray, shape (n, n_terms)
        Float64, writable.

    Raises
    ------
    ProblemError
        If shape, dtype or alignment of ``out`` differ, or it cannot be written.
    """
    if out is None:
        return np.empty((n, n_terms), order="F")
    whole = out.flags.writeable and not any(stride % 8 for stride in out.strides)
    if out.shape != (n, n_terms) or out.dtype != np.float64 or not whole:
        raise ProblemError(
            f"`out` must be writable float64 of shape ({n}, {n_terms}), its strides whole numbers "
            f"of entries; got {out.dtype} {out.shape} with strides {out.strides} bytes"
        )
    return out
