"""Arrays of checked shape, and read-only copies."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt

from hydrodamp.errors import MethodError

#: Largest number of a file [SI]: its square has a double, and no coefficient comes near.
MAX_MAGNITUDE = 1e30

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
IndexArray = npt.NDArray[np.int32]
BoolArray = npt.NDArray[np.bool_]
Shape = tuple[int | None, ...]


def as_shape(
    values: npt.ArrayLike,
    shape: Shape | None = None,
    name: str = "values",
    error: type[ValueError] = ValueError,
    dtype: npt.DTypeLike = np.float64,
) -> npt.NDArray[Any]:
    """Return ``values`` as a C-contiguous array of a shape, where None is any length."""
    try:
        array = np.asarray(values, dtype=dtype, order="C")
    except (TypeError, ValueError) as cause:
        raise error(f"`{name}` must be numbers: {cause}") from cause
    if shape is not None and not _shapes_match(array.shape, shape):
        wanted = ", ".join("n" if length is None else str(length) for length in shape)
        raise error(f"`{name}` must have shape ({wanted}); got {array.shape}")
    return array


def frozen(values: npt.ArrayLike, *check: Any) -> npt.NDArray[Any]:
    """Return ``values`` as an array of checked shape (:func:`as_shape`) that nobody can write.

    It is a copy, unless it is read-only already and no view of another array.
    """
    array = as_shape(values, *check)
    if array.flags.writeable or array.base is not None:
        array = array.copy()
        array.setflags(write=False)
    return array


def freeze(
    owner: object,
    error: type[ValueError] = ValueError,
    dtype: npt.DTypeLike = np.float64,
    **shapes: Shape,
) -> None:
    """Check arrays of a frozen dataclass, and replace them by read-only copies."""
    for name, shape in shapes.items():
        array = frozen(getattr(owner, name), shape, name, error, dtype)
        object.__setattr__(owner, name, array)


def _shapes_match(found: tuple[int, ...], wanted: Shape) -> bool:
    return len(found) == len(wanted) and all(
        want is None or want == got for got, want in zip(found, wanted, strict=True)
    )


#: Standard deviation of a normal distribution over its median absolute deviation, 1 / Φ⁻¹(3/4).
_STD_PER_MAD = 1.482602218505602


def jackknife_covariance(estimates: FloatArray) -> FloatArray:
    """Return the covariance of an estimate from its n values (n, p) without one of n blocks."""
    n = len(estimates)
    deviations = estimates - np.mean(estimates, axis=0)
    return np.asarray((n - 1) / n * (deviations.T @ deviations))


def mad_std(deviations: FloatArray, axis: int | None = None) -> FloatArray:
    """Return the robust standard deviation of deviations from a centre: 1.4826 median |x|."""
    scale: FloatArray = _STD_PER_MAD * np.median(np.abs(deviations), axis=axis)
    return scale


@contextmanager
def factorisation(matrix: str) -> Iterator[None]:
    """Raise MethodError if a matrix cannot be factorised."""
    try:
        yield
    except np.linalg.LinAlgError as error:
        raise MethodError(
            f"the {matrix} cannot be factorised ({error}): numbers of the log are too large, or"
            " do not determine the model"
        ) from error


@factorisation("covariance")
def covariance_root(covariance: FloatArray) -> FloatArray:
    """Return R with ``R Rᵀ`` the covariance, by an eigendecomposition of the correlation."""
    scale = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    unit = np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(unit, unit))
    return np.asarray(unit[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))
