"""Units and axes of a recording: regression of rates on attitude and of velocity on position."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.term import VELOCITY_OF
from hydrodamp.conditioning.consistency import QualityIssue
from hydrodamp.conditioning.gaps import true_runs
from hydrodamp.conditioning.vertical_axis import (
    AxisEvidence,
    VerticalAxis,
    depth_test,
    gravity_test,
    surface_test,
)
from hydrodamp.data.attitude import down_vectors, quaternion_from_euler, rotation_matrices
from hydrodamp.data.channel_regression import (
    NO_REGRESSION,
    ChannelRegression,
    integrate_rotation,
    regress_channel,
)
from hydrodamp.data.channels import ATTITUDE, EULER, SPECIFIC_FORCE
from hydrodamp.data.units import UNITS
from hydrodamp.ingest.formats.files import conventional_axes
from hydrodamp.ingest.inspection.columns import Series, synchronise
from hydrodamp.ingest.inspection.delay import Delay

_MIRROR = np.array([1.0, -1.0, -1.0])  # converts FRD to FLU components and back
_RATE_UNITS = ("rad/s", "deg/s", "rpm", "rev/s")
_SCALE_TOLERANCE = 0.25  # relative error of a scale around a unit factor
_NORM_TOLERANCE = 0.1

#: The series of every role.
RoleSeries = Mapping[str, Series]


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


def _attitude_roles(roles: RoleSeries) -> list[str]:
    """Return the roles of the attitude: the quaternion, or the available angles."""
    quaternion = [f"attitude.{name}" for name in ATTITUDE.columns]
    angles = [f"attitude.{name}" for name in (*EULER, "heading")]
    return (
        quaternion if set(quaternion) <= set(roles) else [role for role in angles if role in roles]
    )


def _with_attitude(
    roles: RoleSeries, series: Sequence[Series]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return elapsed time, columns of the series, and attitudes in the axes of the file."""
    attitude_roles, n = _attitude_roles(roles), len(series)
    elapsed, columns = synchronise([*series, *(roles[name] for name in attitude_roles)])
    attitude = columns[:, n:]
    if "attitude.qw" in attitude_roles:
        size = np.linalg.norm(attitude, axis=1, keepdims=True)
        valid = np.abs(size - 1.0) < _NORM_TOLERANCE
        return elapsed, columns[:, :n], attitude / np.where(valid, size, np.nan)
    angles = np.zeros((len(elapsed), 3))
    for name, column in zip(attitude_roles, attitude.T, strict=True):
        axis = EULER.index(name.removeprefix("attitude.").replace("heading", "yaw"))
        angles[:, axis] = UNITS["angle"][roles[name].unit or "rad"] * column
    return elapsed, columns[:, :n], quaternion_from_euler(angles)


