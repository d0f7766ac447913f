"""Which way is down: what gravity, depth and the surface say of the axes of a log."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.data.agreement import regress_increments, window_increments
from hydrodamp.data.log import Log

#: Log-odds that axes are forward-starboard-down where nothing else is known: most craft's are.
PRIOR_LOG_ODDS = 0.6
#: Confidence [%] from which the axes are known.
SURE_CONFIDENCE = 90

_GRAVITY_LOG_ODDS, _DEPTH_LOG_ODDS, _SURFACE_LOG_ODDS = 4.0, 4.0, 0.8  # log-odds of full agreement
_MIN_VERTICAL_SHARE = 0.8  # share of a specific force along the vertical, from which it is gravity
_MIN_DEPTH_CORRELATION = 0.3  # correlation from which a depth goes with a velocity
_MIN_DIVE_M = 1.0  # m, more than a vehicle bobs at the surface
_DEPTH_WINDOW_S = 10.0  # s, over which depth changes by more than its noise
_MAX_CONFIDENCE = 99  # %


@dataclass(frozen=True)
class AxisEvidence:
    """One sign of which way is down: log-odds, positive for z down, and what it rests on."""

    log_odds: float
    message: str


@dataclass(frozen=True)
class VerticalAxis:
    """Which axes, all signs weighed."""

    body: str
    confidence: int
    evidence: tuple[AxisEvidence, ...]

    @classmethod
    def combine(cls, signs: tuple[AxisEvidence, ...]) -> VerticalAxis:
        """Weigh signs."""
        total = PRIOR_LOG_ODDS + sum(sign.log_odds for sign in signs)
        sure = 100 / (1 + math.exp(-abs(total)))
        return cls("FRD" if total > 0 else "FLU", min(_MAX_CONFIDENCE, round(sure)), signs)

    @property
    def is_sure(self) -> bool:
        """Whether the signs decide."""
        return self.confidence >= SURE_CONFIDENCE

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to write once the axes are known, where they are not."""
        told = (
            f"Motion alone cannot distinguish FRD over NED from FLU over a world with z up, and "
            f"{self.body} is {self.confidence} % sure: ask an accelerometer, a depth or whoever "
            "wrote the log, then write `frame: FRD`, or `frame: FLU` with `world: NWU` or `ENU`."
        )
        return () if self.is_sure else (told,)


def gravity_test(force: FloatArray, down: FloatArray) -> Iterator[AxisEvidence]:
    """Yield to which side of the vertical a specific force points; at rest it points up."""
    known = np.isfinite(force).all(axis=1) & np.isfinite(down).all(axis=1)
    size = float(np.median(np.linalg.norm(force[known], axis=1))) if known.any() else 0.0
    if size == 0.0:
        return
    share = float(np.median(np.sum(force * down, axis=1)[known])) / size
    if abs(share) > _MIN_VERTICAL_SHARE:
        side = "+z" if share > 0 else "-z"
        told = f"{abs(share):.0%} of the specific force points towards {side}, which is up"
        yield AxisEvidence(-_GRAVITY_LOG_ODDS * share, told)


def depth_test(
    elapsed: FloatArray, bounds: IntArray, rise: FloatArray, depth: FloatArray
) -> Iterator[AxisEvidence]:
    """Yield whether a depth grows with the velocity along the world's z."""
    columns = rise[:, np.newaxis], depth[:, np.newaxis]
    added, moved = window_increments(elapsed, bounds, *columns, _DEPTH_WINDOW_S)
    if not len(added):
        return
    # A tilted Doppler log adds a constant.
    likeness = regress_increments(added - np.median(added), moved - np.median(moved)).correlation
    if abs(likeness) > _MIN_DEPTH_CORRELATION:
        told = f"depth changes with the velocity along the world's z (correlation {likeness:+.2f})"
        yield AxisEvidence(math.copysign(_DEPTH_LOG_ODDS * abs(likeness), likeness), told)


def surface_test(place: FloatArray) -> Iterator[AxisEvidence]:
    """Yield to which side of its start a vehicle goes: it starts near the surface."""
    place = place[np.isfinite(place)]
    low, high = np.quantile(place - place[0], (0.02, 0.98)).tolist() if len(place) else (0.0, 0.0)
    if high - low > _MIN_DIVE_M and abs(high + low) > 0.4 * (high - low):
        told = f"from its start it goes {-low:.2g} m towards -z, {max(high, 0.0):.2g} m towards +z"
        yield AxisEvidence(
            math.copysign(_SURFACE_LOG_ODDS, high + low), f"{told}: it starts near the surface"
        )


def vertical_tests(log: Log, depth: FloatArray | None = None) -> Iterator[AxisEvidence]:
    """Yield the signs in a log, which is forward-starboard-down by its axes; a depth beside it.

    A velocity and a position of the same axes agree whichever way is down, so that they decide
    nothing; a specific force does, and a depth that is known to count downwards.
    """
    down = np.tile((0.0, 0.0, 1.0), (log.n, 1)) if log.attitude is None else log.down
    if log.specific_force is not None:
        yield from gravity_test(log.specific_force, down)
    if depth is not None and {"u", "w"} & {*log.velocity_names}:
        rise = np.sum(down * log.velocity[:, :3], axis=1)
        yield from depth_test(log.time, log.bounds, rise, depth)
    if log.position is not None:
        yield from surface_test(log.position[:, 2])
