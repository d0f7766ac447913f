"""Read-only float64 arrays, copied at the door."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
IndexArray = npt.NDArray[np.int32]
BoolArray = npt.NDArray[np.bool_]


def frozen(
    values: npt.ArrayLike,
    shape: tuple[int | None, ...] | None = None,
    name: str = "values",
    error: type[ValueError] = ValueError,
) -> FloatArray:
    """Copy ``values`` into a C-contiguous float64 array that cannot be written."""
    try:
        array = np.array(values, dtype=np.float64, order="C", copy=True)
    except (TypeError, ValueError) as cause:
        raise error(f"`{name}` must be numbers: {cause}") from cause
    if shape is not None and not _fits(array.shape, shape):
        wanted = ", ".join("n" if length is None else str(length) for length in shape)
        raise error(f"`{name}` must have shape ({wanted}); got {array.shape}")
    array.setflags(write=False)
    return array


def _fits(found: tuple[int, ...], wanted: tuple[int | None, ...]) -> bool:
    return len(found) == len(wanted) and all(
        want is None or want == got for got, want in zip(found, wanted, strict=True)
    )