def match_rates(roles: RoleSeries) -> RateMatch:
    """Compare body rates with the attitude."""
    names = [name for name in "pqr" if f"velocity.{name}" in roles]
    if not _attitude_roles(roles) or not names:
        return RateMatch()
    rates = [roles[f"velocity.{name}"] for name in names]
    elapsed, columns, attitudes = _with_attitude(roles, rates)
    rotation = integrate_rotation(attitudes, _complete_runs(attitudes))
    rotation[np.isnan(attitudes).any(axis=1)] = np.nan
    consistent = {}
    for column, name in enumerate(names):
        axis = "pqr".index(name)
        result = _regress(elapsed, columns[:, [column]], rotation[:, [axis]])
        if result.is_consistent():
            consistent[name] = result
    unit = (
        _rate_unit(float(np.median([abs(result.scale) for result in consistent.values()])))
        if consistent
        else None
    )
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
    names = (
        "uvw" if is_body else "xyz"
    )  # of the world by its words, which the motion may contradict
    pairs = [(f"velocity.{names[axis]}", f"position.{'xyz'[axis]}") for axis in range(3)]
    axes = [axis for axis, pair in enumerate(pairs) if set(pair) <= set(roles)]
    if not _attitude_roles(roles) or len(axes) < 2:
        return VelocityMatch()
    paired = [roles[pairs[axis][kind]] for kind in (0, 1) for axis in axes]
    elapsed, columns, attitudes = _with_attitude(roles, paired)
    n = len(axes)
    body = np.zeros((len(elapsed), 3))
    body[:, axes] = columns[:, :n]
    matrices = rotation_matrices(attitudes)
    candidates = [
        body,
        *(np.einsum("nij,nj->ni", matrices, vectors) for vectors in (body, body * _MIRROR)),
    ]
    position = columns[:, n:]
    earth_fixed, plain, mirrored = (
        _regress(elapsed, candidate[:, axes], position) for candidate in candidates
    )
    is_mirrored = mirrored.explains_more_than(plain)
    body_fixed = mirrored if is_mirrored else plain
    if earth_fixed.explains_more_than(body_fixed):
        return VelocityMatch(True, False, earth_fixed, body_fixed)
    return VelocityMatch(
        False if body_fixed.explains_more_than(earth_fixed) else None,
        is_mirrored,
        body_fixed,
        earth_fixed,
    )


def _regress(elapsed: FloatArray, rate: FloatArray, value: FloatArray) -> ChannelRegression:
    """Regress where no value is missing."""
    return regress_channel(elapsed, _complete_runs(rate, value), np.nan_to_num(rate), value)


def _complete_runs(*columns: FloatArray) -> IntArray:
    """Return the bounds of rows without NaN."""
    known = np.isfinite(np.column_stack(columns)).all(axis=1)
    return np.array(true_runs(np.asarray(known)), dtype=np.int64).reshape(-1, 2)


_ROS_LOG_ODDS, _AUTOPILOT_LOG_ODDS, _POSE_LOG_ODDS = 2.5, 4.0, 0.7  # log-odds


def find_vertical_axis(form: str, roles: RoleSeries) -> VerticalAxis:
    """Return the axes of body and attitude from all evidence."""
    return VerticalAxis.combine(
        (
            *format_convention(form),
            *_gravity_evidence(roles),
            *_depth_evidence(roles),
            *_surface_evidence(roles),
        )
    )


def format_convention(form: str) -> Iterator[AxisEvidence]:
    """Yield the conventional axes of a format."""
    axes = conventional_axes(form)
    if axes == "FLU over ENU":
        yield AxisEvidence(
            -_ROS_LOG_ODDS, f"{form}: forward-port-up over east-north-up by convention (REP 103)"
        )
    elif axes:
        yield AxisEvidence(
            _AUTOPILOT_LOG_ODDS,
            f"{form}: forward-starboard-down over north-east-down by convention",
        )


def _gravity_evidence(roles: RoleSeries) -> Iterator[AxisEvidence]:
    names = [f"specific_force.{name}" for name in SPECIFIC_FORCE.columns]
    if set(names) <= set(roles):
        _, force, attitudes = _with_attitude(roles, [roles[name] for name in names])
        yield from gravity_test(force, down_vectors(attitudes))


def _depth_evidence(roles: RoleSeries) -> Iterator[AxisEvidence]:
    """Compare the change of depth with the vertical velocity."""
    names = [name for name in ("velocity.u", "velocity.v", "velocity.w") if name in roles]
    if not _attitude_roles(roles) or "position.depth" not in roles or not {*names} - {"velocity.v"}:
        return
    series = [roles[name] for name in ("position.depth", *names)]
    elapsed, values, attitudes = _with_attitude(roles, series)
    columns = ["uvw".index(name[-1]) for name in names]
    rise = np.sum(down_vectors(attitudes)[:, columns] * values[:, 1:], axis=1)
    bounds = _complete_runs(rise, values[:, :1])
    yield from depth_test(elapsed, bounds, np.nan_to_num(rise), values[:, 0])


