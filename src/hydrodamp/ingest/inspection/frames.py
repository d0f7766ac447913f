"""Units and axes of a recording: regression of rates on attitude and of velocity on position."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.conditioning.consistency import Fix, QualityIssue
from hydrodamp.conditioning.dropouts import true_runs
from hydrodamp.conditioning.vertical_axis import (
    AxisEvidence,
    VerticalAxis,
    depth_test,
    gravity_test,
    surface_test,
)
from hydrodamp.data.attitude import (
    down_vectors,
    quaternion_from_euler,
    rotation_matrices,
)
from hydrodamp.data.channel_regression import (
    NO_REGRESSION,
    ChannelRegression,
    integrate_rotation,
    regress_channel,
)
from hydrodamp.data.channels import ATTITUDE, EULER, SPECIFIC_FORCE, UNITS
from hydrodamp.ingest.formats.files import conventional_axes
from hydrodamp.ingest.inspection.columns import Series, synchronise
from hydrodamp.ingest.inspection.names import split_index

#: Largest value of an angle in radians; larger values are in degrees.
MAX_ANGLE_RAD = {
    "attitude.roll": 3.3,
    "attitude.pitch": 1.65,
    "attitude.yaw": 6.5,
    "attitude.heading": 6.5,
}
_MAX_RATE_RAD_S = 3.5  # rad/s; faster rotations are rare
_RATES = ("velocity.p", "velocity.q", "velocity.r")
_POSITIONS = ("position.x", "position.y", "position.z", "position.depth")
_MIRROR = np.array([1.0, -1.0, -1.0])  # converts FRD to FLU components and back
_RATE_UNITS = ("rad/s", "deg/s", "rpm", "rev/s")
_SCALE_TOLERANCE = 0.25  # relative error of a scale around a unit factor
_NORM_TOLERANCE = 0.1
_NED = dict(zip(_POSITIONS[:3], ("position.north", "position.east", "position.down"), strict=True))

#: The series of every role.
RoleSeries = Mapping[str, Series]


def infer_units(role_series: RoleSeries) -> dict[str, Series]:
    """Return angles of a topic and rates of an array in one unit, and positions in metres."""
    inferred = dict(role_series)
    angles = {
        role: series
        for role, series in inferred.items()
        if role in MAX_ANGLE_RAD and series.unit not in UNITS["angle"]
    }
    in_degrees = {
        series.topic
        for role, series in angles.items()
        if float(np.nanmax(np.abs(series.values))) > MAX_ANGLE_RAD[role]
    }
    for role, series in angles.items():
        inferred[role] = replace(series, unit="deg" if series.topic in in_degrees else "rad")
    rates = {
        role: series for role, series in inferred.items() if role in _RATES and series.unit is None
    }
    fast = {
        _array_of(series)
        for series in rates.values()
        if float(np.nanquantile(np.abs(series.values), 0.99)) > _MAX_RATE_RAD_S
    }
    for role, series in rates.items():
        inferred[role] = replace(series, unit="deg/s" if _array_of(series) in fast else "rad/s")
    for role in {*_POSITIONS, *_NED.values()} & inferred.keys():
        scale = UNITS["length"].get(inferred[role].unit or "m", 1.0)
        inferred[role] = replace(inferred[role], values=inferred[role].values * scale)
    return {new: inferred[old] for new, old in _NED.items() if old in inferred} | inferred


def _array_of(series: Series) -> tuple[str, str]:
    """Return the array of a series; columns of a topic also form one."""
    return series.topic, split_index(series.field)[0] if series.field.endswith((")", "]")) else ""


@dataclass(frozen=True)
class RateMatch:
    """Result of the comparison of body rates with the attitude."""

    unit: str | None = None
    mirrored: bool = False
    axes: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class VelocityMatch:
    """Result of the comparison of velocity with position."""

    earth_fixed: bool | None = None
    mirrored: bool = False
    regression: ChannelRegression = NO_REGRESSION
    alternative: ChannelRegression = NO_REGRESSION


def attitude_roles(roles: RoleSeries) -> list[str]:
    """Return the roles of the attitude: the quaternion, or the available angles."""
    quaternion = [f"attitude.{name}" for name in ATTITUDE.columns]
    angles = [f"attitude.{name}" for name in (*EULER, "heading")]
    has_quaternion = {*quaternion} <= roles.keys()
    return quaternion if has_quaternion else [role for role in angles if role in roles]


def synchronise_with_attitude(
    roles: RoleSeries, series: Sequence[Series]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return elapsed time, columns of the series, and attitudes in the axes of the file."""
    names, n = attitude_roles(roles), len(series)
    elapsed, columns = synchronise([*series, *(roles[name] for name in names)])
    attitude = columns[:, n:]
    if "attitude.qw" in names:
        size = np.linalg.norm(attitude, axis=1, keepdims=True)
        valid = np.abs(size - 1.0) < _NORM_TOLERANCE
        return elapsed, columns[:, :n], attitude / np.where(valid, size, np.nan)
    angles = np.zeros((len(elapsed), 3))
    for name, column in zip(names, attitude.T, strict=True):
        axis = EULER.index(name.removeprefix("attitude.").replace("heading", "yaw"))
        angles[:, axis] = UNITS["angle"][roles[name].unit or "rad"] * column
    return elapsed, columns[:, :n], quaternion_from_euler(angles)


