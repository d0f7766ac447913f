"""Mass matrices: of a rigid body, of a hull, checked, and with zeros for locked axes."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.term import AXES, VELOCITIES
from hydrodamp.errors import VehicleError

SYMMETRY_TOLERANCE = 1e-9
"""Largest asymmetry accepted, relative to the largest entry."""

InertiaPoint = Literal["origin", "center_of_gravity"]
"""The point that moments of inertia are taken about."""


def checked_array(values: npt.ArrayLike, shape: tuple[int | None, ...], what: str) -> FloatArray:
    """Return a read-only array of finite numbers."""
    array = frozen(values, shape, what, VehicleError)
    if not np.isfinite(array).all():
        raise VehicleError(f"`{what}` must be finite; got {array.tolist()}")
    return array


def cross_matrix(vector: npt.ArrayLike) -> FloatArray:
    """Return S with ``S @ b == cross(vector, b)``, for vectors (..., 3) a stack (..., 3, 3)."""
    x, y, z = np.moveaxis(np.asarray(vector, dtype=np.float64), -1, 0)
    zero = np.zeros_like(x)
    rows = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]])
    return np.moveaxis(rows, (0, 1), (-2, -1))


def rigid_body_mass_matrix(
    mass: float,
    inertia: npt.ArrayLike,
    center_of_gravity: npt.ArrayLike = (0.0, 0.0, 0.0),
    inertia_about: InertiaPoint = "origin",
) -> FloatArray:
    """Return the mass matrix of a rigid body about the origin of the body frame."""
    arm = cross_matrix(checked_array(center_of_gravity, (3,), "center_of_gravity"))
    array = np.asarray(inertia, dtype=np.float64)
    steiner = -mass * arm @ arm if inertia_about == "center_of_gravity" else 0.0
    matrix = np.zeros((6, 6))
    matrix[:3, :3] = mass * np.eye(3)
    matrix[:3, 3:] = -mass * arm
    matrix[3:, :3] = mass * arm
    matrix[3:, 3:] = (np.diag(array) if array.ndim == 1 else array) + steiner
    return frozen(matrix)


def checked_mass_matrix(matrix: npt.ArrayLike, axes: Sequence[str] = AXES) -> FloatArray:
    """Return ``matrix`` as a read-only 6 x 6 array, sound on the free axes."""
    free = np.array([AXES.index(axis) for axis in axes])
    full = _six_by_six(matrix, free)
    block = full[np.ix_(free, free)]
    names = [VELOCITIES[index] for index in free]
    gap = np.abs(block - block.T)
    if gap.max() > SYMMETRY_TOLERANCE * np.abs(block).max():
        i, j = divmod(int(np.argmax(gap)), len(axes))
        raise VehicleError(
            f"`mass_matrix` must be symmetric on the free axes; got {block[i, j]:g} in row "
            f"{axes[i]}, column {names[j]} and {block[j, i]:g} in its mirror place. "
            "If the source lists two values, enter their mean in both places."
        )
    block = (block + block.T) / 2.0
    values, vectors = np.linalg.eigh(block)
    if values[0] <= 0.0:
        raise VehicleError(
            f"`mass_matrix` must be positive-definite on the free axes; its smallest eigenvalue is "
            f"{values[0]:.4g} (direction mostly {names[int(np.argmax(np.abs(vectors[:, 0])))]}). "
            "Check the sign of the added mass: derivatives such as M_qdot are negative and enter "
            "as M = M_rigid - M_qdot."
        )
    full[np.ix_(free, free)] = block
    return frozen(full)


def _six_by_six(matrix: npt.ArrayLike, free: npt.NDArray[np.int_]) -> FloatArray:
    array = np.array(checked_array(matrix, (None, None), "mass_matrix"))
    if array.shape == (6, 6):
        return array
    if array.shape != (len(free), len(free)):
        shapes = "(6, 6)" if len(free) == 6 else f"(6, 6) or ({len(free)}, {len(free)})"
        raise VehicleError(f"`mass_matrix` must have shape {shapes}; got {array.shape}")
    full = np.zeros((6, 6))
    full[np.ix_(free, free)] = array
    return full


ROLL_FRACTION = 0.3
"""Added roll inertia over the rigid body's: what the fins of a REMUS 100 add.

