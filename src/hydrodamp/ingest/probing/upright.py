"""Which way is down: what tells axes FRD over NED from FLU over a world with z up."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.data.attitude import rotation
from hydrodamp.data.channels import SPECIFIC_FORCE
from hydrodamp.ingest.formats.detect import usual_axes
from hydrodamp.ingest.probing.columns import Series, together, words
from hydrodamp.ingest.probing.frames import (
    Roles,
    attitude_series,
    changes,
    compared,
    quaternions,
    whole_rows,
    windows,
)

#: Marine craft are recorded forward-starboard-down unless something speaks against it.
USUAL = 0.6

_ROS, _AUTOPILOT, _GRAVITY, _DEPTH, _POSE, _SURFACE = 2.5, 4.0, 4.0, 4.0, 0.7, 0.8
_HEAVE = frozenset(("heave", "vertical"))
_YAW = frozenset(("yaw", "turn"))
_LATERAL = frozenset(("lateral", "sway", "strafe"))
_NO_STICKS = frozenset(("vel", "twist", "rudder", "fin"))
# Weights by the sense of heave, and of yaw and lateral together.
_PATTERNS = {
    (1, -1): -2.4,
    (-1, 1): 2.4,
    (1, 1): -1.0,
    (1, 0): -1.0,
    (-1, 0): 1.5,
    (0, -1): -1.0,
    (0, 1): 0.3,
}
_ACTS = {1: "along", -1: "against"}
_DIVE = 1.0  # m, more than a vehicle bobs at the surface
_LONG = 10.0  # s, over which depth changes by more than its noise
_STRONG = 5.0  # standard errors
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


def weigh(form: str, roles: Roles, commands: Sequence[Series]) -> Upright:
    """Return the axes of body and attitude that the signs speak for."""
    signs = (
        *_custom(form),
        *_gravity(roles),
        *_depth(roles),
        *_sticks(roles, commands),
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


def _sticks(roles: Roles, commands: Sequence[Series]) -> Iterator[Sign]:
    """Read a pilot's sticks: up is up for nearly all; right is starboard for most, not in ROS."""
    heave = _sense(_HEAVE, "w", roles, commands)
    turn = _sense(_YAW, "r", roles, commands) + _sense(_LATERAL, "v", roles, commands)
    right = (turn > 0) - (turn < 0)
    if weight := _PATTERNS.get((heave, right)):
        seen = [f"the heave stick acts {_ACTS[heave]} +w"] if heave else []
        seen += [f"the yaw or lateral stick acts {_ACTS[right]} +r, +v"] if right else []
        custom = "up on a stick is up for nearly all; right is starboard for most, but port in ROS"
        yield Sign(weight, f"{' and '.join(seen)}; {custom}")


def _sense(names: frozenset[str], velocity: str, roles: Roles, commands: Sequence[Series]) -> int:
    """Return 1 or -1 where a stick surely moves the vehicle, 0 where none does."""
    if f"velocity.{velocity}" not in roles:
        return 0
    for command in commands:
        said = set(words(command.column))
        acts = said & names and not said & _NO_STICKS
        if acts and (pull := _pull(command, roles[f"velocity.{velocity}"])):
            return (pull > _STRONG) - (pull < -_STRONG)
    return 0


def _pull(command: Series, velocity: Series) -> float:
    """Return how surely a velocity grows with a command, in standard errors."""
    joined = together([velocity, command])
    first, last = windows(joined.elapsed, whole_rows(joined.values))
    if len(first) < 10:
        return 0.0
    growth = joined.values[last, 0] - joined.values[first, 0]
    middle = (first + last) // 2
    rows = np.column_stack((joined.values[middle, 1], joined.values[first, 0], 0 * growth + 1))
    solved, _, rank, _ = np.linalg.lstsq(rows, growth, rcond=None)
    if rank < 3:
        return 0.0
    rest = growth - rows @ solved
    noise = float(rest @ rest) / max(len(rest) - 3, 1) * np.linalg.inv(rows.T @ rows)[0, 0]
    return float(solved[0] / math.sqrt(noise)) if noise > 0.0 else 0.0


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