def _surface_evidence(roles: RoleSeries) -> Iterator[AxisEvidence]:
    """Test in which vertical direction the vehicle leaves its start."""
    if "position.z" not in roles:
        return
    if "position.depth" not in roles:
        yield AxisEvidence(
            -_POSE_LOG_ODDS, "a pose named x y z, as of motion capture, usually has z up"
        )
    yield from surface_test(roles["position.z"].values)


#: Share of the variance of an acceleration from which a command has an effect.
MIN_RESPONSE_SHARE = 0.05
_MIN_DELAY_CONFIDENCE = 50  # %, confidence of a delay from which its sign counts
UNDECIDED = "The direction of z is undetermined"
#: Motion of the vehicle when a velocity increases that changes sign with the axes.
_MOVES = {"v": "to starboard", "w": "down", "q": "bow up", "r": "to starboard"}
_OPPOSITE_MOVES = {"v": "to port", "w": "up", "q": "bow down", "r": "to port"}


def describe_frame(upright: VerticalAxis, responses: Sequence[str]) -> str:
    """Return the evidence for the direction of z, or what would determine it."""
    evidence = "; ".join(test.message for test in upright.evidence)
    if upright.is_sure:
        return f"{upright.body} by {upright.confidence} %: {evidence}."
    observed = f" Responses: {'; '.join(responses)}." if responses else ""
    return (
        f"{UNDECIDED}: motion alone cannot distinguish FRD over NED from FLU over a world with z up"
        f"{f'; {evidence}' if evidence else ''}.{observed} Compare with the actual motion, or "
        "record a specific force or a depth."
    )


def misread_positions(measured: Mapping[str, str]) -> Iterator[QualityIssue]:
    """Yield commands whose names are those of positions."""
    names = [name for name, role in measured.items() if not role.endswith("depth")]
    if names:
        yield QualityIssue(
            " ".join(names),
            "has the name of a position but was read as a command",
            "the canonical form calls a position x y z, in metres",
            remedy="rename it, or name it under `position` in a mapping (`--draft`)",
        )


def wrong_frame(upright: VerticalAxis, issues: Sequence[QualityIssue]) -> Iterator[QualityIssue]:
    """Yield that z is up, unless an issue of the specific force reports it."""
    if (
        upright.body == "FLU"
        and upright.is_sure
        and all(issue.channel != "specific_force" for issue in issues)
    ):
        yield QualityIssue(
            "frame",
            "is forward-port-up, not forward-starboard-down",
            "; ".join(test.message for test in upright.evidence if test.log_odds < 0.0),
            remedy="write `frame: FLU` in a mapping, and list deviating sensors under `sensors`",
        )


def reversed_wrench(delays: Sequence[Delay]) -> Iterator[QualityIssue]:
    """Yield axes of a recorded wrench that accelerate the vehicle against their sign."""
    reversed_delays = [
        delay
        for delay in delays
        if VELOCITY_OF.get(delay.command) == delay.velocity
        and delay.sign < 0
        and delay.share >= MIN_RESPONSE_SHARE
        and delay.confidence >= _MIN_DELAY_CONFIDENCE
    ]
    if reversed_delays:
        yield QualityIssue(
            " ".join(delay.command for delay in reversed_delays),
            "acts against its sign",
            ", ".join(
                f"{delay.velocity} decreases when {delay.command} increases"
                for delay in reversed_delays
            ),
            remedy="write `sign: -1` for it, or other axes under `sensors`, in the mapping",
        )


def list_responses(delays: Sequence[Delay]) -> Iterator[str]:
    """Yield the motion of the vehicle when a command increases, in the axes of the log."""
    for delay in delays:
        if delay.velocity in _MOVES and delay.share >= MIN_RESPONSE_SHARE:
            motion = (_MOVES if delay.sign > 0 else _OPPOSITE_MOVES)[delay.velocity]
            yield f"increasing {delay.command} moves the vehicle {motion}"
