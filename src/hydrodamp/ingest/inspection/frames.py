"""Which units and axes: whether rates and velocities move as attitude and position do."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.conditioning.gaps import true_runs
from hydrodamp.conditioning.vertical import (
    AxisEvidence,
    VerticalAxis,
    depth_test,
    gravity_test,
    surface_test,
)
from hydrodamp.data.agreement import (
    NO_REGRESSION,
    ChannelRegression,
    integrate_rotation,
    regress_channel,
)
from hydrodamp.data.attitude import down_vectors, quaternion_from_euler, rotation_matrices
from hydrodamp.data.channels import ATTITUDE, EULER, SPECIFIC_FORCE
from hydrodamp.data.units import UNITS
from hydrodamp.ingest.formats.files import conventional_axes
from hydrodamp.ingest.inspection.columns import Series, synchronise

_MIRROR = np.array([1.0, -1.0, -1.0])  # turns FRD components into FLU and back
_RATE_UNITS = ("rad/s", "deg/s", "rpm", "rev/s")
_SCALE_TOLERANCE = 0.25  # of a ratio, about that of a unit
_NORM_TOLERANCE = 0.1

#: For every role the series that plays it.
RoleSeries = Mapping[str, Series]


@dataclass(frozen=True)
class RateMatch:
    """Body rates beside the attitude."""

    unit: str | None = None
    mirrored: bool = False
    axes: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class VelocityMatch:
    """Velocity beside position."""

    earth_fixed: bool | None = None
    mirrored: bool = False
    regression: ChannelRegression = NO_REGRESSION
    alternative: ChannelRegression = NO_REGRESSION


def _attitude_roles(roles: RoleSeries) -> list[str]:
    """Return the roles that make the attitude: a quaternion, or the angles there are."""
    quaternion = [f"attitude.{name}" for name in ATTITUDE.columns]
    angles = [f"attitude.{name}" for name in (*EULER, "heading")]
    return quaternion if set(quaternion) <= set(roles) else [one for one in angles if one in roles]


def _with_attitude(
    roles: RoleSeries, wanted: Sequence[Series]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return elapsed time, wanted columns, and attitudes in the axes of the file."""
    names, n = _attitude_roles(roles), len(wanted)
    elapsed, joined = synchronise([*wanted, *(roles[name] for name in names)])
    turned = joined[:, n:]
    if "attitude.qw" in names:
        size = np.linalg.norm(turned, axis=1, keepdims=True)
        fine = np.abs(size - 1.0) < _NORM_TOLERANCE
        return elapsed, joined[:, :n], turned / np.where(fine, size, np.nan)
    angles = np.zeros((len(elapsed), 3))
    for name, column in zip(names, turned.T, strict=True):
        place = EULER.index(name.removeprefix("attitude.").replace("heading", "yaw"))
        angles[:, place] = UNITS["angle"][roles[name].unit or "rad"] * column
    return elapsed, joined[:, :n], quaternion_from_euler(angles)


def match_rates(roles: RoleSeries) -> RateMatch:
    """Compare body rates with the attitude."""
    names = [name for name in "pqr" if f"velocity.{name}" in roles]
    if not _attitude_roles(roles) or not names:
        return RateMatch()
    rates = [roles[f"velocity.{name}"] for name in names]
    elapsed, joined, attitudes = _with_attitude(roles, rates)
    turns = integrate_rotation(attitudes, _complete_runs(attitudes))
    turns[np.isnan(attitudes).any(axis=1)] = np.nan
    good = {}
    for place, name in enumerate(names):
        axis = "pqr".index(name)
        one = _regress(elapsed, joined[:, [place]], turns[:, [axis]])
        if one.is_consistent():
            good[name] = one
    unit = _rate_unit(float(np.median([abs(one.scale) for one in good.values()]))) if good else None
    flipped = [one.scale < 0.0 for name, one in good.items() if name != "p"]
    axes = tuple((name, round(abs(one.correlation), 3)) for name, one in good.items())
    return RateMatch(unit, bool(flipped) and all(flipped), axes)


def _rate_unit(ratio: float) -> str | None:
    """Return the unit whose factor a ratio is."""
    known = {unit: UNITS["angular rate"][unit] for unit in _RATE_UNITS}
    unit = min(known, key=lambda unit: abs(np.log(ratio * known[unit])))
    return unit if abs(ratio * known[unit] - 1) < _SCALE_TOLERANCE else None


