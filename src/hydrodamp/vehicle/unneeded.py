"""What a vehicle with fewer axes need not say: it counts as zero."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hydrodamp.basis.axes import AXES

_OPTIONAL = ("source", "note", "actuators")


def without_unneeded(content: Mapping[Any, Any]) -> dict[Any, Any]:
    """Return a vehicle file with zeros where a locked axis left something empty."""
    filled = {
        key: value for key, value in content.items() if value is not None or key not in _OPTIONAL
    }
    axes = content.get("axes")
    if not isinstance(axes, list):
        return filled
    locked = frozenset(i for i, axis in enumerate(AXES) if axis not in axes)
    if locked >= {2, 3, 4}:
        filled |= {key: 0.0 for key in ("weight", "buoyancy") if filled.get(key) is None}
        for key in ("center_of_gravity", "center_of_buoyancy"):
            filled[key] = _vector(filled.get(key))
    for key in ("added_mass", "mass_matrix"):
        if key in filled:
            filled[key] = _matrix(filled[key], AXES, locked)
    if isinstance(body := filled.get("rigid_body"), dict) and "inertia" in body:
        filled["rigid_body"] = {**body, "inertia": _inertia(body["inertia"], locked)}
    return filled


def _vector(given: Any) -> Any:
    """Return the origin for no vector, and a height of zero where it is left empty."""
    if given is None:
        return [0.0, 0.0, 0.0]
    if isinstance(given, list) and len(given) == 3 and given[2] is None:
        return [*given[:2], 0.0]
    return given


def _inertia(given: Any, locked: frozenset[int]) -> Any:
    turned = frozenset(i - 3 for i in locked if i >= 3)
    if given is None and len(turned) == 3:
        return [0.0, 0.0, 0.0]
    if isinstance(given, list) and not any(isinstance(row, list) for row in given):
        return [_number(value, i in turned) for i, value in enumerate(given)]
    return _matrix(given, AXES[3:], turned)


def _matrix(given: Any, axes: tuple[str, ...], locked: frozenset[int]) -> Any:
    """Return a square table whose empty entries in rows and columns of locked axes are zero."""
    size = len(axes)
    if not isinstance(given, list) or len(given) != size:
        return given
    rows = [[None] * size if row is None and i in locked else row for i, row in enumerate(given)]
    return [
        [_number(value, i in locked or j in locked) for j, value in enumerate(row)]
        if isinstance(row, list)
        else row
        for i, row in enumerate(rows)
    ]


def _number(value: Any, unneeded: bool) -> Any:
    return 0.0 if value is None and unneeded else value
