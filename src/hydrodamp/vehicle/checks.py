"""Checks at the door of a vehicle and its actuators."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.atoms import AXES, check_command_name
from hydrodamp.errors import TermError, VehicleError


def checked_name(name: str, what: str) -> str:
    """Return ``name`` if a command or channel may be called so."""
    try:
        check_command_name(name)
    except TermError as error:
        raise VehicleError(f"`{what}`: {error}") from error
    return name


def checked_number(value: float, what: str, *, positive: bool = False) -> float:
    """Return ``value`` as a finite float."""
    if not math.isfinite(value) or (positive and value <= 0.0):
        wanted = "a positive number" if positive else "a finite number"
        raise VehicleError(f"`{what}` must be {wanted}; got {value}")
    return float(value)


def checked_table(values: Any, shape: tuple[int | None, ...], what: str) -> Any:
    """Return a small array of finite numbers as nested tuples."""
    return _nested(checked_array(values, shape, what).tolist())


def checked_axes(axes: Iterable[str]) -> tuple[str, ...]:
    """Return the free axes if they are some of the six, in order."""
    given = tuple(axes)
    if not given or given != tuple(axis for axis in AXES if axis in given):
        got = " ".join(given) or "none"
        raise VehicleError(f"`axes` must be some of {' '.join(AXES)}, in this order; got {got}")
    return given


def checked_array(values: npt.ArrayLike, shape: tuple[int | None, ...], what: str) -> FloatArray:
    """Return a read-only array of finite numbers."""
    array = frozen(values, shape, what, VehicleError)
    if not np.isfinite(array).all():
        raise VehicleError(f"`{what}` must be finite; got {array.tolist()}")
    return array


def _nested(values: Any) -> Any:
    return tuple(_nested(value) for value in values) if isinstance(values, list) else values
