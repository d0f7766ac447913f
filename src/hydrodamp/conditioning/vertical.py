"""Which way is down: what gravity, depth and the surface say of the axes of a log."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.data.agreement import changes, compared
from hydrodamp.data.log import Log

#: Log-odds that axes are forward-starboard-down where nothing else is known: most craft's are.
USUAL = 0.6
#: Confidence [%] from which the axes are known.
SURE = 90

_GRAVITY, _DEPTH, _SURFACE = 4.0, 4.0, 0.8  # log-odds of full agreement
_UPWARD = 0.8  # share of a specific force along the vertical, from which it is gravity
_ALIKE = 0.3  # correlation from which a depth goes with a velocity
_DIVE = 1.0  # m, more than a vehicle bobs at the surface
_LONG = 10.0  # s, over which depth changes by more than its noise
_MOST = 99  # %


@dataclass(frozen=True)
class Sign:
    """One sign of which way is down: log-odds, positive for z down, and what it rests on."""

    weight: float
    told: str


@dataclass(frozen=True)
class Upright:
    """Which axes, all signs weighed."""

    body: str
    confidence: int
    signs: tuple[Sign, ...]

    @classmethod
    def of(cls, signs: tuple[Sign, ...]) -> Upright:
        """Weigh signs."""
        total = USUAL + sum(sign.weight for sign in signs)
        sure = 100 / (1 + math.exp(-abs(total)))
        return cls("FRD" if total > 0 else "FLU", min(_MOST, round(sure)), signs)

    @property
    def is_sure(self) -> bool:
        """Whether the signs decide."""
        return self.confidence >= SURE

    @property
    def doubts(self) -> tuple[str, ...]:
        """What to write once the axes are known, where they are not."""
        told = (
            f"Motion alone cannot distinguish FRD over NED from FLU over a world with z up, and "
            f"{self.body} is {self.confidence} % sure: ask an accelerometer, a depth or whoever "
            "wrote the log, then write `frame: FRD`, or `frame: FLU` with `world: NWU` or `ENU`."
        )
        return () if self.is_sure else (told,)


def gravity_sign(force: FloatArray, down: FloatArray) -> Iterator[Sign]:
    """Yield to which side of the vertical a specific force points; at rest it points up."""
    known = np.isfinite(force).all(axis=1) & np.isfinite(down).all(axis=1)
    size = float(np.median(np.linalg.norm(force[known], axis=1))) if known.any() else 0.0
    if size == 0.0:
        return
    share = float(np.median(np.sum(force * down, axis=1)[known])) / size
    if abs(share) > _UPWARD:
        side = "+z" if share > 0 else "-z"
        told = f"{abs(share):.0%} of the specific force points towards {side}, which is up"
        yield Sign(-_GRAVITY * share, told)


def depth_sign(
    elapsed: FloatArray, bounds: IntArray, rise: FloatArray, depth: FloatArray
) -> Iterator[Sign]:
    """Yield whether a depth grows with the velocity along the world's z."""
    columns = rise[:, np.newaxis], depth[:, np.newaxis]
    added, moved = changes(elapsed, bounds, *columns, _LONG)
    if not len(added):
        return
    # A tilted Doppler log adds a constant.
    likeness = compared(added - np.median(added), moved - np.median(moved)).correlation
    if abs(likeness) > _ALIKE:
        told = f"depth changes with the velocity along the world's z (correlation {likeness:+.2f})"
        yield Sign(math.copysign(_DEPTH * abs(likeness), likeness), told)


def surface_sign(place: FloatArray) -> Iterator[Sign]:
    """Yield to which side of its start a vehicle goes: it starts near the surface."""
    place = place[np.isfinite(place)]
    low, high = np.quantile(place - place[0], (0.02, 0.98)).tolist() if len(place) else (0.0, 0.0)
    if high - low > _DIVE and abs(high + low) > 0.4 * (high - low):
        told = f"from its start it goes {-low:.2g} m towards -z, {max(high, 0.0):.2g} m towards +z"
        yield Sign(math.copysign(_SURFACE, high + low), f"{told}: it starts near the surface")


def signs_of(log: Log, depth: FloatArray | None = None) -> Iterator[Sign]:
    """Yield the signs in a log, which is forward-starboard-down by its axes; a depth beside it.

    A velocity and a position of the same axes agree whichever way is down, so that they decide
    nothing; a specific force does, and a depth that is known to count downwards.
    """
    down = np.tile((0.0, 0.0, 1.0), (log.n, 1)) if log.attitude is None else log.down
    if log.specific_force is not None:
        yield from gravity_sign(log.specific_force, down)
    if depth is not None and {"u", "w"} & {*log.velocity_names}:
        rise = np.sum(down * log.velocity[:, :3], axis=1)
        yield from depth_sign(log.time, log.bounds, rise, depth)
    if log.position is not None:
        yield from surface_sign(log.position[:, 2])