def match_rates(roles: RoleSeries) -> RateMatch:
    """Compare body rates with the attitude."""
    names = [name for name in "pqr" if f"velocity.{name}" in roles]
    if not attitude_roles(roles) or not names:
        return RateMatch()
    rates = [roles[f"velocity.{name}"] for name in names]
    elapsed, columns, attitudes = synchronise_with_attitude(roles, rates)
    rotation = integrate_rotation(attitudes, _complete_runs(attitudes))
    rotation[np.isnan(attitudes).any(axis=1)] = np.nan
    results = {
        name: regress_complete(elapsed, column[:, np.newaxis], rotation[:, ["pqr".index(name)]])
        for name, column in zip(names, columns.T, strict=True)
    }
    consistent = {name: result for name, result in results.items() if result.is_consistent()}
    if not consistent:
        return RateMatch()
    unit = _rate_unit(float(np.median([abs(result.scale) for result in consistent.values()])))
    flipped = [result.scale < 0.0 for name, result in consistent.items() if name != "p"]
    axes = tuple((name, round(abs(result.correlation), 3)) for name, result in consistent.items())
    return RateMatch(unit, bool(flipped) and all(flipped), axes)


def _rate_unit(ratio: float) -> str | None:
    """Return the unit whose factor matches a scale."""
    known = {unit: UNITS["angular rate"][unit] for unit in _RATE_UNITS}
    unit = min(known, key=lambda unit: abs(np.log(ratio * known[unit])))
    return unit if abs(ratio * known[unit] - 1) < _SCALE_TOLERANCE else None


def match_velocity(roles: RoleSeries) -> VelocityMatch:
    """Compare velocity with position: body-fixed, mirrored (FLU), or earth-fixed."""
    is_body = any(f"velocity.{name}" in roles for name in "uvw")
    names = "uvw" if is_body else "xyz"  # x y z: of the world by its words; the motion decides
    pairs = [(f"velocity.{names[axis]}", f"position.{'xyz'[axis]}") for axis in range(3)]
    axes = [axis for axis, pair in enumerate(pairs) if {*pair} <= roles.keys()]
    if not attitude_roles(roles) or len(axes) < 2:
        return VelocityMatch()
    paired = [roles[pairs[axis][kind]] for kind in (0, 1) for axis in axes]
    elapsed, columns, attitudes = synchronise_with_attitude(roles, paired)
    velocity, position = np.hsplit(columns, 2)
    body = np.zeros((len(elapsed), 3))
    body[:, axes] = velocity
    matrices = rotation_matrices(attitudes)
    rotated = (np.einsum("nij,nj->ni", matrices, vectors) for vectors in (body, body * _MIRROR))
    earth_fixed, plain, mirrored = (
        regress_complete(elapsed, candidate[:, axes], position) for candidate in (body, *rotated)
    )
    is_mirrored = mirrored.explains_more_than(plain)
    body_fixed = mirrored if is_mirrored else plain
    if earth_fixed.explains_more_than(body_fixed):
        return VelocityMatch(True, False, earth_fixed, body_fixed)
    is_earth_fixed = False if body_fixed.explains_more_than(earth_fixed) else None
    return VelocityMatch(is_earth_fixed, is_mirrored, body_fixed, earth_fixed)


