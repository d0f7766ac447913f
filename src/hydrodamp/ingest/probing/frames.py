"""Which units and axes: whether rates and velocities move as attitude and position do; gravity."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.conditioning.gaps import runs
from hydrodamp.data.attitude import integral, pairs, quaternion_from_euler, rotation, turn
from hydrodamp.data.channels import ATTITUDE, EULER, SPECIFIC_FORCE
from hydrodamp.data.units import UNITS
from hydrodamp.ingest.formats.files import usual_axes
from hydrodamp.ingest.probing.columns import Series, together

_MIRROR = np.array([1.0, -1.0, -1.0])  # turns FRD components into FLU and back
_RATE_UNITS = ("rad/s", "deg/s", "rpm", "rev/s")
_NEAR = 0.25  # of a ratio, about that of a unit
_MARGIN = 0.03  # of a correlation, over the next best
_TURNS = 6.5  # rad; an angle beyond is in degrees
_UNIT_NORM = 0.1
_SHORTEST = 1.0  # s, over which sums and moves are compared
_STEPS = 10  # in that time, at least
_LEAST_PAIRS = 60
_KEPT = 0.97  # of the pairs
_LEAST_CORRELATION = 0.8
_TINY = 1e-9  # of any unit; less is no motion

#: For every role the series that plays it.
Roles = Mapping[str, Series]


class Agreement(NamedTuple):
    """How two channels go together."""

    ratio: float
    correlation: float

    def agrees(self) -> bool:
        """Return whether they measure one motion, of either sign."""
        return abs(self.correlation) >= _LEAST_CORRELATION


#: Of channels that cannot be compared.
NONE = Agreement(float("nan"), float("nan"))


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
    for names in (ATTITUDE.columns, (*EULER, "heading")):
        there = [roles[f"attitude.{name}"] for name in names if f"attitude.{name}" in roles]
        if there and (names != ATTITUDE.columns or len(there) == len(names)):
            return there
    return []


def quaternions(roles: Roles, columns: FloatArray) -> FloatArray:
    """Return attitudes in the axes of the file."""
    if "attitude.qw" in roles and columns.shape[1] == 4:
        size = np.linalg.norm(columns, axis=1, keepdims=True)
        fine = np.abs(size - 1.0) < _UNIT_NORM
        return np.asarray(columns / np.where(fine, size, np.nan))
    angles = np.zeros((len(columns), 3))
    there = [name for name in (*EULER, "heading") if f"attitude.{name}" in roles]
    for name, column in zip(there, columns.T, strict=True):
        scale = UNITS["angle"][angle_unit(roles[f"attitude.{name}"])]
        angles[:, EULER.index("yaw" if name == "heading" else name)] = scale * column
    return quaternion_from_euler(angles)


def match_rates(roles: Roles) -> RateMatch:
    """Compare body rates with the attitude."""
    attitude = attitude_series(roles)
    names = [name for name in "pqr" if f"velocity.{name}" in roles]
    if not attitude or not names:
        return RateMatch()
    elapsed, joined = together([*(roles[f"velocity.{name}"] for name in names), *attitude])
    turned = _turned(quaternions(roles, joined[:, len(names) :]))
    good = {}
    for place, name in enumerate(names):
        axis = "pqr".index(name)
        one = compared(*changes(elapsed, joined[:, [place]], turned[:, [axis]]))
        if one.agrees():
            good[name] = one
    unit = _unit(float(np.median([abs(one.ratio) for one in good.values()]))) if good else None
    flipped = [one.ratio < 0.0 for name, one in good.items() if name != "p"]
    axes = tuple((name, round(abs(one.correlation), 3)) for name, one in good.items())
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
    pairs = [(f"velocity.{'uvw'[axis]}", f"position.{'xyz'[axis]}") for axis in range(3)]
    axes = [axis for axis, pair in enumerate(pairs) if set(pair) <= set(roles)]
    if not attitude or len(axes) < 2:
        return WayMatch()
    paired = [roles[pairs[axis][kind]] for kind in (0, 1) for axis in axes]
    elapsed, joined = together([*paired, *attitude])
    n = len(axes)
    body = np.zeros((len(elapsed), 3))
    body[:, axes] = joined[:, :n]
    turning = rotation(quaternions(roles, joined[:, 2 * n :]))
    ways = [body, *(np.einsum("nij,nj->ni", turning, one) for one in (body, body * _MIRROR))]
    rates = np.column_stack([way[:, axes] for way in ways])
    added, moved = changes(elapsed, rates, joined[:, n : 2 * n])
    fixed, plain, mirrored = (compared(added[:, k * n : (k + 1) * n], moved) for k in range(3))
    flipped = _better(mirrored, plain)
    turned = mirrored if flipped else plain
    if _better(fixed, turned):
        return WayMatch(True, False, fixed, turned)
    return WayMatch(False if _better(turned, fixed) else None, flipped, turned, fixed)


def _better(one: Agreement, other: Agreement) -> bool:
    """Return whether one agreement is clearly better than another."""
    known = -1.0 if np.isnan(other.correlation) else other.correlation
    return one.agrees() and one.correlation - known > _MARGIN


def changes(
    elapsed: FloatArray, rate: FloatArray, value: FloatArray, seconds: float = _SHORTEST
) -> tuple[FloatArray, FloatArray]:
    """Return what rates add up to over some seconds, and how far values move meanwhile."""
    known = whole_rows(np.column_stack((rate, value)))
    bounds = np.array(runs(known), dtype=np.int64).reshape(-1, 2)
    long = max(_STEPS * float(np.median(np.diff(elapsed))), seconds) if len(elapsed) > 1 else 0.0
    first, last = pairs(elapsed, bounds, long)
    way = integral(elapsed, np.nan_to_num(rate))
    return way[last] - way[first], value[last] - value[first]


def whole_rows(values: FloatArray) -> BoolArray:
    """Return which rows have no NaN."""
    return np.asarray(np.isfinite(values).all(axis=1))


def compared(added: FloatArray, moved: FloatArray) -> Agreement:
    """Return how sums and moves go together."""
    if len(added) < _LEAST_PAIRS:
        return NONE
    kept = _usual(added.reshape(len(added), -1), moved.reshape(len(moved), -1))
    added, moved = added[kept], moved[kept]
    one, other = float(np.linalg.norm(added)), float(np.linalg.norm(moved))
    if min(one, other) < _TINY:
        return NONE
    correlation = float(np.sum((added / one) * (moved / other)))
    return Agreement(float(np.sign(correlation)) * other / one, correlation)


def _usual(added: FloatArray, moved: FloatArray) -> BoolArray:
    """Leave out the few that agree least: spikes, and averages across a wrap."""
    sizes = [float(np.median(np.linalg.norm(one, axis=1))) for one in (added, moved)]
    if min(sizes) < _TINY:
        return np.ones(len(added), dtype=np.bool_)
    one, other = added / sizes[0], moved / sizes[1]
    sign = np.sign(np.sum(np.clip(one, -3, 3) * np.clip(other, -3, 3)))
    size = 1.0 + np.linalg.norm(one, axis=1) + np.linalg.norm(other, axis=1)
    apart = np.linalg.norm(other - sign * one, axis=1) / size
    return np.asarray(apart <= np.quantile(apart, _KEPT))


#: Marine craft are recorded forward-starboard-down unless something speaks against it.
USUAL = 0.6

_ROS, _AUTOPILOT, _GRAVITY, _DEPTH, _POSE, _SURFACE = 2.5, 4.0, 4.0, 4.0, 0.7, 0.8
_DIVE = 1.0  # m, more than a vehicle bobs at the surface
_LONG = 10.0  # s, over which depth changes by more than its noise
_MOST = 99


@dataclass(frozen=True)
class Sign:
    """One sign of which way is down."""

    weight: float
    told: str


@dataclass(frozen=True)
class Upright:
    """Which axes, all signs weighed."""

    body: str
    confidence: int
    signs: tuple[Sign, ...]


def weigh(form: str, roles: Roles) -> Upright:
    """Return the axes of body and attitude that the signs speak for."""
    signs = (*_custom(form), *_gravity(roles), *_depth(roles), *_surface(roles))
    total = USUAL + sum(sign.weight for sign in signs)
    sure = 100 / (1 + math.exp(-abs(total)))
    return Upright("FRD" if total > 0 else "FLU", min(_MOST, round(sure)), signs)


def _custom(form: str) -> Iterator[Sign]:
    axes = usual_axes(form)
    if axes == "FLU over ENU":
        yield Sign(-_ROS, f"{form}: forward-port-up over east-north-up by custom (REP 103)")
    elif axes:
        yield Sign(_AUTOPILOT, f"{form}: forward-starboard-down over north-east-down by custom")


def _gravity(roles: Roles) -> Iterator[Sign]:
    if "specific_force.fz" not in roles:
        return
    names = [f"specific_force.{name}" for name in SPECIFIC_FORCE.columns]
    mean = [float(np.nanmean(roles[name].values)) for name in names if name in roles]
    share = mean[-1] / max(float(np.linalg.norm(mean)), 1e-9)
    if abs(share) > 0.7:
        points = "up" if share > 0.0 else "down"
        told = f"the accelerometer's z shows gravity as {mean[-1]:+.3g}: its z points {points}"
        yield Sign(-math.copysign(_GRAVITY, share), told)


def _depth(roles: Roles) -> Iterator[Sign]:
    """Compare the change of depth with the vertical part of the velocity."""
    attitude = attitude_series(roles)
    needed = ("position.depth", "velocity.u")
    if not attitude or any(name not in roles for name in needed):
        return
    names = [name for name in ("velocity.u", "velocity.v", "velocity.w") if name in roles]
    moving = [roles["position.depth"], *(roles[name] for name in names)]
    elapsed, joined = together([*moving, *attitude])
    n = len(moving)
    third = rotation(quaternions(roles, joined[:, n:]))[:, 2]
    columns = ["uvw".index(name[-1]) for name in names]
    rise = np.sum(third[:, columns] * joined[:, 1:n], axis=1)
    added, moved = changes(elapsed, rise[:, np.newaxis], joined[:, :1], _LONG)
    if not len(added):
        return
    # A tilted Doppler log adds a constant.
    likeness = compared(added - np.median(added), moved - np.median(moved)).correlation
    if abs(likeness) > 0.3:
        told = f"depth changes with the velocity along the world's z (correlation {likeness:+.2f})"
        yield Sign(math.copysign(_DEPTH * abs(likeness), likeness), told)


def _surface(roles: Roles) -> Iterator[Sign]:
    """See to which side of its start a vehicle goes: it starts near the surface."""
    if "position.z" not in roles:
        return
    if "position.depth" not in roles:
        yield Sign(-_POSE, "a pose called x y z, as of motion capture, mostly has z up")
    place = roles["position.z"].values
    place = place[np.isfinite(place)] - place[np.isfinite(place)][0]
    low, high = np.quantile(place, (0.02, 0.98)).tolist()
    if high - low > _DIVE and abs(high + low) > 0.4 * (high - low):
        told = f"from its start it goes {-low:.2g} m towards -z, {max(high, 0.0):.2g} m towards +z"
        yield Sign(math.copysign(_SURFACE, high + low), f"{told}: it starts near the surface")