def match_velocity(roles: RoleSeries) -> VelocityMatch:
    """Compare velocity with position: turned by the attitude, mirrored, or as it is."""
    is_body = any(f"velocity.{name}" in roles for name in "uvw")
    names = (
        "uvw" if is_body else "xyz"
    )  # of the world by its words, which the motion may contradict
    pairs = [(f"velocity.{names[axis]}", f"position.{'xyz'[axis]}") for axis in range(3)]
    axes = [axis for axis, pair in enumerate(pairs) if set(pair) <= set(roles)]
    if not _attitude_roles(roles) or len(axes) < 2:
        return VelocityMatch()
    paired = [roles[pairs[axis][kind]] for kind in (0, 1) for axis in axes]
    elapsed, joined, attitudes = _with_attitude(roles, paired)
    n = len(axes)
    body = np.zeros((len(elapsed), 3))
    body[:, axes] = joined[:, :n]
    axes_of = rotation_matrices(attitudes)
    ways = [body, *(np.einsum("nij,nj->ni", axes_of, one) for one in (body, body * _MIRROR))]
    moved = joined[:, n:]
    fixed, plain, mirrored = (_regress(elapsed, way[:, axes], moved) for way in ways)
    flipped = mirrored.explains_more_than(plain)
    turning = mirrored if flipped else plain
    if fixed.explains_more_than(turning):
        return VelocityMatch(True, False, fixed, turning)
    return VelocityMatch(
        False if turning.explains_more_than(fixed) else None, flipped, turning, fixed
    )


def _regress(elapsed: FloatArray, rate: FloatArray, value: FloatArray) -> ChannelRegression:
    """Compare where nothing is missing."""
    return regress_channel(elapsed, _complete_runs(rate, value), np.nan_to_num(rate), value)


def _complete_runs(*columns: FloatArray) -> IntArray:
    """Return the stretches of rows without NaN."""
    known = np.isfinite(np.column_stack(columns)).all(axis=1)
    return np.array(true_runs(np.asarray(known)), dtype=np.int64).reshape(-1, 2)


_ROS_LOG_ODDS, _AUTOPILOT_LOG_ODDS, _POSE_LOG_ODDS = 2.5, 4.0, 0.7  # log-odds


def find_vertical_axis(form: str, roles: RoleSeries) -> VerticalAxis:
    """Return the axes of body and attitude that the signs speak for."""
    return VerticalAxis.combine(
        (
            *format_convention(form),
            *_gravity_evidence(roles),
            *_depth_evidence(roles),
            *_surface_evidence(roles),
        )
    )


def format_convention(form: str) -> Iterator[AxisEvidence]:
    """Yield the axes that a format has by custom."""
    axes = conventional_axes(form)
    if axes == "FLU over ENU":
        yield AxisEvidence(
            -_ROS_LOG_ODDS, f"{form}: forward-port-up over east-north-up by custom (REP 103)"
        )
    elif axes:
        yield AxisEvidence(
            _AUTOPILOT_LOG_ODDS, f"{form}: forward-starboard-down over north-east-down by custom"
        )


def _gravity_evidence(roles: RoleSeries) -> Iterator[AxisEvidence]:
    names = [f"specific_force.{name}" for name in SPECIFIC_FORCE.columns]
    if set(names) <= set(roles):
        _, force, attitudes = _with_attitude(roles, [roles[name] for name in names])
        yield from gravity_test(force, down_vectors(attitudes))


def _depth_evidence(roles: RoleSeries) -> Iterator[AxisEvidence]:
    """Compare the change of depth with the vertical part of the velocity."""
    names = [name for name in ("velocity.u", "velocity.v", "velocity.w") if name in roles]
    if not _attitude_roles(roles) or "position.depth" not in roles or not {*names} - {"velocity.v"}:
        return
    moving = [roles[name] for name in ("position.depth", *names)]
    elapsed, joined, attitudes = _with_attitude(roles, moving)
    columns = ["uvw".index(name[-1]) for name in names]
    rise = np.sum(down_vectors(attitudes)[:, columns] * joined[:, 1:], axis=1)
    whole = _complete_runs(rise, joined[:, :1])
    yield from depth_test(elapsed, whole, np.nan_to_num(rise), joined[:, 0])


def _surface_evidence(roles: RoleSeries) -> Iterator[AxisEvidence]:
    """See to which side of its start a vehicle goes."""
    if "position.z" not in roles:
        return
    if "position.depth" not in roles:
        yield AxisEvidence(
            -_POSE_LOG_ODDS, "a pose called x y z, as of motion capture, mostly has z up"
        )
    yield from surface_test(roles["position.z"].values)