The value of the ``remus100`` model of the Marine Systems Simulator (Fossen); a
smooth body of revolution alone has none.
"""

STANDARD_GRAVITY = 9.80665
"""Turns a mass into a weight [m/s^2]."""


def lamb_factors(aspect_ratio: float) -> tuple[float, float, float]:
    """Return Lamb's inertia coefficients of a prolate spheroid: in surge, sway and pitch."""
    if not (math.isfinite(aspect_ratio) and aspect_ratio >= 1.0):
        raise VehicleError(
            f"`length` must be at least `diameter`; got a ratio of {aspect_ratio:g}. "
            "For a body wider than long give the added mass itself."
        )
    e2 = 1.0 - aspect_ratio**-2
    if e2 < 1e-4:  # a sphere, to four digits; nearer to it the formula loses its own
        return 0.5, 0.5, 0.0
    e = math.sqrt(e2)
    alpha = 2.0 * (1.0 - e2) * (math.atanh(e) - e) / e**3
    beta = 1.0 - alpha / 2.0
    slant = (2.0 - e2) * (beta - alpha)
    pitch = e2**2 * (beta - alpha) / ((2.0 - e2) * (2.0 * e2 - slant))
    return alpha / (2.0 - alpha), beta / (2.0 - beta), pitch


def hull_inertia(length: float, diameter: float, mass: float) -> FloatArray:
    """Return the moments of inertia of a homogeneous spheroid about its centre."""
    across = mass * (length**2 + diameter**2) / 20.0
    return frozen([mass * diameter**2 / 10.0, across, across])


def hull_added_mass(
    length: float, diameter: float, displaced_mass: float, roll_inertia: float
) -> FloatArray:
    """Return the added mass of a spheroid with small fins about its centre."""
    surge, sway, pitch = lamb_factors(length / diameter)
    turning = pitch * hull_inertia(length, diameter, displaced_mass)[1]
    along, across = surge * displaced_mass, sway * displaced_mass
    return frozen(np.diag([along, across, across, ROLL_FRACTION * roll_inertia, turning, turning]))


_OPTIONAL = ("source", "note", "actuators")
_RESTORING = ("weight", "buoyancy", "center_of_gravity", "center_of_buoyancy")


def fill_locked_axes(content: Mapping[Any, Any]) -> dict[Any, Any]:
    """Replace empty values of locked axes by zero."""
    axes = content.get("axes")
    locked = {i for i, axis in enumerate(AXES) if isinstance(axes, list) and axis not in axes}
    planar = locked >= {2, 3, 4}
    optional = (*_OPTIONAL, *(_RESTORING if planar else ()))
    filled = {
        key: value for key, value in content.items() if value is not None or key not in optional
    }
    if planar:
        filled = {"weight": 0.0, "buoyancy": 0.0} | filled
    for key in ("center_of_gravity", "center_of_buoyancy"):
        filled[key] = _fill_locked(filled.get(key, [0.0] * 3), {2} if planar else ())
    for key in ("added_mass", "mass_matrix"):
        if isinstance(filled.get(key), list) and len(filled[key]) == 6:
            filled[key] = _fill_locked(filled[key], locked)
    if isinstance(body := filled.get("rigid_body"), dict) and "inertia" in body:
        rotations = {i - 3 for i in locked}
        inertia = (
            [0.0] * 3 if body["inertia"] is None and rotations >= {0, 1, 2} else body["inertia"]
        )
        filled["rigid_body"] = {**body, "inertia": _fill_locked(inertia, rotations)}
    return filled


def _fill_locked(values: Any, locked: Collection[int]) -> Any:
    """Replace None by zero in locked rows and columns of a list or a matrix."""
    if not isinstance(values, list):
        return values
    zero = [0.0] * len(values) if any(isinstance(item, list) for item in values) else 0.0
    return [
        zero
        if item is None and i in locked
        else _fill_locked(item, range(6) if i in locked else locked)
        for i, item in enumerate(values)
    ]
