"""Which way is down: what tells axes FRD over NED from FLU over a world with z up."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hydrodamp.data.attitude import rotation
from hydrodamp.data.channels import SPECIFIC_FORCE
from hydrodamp.ingest.formats.detect import usual_axes
from hydrodamp.ingest.probing.columns import together
from hydrodamp.ingest.probing.frames import (
    Roles,
    attitude_series,
    changes,
    compared,
    quaternions,
)

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
    signs = (
        *_custom(form),
        *_gravity(roles),
        *_depth(roles),
        *_pose(roles),
        *_surface(roles),
    )
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
    joined = together([roles["position.depth"], *(roles[name] for name in names), *attitude])
    n = 1 + len(names)
    third = rotation(quaternions(roles, joined.values[:, n:]))[:, 2]
    columns = ["uvw".index(name[-1]) for name in names]
    rise = np.sum(third[:, columns] * joined.values[:, 1:n], axis=1)
    added, moved = changes(joined.elapsed, rise[:, np.newaxis], joined.values[:, :1], _LONG)
    if not len(added):
        return
    # A tilted Doppler log adds a constant.
    likeness = compared(added - np.median(added), moved - np.median(moved)).correlation
    if abs(likeness) > 0.3:
        told = f"depth changes with the velocity along the world's z (correlation {likeness:+.2f})"
        yield Sign(math.copysign(_DEPTH * abs(likeness), likeness), told)


def _pose(roles: Roles) -> Iterator[Sign]:
    if "position.z" in roles and "position.depth" not in roles:
        yield Sign(-_POSE, "a pose called x y z, as of motion capture, mostly has z up")


def _surface(roles: Roles) -> Iterator[Sign]:
    """See to which side of its start a vehicle goes: it starts near the surface."""
    if "position.z" not in roles:
        return
    place = roles["position.z"].values
    place = place[np.isfinite(place)] - place[np.isfinite(place)][0]
    low, high = (float(edge) for edge in np.quantile(place, (0.02, 0.98)))
    if high - low > _DIVE and abs(high + low) > 0.4 * (high - low):
        told = f"from its start it goes {-low:.2g} m towards -z, {max(high, 0.0):.2g} m towards +z"
        yield Sign(math.copysign(_SURFACE, high + low), f"{told}: it starts near the surface")
