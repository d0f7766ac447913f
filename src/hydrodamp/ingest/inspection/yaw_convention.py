"""Sign and zero of the yaw, by the motion along the position.

Of the yaws ±ψ + k 90° the one is right with which the velocity (u, v) in world axes integrates to
the position: its regression explains far more than that of the recorded yaw.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.data.attitude import euler_from_quaternion
from hydrodamp.data.channel_regression import NO_REGRESSION, ChannelRegression
from hydrodamp.data.channels import UNITS
from hydrodamp.ingest.inspection.coordinates import horizontal_roles, to_metres
from hydrodamp.ingest.inspection.frames import (
    RoleSeries,
    attitude_roles,
    regress_complete,
    synchronise_with_attitude,
)
from hydrodamp.ingest.mapping.channel_schema import COORDINATES

_PLANE = ("position.x", "position.y")
_SURE_CORRELATION = 0.95  # of a velocity and a position, from which another yaw is taken


@dataclass(frozen=True)
class YawMatch:
    """Sign and zero [deg] of a yaw that differ from the recorded ones, by the motion."""

    role: str = ""
    sign: int = 1
    zero: int = 0
    regression: ChannelRegression = NO_REGRESSION
    recorded: ChannelRegression = NO_REGRESSION
    is_named: bool = True  # the axes of the position are

    @property
    def exchanges(self) -> bool:
        """Whether x is east and y north, rather than the yaw counterclockwise from east."""
        return not self.is_named and (self.sign, self.zero) == (-1, 90)

    def correct(self, roles: RoleSeries) -> RoleSeries:
        """Return the series with the yaw, or the axes of the position, corrected."""
        if not self.role:
            return roles
        if self.exchanges:
            first, second = _PLANE
            return {**roles, first: roles[second], second: roles[first]}
        series = roles[self.role]
        values = self.sign * series.values + self.zero_in(series.unit)
        return {**roles, self.role: replace(series, values=values)}

    def zero_in(self, unit: str | None) -> float:
        """Return the zero in a unit."""
        return float(np.radians(self.zero) / UNITS["angle"][unit or "rad"])

    @property
    def evidence(self) -> str:
        """What the position says."""
        return (
            f"with it the velocity is along the position ({self.regression.correlation:.2f}), "
            f"as recorded it is not ({self.recorded.correlation:.2f})"
        )


def match_yaw(roles: RoleSeries) -> YawMatch:
    """Find sign and zero of the yaw with which the vehicle moves along its position.

    Without a recorded velocity it is assumed to move ahead.
    """
    name = next((role for role in ("attitude.yaw", "attitude.heading") if role in roles), "")
    plane = horizontal_roles(roles)
    if not name or attitude_roles(roles)[0] == "attitude.qw" or not plane:
        return YawMatch()
    if plane != COORDINATES:
        plane = _PLANE
    speeds = [f"velocity.{axis}" for axis in "uv" if f"velocity.{axis}" in roles]
    used = [*plane, *(speeds if "velocity.u" in speeds else ())]
    elapsed, columns, attitudes = synchronise_with_attitude(roles, [roles[each] for each in used])
    if len(elapsed) < 2:
        return YawMatch()
    units = [roles[each].unit if plane == COORDINATES else None for each in plane]
    position, body = to_metres(columns[:, :2], plane, units), np.zeros((len(elapsed), 2))
    body[:, : len(used) - 2] = columns[:, 2:]
    if len(used) == 2:
        with np.errstate(divide="ignore", invalid="ignore"):
            body[:, 0] = np.linalg.norm(np.gradient(position, elapsed, axis=0), axis=1)
    yaw = euler_from_quaternion(attitudes)[:, 2]

    def regress(sign: int, zero: int, port: float) -> ChannelRegression:
        turn, (ahead, side) = sign * yaw + np.radians(zero), body.T
        across = port * side
        moves = ahead * np.cos(turn) - across * np.sin(turn)
        rate = np.column_stack((moves, ahead * np.sin(turn) + across * np.cos(turn)))
        return regress_complete(elapsed, rate, position)

    results = {
        (sign, zero): max((regress(sign, zero, port) for port in (1.0, -1.0)), key=_correlation)
        for sign in (1, -1)
        for zero in (0, 90, 180, -90)
    }
    recorded, earth_fixed = results[1, 0], regress_complete(elapsed, body, position)
    candidates = results
    if len(used) == 2:  # a vehicle may move astern or sideways: its sign must be decided
        candidates = {key: each for key, each in results.items() if key[0] < 0 or not key[1]}
        recorded = max((results[1, zero] for zero in (0, 90, 180, -90)), key=_correlation)
    (sign, zero), best = max(candidates.items(), key=lambda item: _correlation(item[1]))
    is_sure = best.correlation > max(_SURE_CORRELATION, _correlation(earth_fixed))
    is_sure &= best.explains_more_than(recorded)
    is_named = plane == COORDINATES or "position.north" in roles
    return YawMatch(name, sign, zero, best, recorded, is_named) if is_sure else YawMatch()


def _correlation(regression: ChannelRegression) -> float:
    return float(np.nan_to_num(regression.correlation, nan=-1.0))