def regress_complete(elapsed: FloatArray, rate: FloatArray, value: FloatArray) -> ChannelRegression:
    """Regress where no value is missing."""
    return regress_channel(elapsed, _complete_runs(rate, value), np.nan_to_num(rate), value)


def _complete_runs(*columns: FloatArray) -> IntArray:
    """Return the bounds of rows without NaN."""
    known = np.isfinite(np.column_stack(columns)).all(axis=1)
    return np.array(true_runs(np.asarray(known)), dtype=np.int64).reshape(-1, 2)


_ROS_LOG_ODDS, _AUTOPILOT_LOG_ODDS, _POSE_LOG_ODDS = 2.5, 4.0, 0.7  # log-odds


def find_vertical_axis(form: str, roles: RoleSeries) -> VerticalAxis:
    """Return the axes of body and attitude from all evidence."""
    evidence = (_gravity_evidence, _depth_evidence, _surface_evidence)
    tests = itertools.chain.from_iterable(test(roles) for test in evidence)
    return VerticalAxis.combine((*format_convention(form), *tests))


def format_convention(form: str) -> Iterator[AxisEvidence]:
    """Yield the conventional axes of a format."""
    axes = conventional_axes(form)
    if axes == "FLU over ENU":
        message = f"{form}: forward-port-up over east-north-up by convention (REP 103)"
        yield AxisEvidence(-_ROS_LOG_ODDS, message)
    elif axes:
        message = f"{form}: forward-starboard-down over north-east-down by convention"
        yield AxisEvidence(_AUTOPILOT_LOG_ODDS, message)


def _gravity_evidence(roles: RoleSeries) -> Iterator[AxisEvidence]:
    names = [f"specific_force.{name}" for name in SPECIFIC_FORCE.columns]
    if {*names} <= roles.keys():
        _, force, attitudes = synchronise_with_attitude(roles, [roles[name] for name in names])
        yield from gravity_test(force, down_vectors(attitudes))


def _depth_evidence(roles: RoleSeries) -> Iterator[AxisEvidence]:
    """Compare the change of depth with the vertical velocity."""
    axes = [axis for axis, name in enumerate("uvw") if f"velocity.{name}" in roles]
    if not attitude_roles(roles) or "position.depth" not in roles or not {*axes} - {1}:
        return
    names = ("position.depth", *(f"velocity.{'uvw'[axis]}" for axis in axes))
    elapsed, values, attitudes = synchronise_with_attitude(roles, [roles[name] for name in names])
    rise = np.sum(down_vectors(attitudes)[:, axes] * values[:, 1:], axis=1)
    bounds = _complete_runs(rise, values[:, :1])
    yield from depth_test(elapsed, bounds, np.nan_to_num(rise), values[:, 0])


def _surface_evidence(roles: RoleSeries) -> Iterator[AxisEvidence]:
    """Test in which vertical direction the vehicle leaves its start."""
    if "position.z" not in roles:
        return
    if "position.depth" not in roles:
        message = "a pose named x y z, as of motion capture, usually has z up"
        yield AxisEvidence(-_POSE_LOG_ODDS, message)
    yield from surface_test(roles["position.z"].values)


def misread_positions(measured: Mapping[str, str]) -> Iterator[QualityIssue]:
    """Yield commands whose names are those of positions."""
    names = [name for name, role in measured.items() if not role.endswith("depth")]
    if names:
        problem = "has the name of a position but was read as a command"
        evidence = "the canonical form calls a position x y z, in metres"
        remedy = "rename it, or name it under `position` in a mapping (`--draft`)"
        yield QualityIssue(" ".join(names), problem, evidence, remedy=remedy)


def wrong_frame(upright: VerticalAxis, issues: Sequence[QualityIssue]) -> Iterator[QualityIssue]:
    """Yield that z is up, unless an issue of the specific force reports it."""
    is_reported = any(issue.channel == "specific_force" for issue in issues)
    if upright.body == "FLU" and upright.is_sure and not is_reported:
        problem = "is forward-port-up, not forward-starboard-down"
        evidence = "; ".join(test.message for test in upright.evidence if test.log_odds < 0.0)
        yield QualityIssue("frame", problem, evidence, fix=Fix("frame", "FLU"))
