"""Axes of body and world, units of rates, and whether velocities are turned: with the evidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.attitude import quaternion_from_euler, rotation, turn
from hydrodamp.data.units import UNITS
from hydrodamp.ingest.probing.motion import NONE, Agreement, changes, compared, whole_rows
from hydrodamp.ingest.probing.series import Series, together

MIRROR = np.array([1.0, -1.0, -1.0])
"""Turns FRD components into FLU and back."""

_RATE_UNITS = ("rad/s", "deg/s", "rpm", "rev/s")
_NEAR = 0.25  # of a ratio, about that of a unit
_MARGIN = 0.03  # of a correlation, over the next best
_EULER = ("roll", "pitch", "yaw")
_TURNS = 6.5  # rad; an angle beyond is in degrees
_UNIT_NORM = 0.1

Roles = Mapping[str, Series]
"""For every role the series that plays it."""


@dataclass(frozen=True)
class RateMatch:
    """Body rates beside the attitude."""

    unit: str | None = None
    mirrored: bool = False
    axes: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class WayMatch:
    """Velocity beside position."""

    earth_fixed: bool | None = None
    mirrored: bool = False
    agreement: Agreement = NONE
    other: Agreement = NONE


def angle_unit(series: Series) -> str:
    """Return the unit of an angle: stated, or by its size."""
    if series.unit in UNITS["angle"]:
        return series.unit
    return "deg" if float(np.nanmax(np.abs(series.values))) > _TURNS else "rad"


def attitude_series(roles: Roles) -> list[Series]:
    """Return the columns of the attitude: a quaternion, or the angles there are."""
    quaternion = [roles[name] for name in (f"attitude.q{part}" for part in "wxyz") if name in roles]
    if len(quaternion) == 4:
        return quaternion
    names = (f"attitude.{name}" for name in (*_EULER, "heading"))
    return [roles[name] for name in names if name in roles]


def quaternions(roles: Roles, columns: FloatArray) -> FloatArray:
    """Return attitudes in the axes of the file."""
    if "attitude.qw" in roles and columns.shape[1] == 4:
        size = np.linalg.norm(columns, axis=1, keepdims=True)
        fine = np.abs(size - 1.0) < _UNIT_NORM
        unit: FloatArray = columns / np.where(fine, size, np.nan)
        return unit
    angles = np.zeros((len(columns), 3))
    there = [name for name in (*_EULER, "heading") if f"attitude.{name}" in roles]
    for name, column in zip(there, columns.T, strict=True):
        scale = UNITS["angle"][angle_unit(roles[f"attitude.{name}"])]
        angles[:, min(_EULER.index(name) if name in _EULER else 2, 2)] = scale * column
    return quaternion_from_euler(angles)


def match_rates(roles: Roles) -> RateMatch:
    """Compare body rates with the attitude."""
    attitude = attitude_series(roles)
    names = [name for name in "pqr" if f"velocity.{name}" in roles]
    if not attitude or not names:
        return RateMatch()
    joined = together([*(roles[f"velocity.{name}"] for name in names), *attitude])
    if len(joined.elapsed) < 2:
        return RateMatch()
    turned = _turned(quaternions(roles, joined.values[:, len(names) :]))
    found = {}
    for place, name in enumerate(names):
        axis = "pqr".index(name)
        added, moved = changes(joined.elapsed, joined.values[:, [place]], turned[:, [axis]])
        found[name] = compared(added, moved)
    good = {name: one for name, one in found.items() if one.agrees()}
    axes = tuple((name, round(abs(one.correlation), 3)) for name, one in good.items())
    sizes = [abs(one.ratio) for one in good.values()]
    unit = _unit(float(np.median(sizes))) if sizes else None
    flipped = [one.ratio < 0.0 for name, one in good.items() if name != "p"]
    return RateMatch(unit, bool(flipped) and all(flipped), axes)


def _turned(attitude: FloatArray) -> FloatArray:
    """Return the turns about body axes, added up; NaN where the attitude is none."""
    fine = whole_rows(attitude)
    whole = np.where(fine[:, np.newaxis], attitude, (1.0, 0.0, 0.0, 0.0))
    added = np.concatenate((np.zeros((1, 3)), np.cumsum(turn(whole[:-1], whole[1:]), axis=0)))
    added[~fine] = np.nan
    return added


def _unit(ratio: float) -> str | None:
    """Return the unit whose factor a ratio is."""
    known = {unit: UNITS["angular rate"][unit] for unit in _RATE_UNITS}
    unit = min(known, key=lambda unit: abs(np.log(ratio / known[unit])))
    return unit if abs(ratio / known[unit] - 1) < _NEAR else None


def match_way(roles: Roles) -> WayMatch:
    """Compare velocity with position: turned by the attitude, mirrored, or as it is."""
    attitude = attitude_series(roles)
    axes = _axes(roles)
    if not attitude or not axes:
        return WayMatch()
    velocity = [roles[f"velocity.{'uvw'[axis]}"] for axis in axes]
    place = [roles[f"position.{'xyz'[axis]}"] for axis in axes]
    joined = together([*velocity, *place, *attitude])
    if len(joined.elapsed) < 2:
        return WayMatch()
    n = len(axes)
    body = np.zeros((len(joined.elapsed), 3))
    body[:, axes] = joined.values[:, :n]
    turning = rotation(quaternions(roles, joined.values[:, 2 * n :]))
    ways = [body, *(np.einsum("nij,nj->ni", turning, one) for one in (body, body * MIRROR))]
    added, moved = changes(
        joined.elapsed, np.column_stack([way[:, axes] for way in ways]), joined.values[:, n : 2 * n]
    )
    fixed, body_way, mirrored = (compared(added[:, k * n : (k + 1) * n], moved) for k in range(3))
    flipped = _better(mirrored, body_way)
    turned = mirrored if flipped else body_way
    if _better(fixed, turned):
        return WayMatch(True, False, fixed, turned)
    return WayMatch(False if _better(turned, fixed) else None, flipped, turned, fixed)


def _better(one: Agreement, other: Agreement) -> bool:
    """Tell a clearly better agreement."""
    known = -1.0 if np.isnan(other.correlation) else other.correlation
    return one.agrees() and one.correlation - known > _MARGIN


def _axes(roles: Roles) -> list[int]:
    """Return the axes along which both velocity and position are there; at least two."""
    there = [
        k
        for k, (speed, place) in enumerate(zip("uvw", "xyz", strict=True))
        if f"velocity.{speed}" in roles and f"position.{place}" in roles
    ]
    return there if len(there) > 1 else []
