"""Checks at the door of a vehicle and its actuators."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.atoms import check_command_name
from hydrodamp.basis.axes import AXES
from hydrodamp.errors import TermError, VehicleError
from hydrodamp.vehicle.actuation import Actuator, Gains


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


def checked_gains(gains: Gains, what: str) -> tuple[tuple[str, float], ...]:
    """Return axis gains as pairs in the order of the axes."""
    given = dict(gains)
    for axis, value in given.items():
        if axis not in AXES:
            raise VehicleError(f"`{what}` must name axes of {' '.join(AXES)}; got {axis!r}")
        checked_number(value, f"{what} {axis}")
    return tuple((axis, float(given[axis])) for axis in AXES if axis in given)


def checked_table(values: Any, shape: tuple[int | None, ...], what: str) -> Any:
    """Return a small array of finite numbers as nested tuples."""
    return _nested(checked_array(values, shape, what).tolist())


def check_command(command: str, name: str, limit: float | None) -> None:
    """Raise if the command, the name of its channel or its limit cannot be."""
    checked_name(command, "command")
    if name:
        checked_name(name, "name")
    if limit is not None:
        checked_number(limit, "limit", positive=True)


def checked_zone(zone: Sequence[float] | None) -> tuple[float, ...] | None:
    """Return a dead zone whose ends are in order."""
    if zone is None:
        return None
    low, high = checked_table(zone, (2,), "dead_zone")
    if low > high:
        raise VehicleError(f"`dead_zone` must be (lowest, highest); got ({low:g}, {high:g})")
    return low, high


def checked_axes(axes: tuple[str, ...]) -> tuple[str, ...]:
    """Return the free axes if they are some of the six, in order."""
    given = tuple(axes)
    if not given or given != tuple(axis for axis in AXES if axis in given):
        got = " ".join(given) or "none"
        raise VehicleError(f"`axes` must be some of {' '.join(AXES)}, in this order; got {got}")
    return given


def checked_actuators(actuators: tuple[Actuator, ...]) -> tuple[Actuator, ...]:
    """Return actuators whose channels do not collide."""
    raw = {name for actuator in actuators for name in actuator.commands}
    seen: set[str] = set()
    for name in (name for actuator in actuators for name in actuator.derived):
        if name in seen or name in raw:
            other = "a command" if name in raw else "another actuator's channel"
            raise VehicleError(
                f"`actuators`: the channel `{name}` has the name of {other}; give the actuator "
                "a `name` of its own"
            )
        seen.add(name)
    return actuators


def checked_force(value: float, what: str) -> float:
    """Return a weight or a buoyancy, zero or positive."""
    if not (math.isfinite(value) and value >= 0.0):
        raise VehicleError(f"`{what}` must be zero or positive [N]; got {value}")
    return float(value)


def checked_array(values: npt.ArrayLike, shape: tuple[int | None, ...], what: str) -> FloatArray:
    """Return a read-only array of finite numbers."""
    try:
        array = frozen(values, shape, what)
    except ValueError as error:
        raise VehicleError(str(error)) from error
    if not np.isfinite(array).all():
        raise VehicleError(f"`{what}` must be finite; got {array.tolist()}")
    return array


def _nested(values: Any) -> Any:
    return tuple(_nested(value) for value in values) if isinstance(values, list) else values
