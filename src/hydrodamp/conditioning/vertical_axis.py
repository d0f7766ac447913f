"""Direction of the z axis (FRD or FLU), by a gravity test, a depth test and a surface test.

Each test gives log-odds for z down; they are added to a prior (naive Bayes) and the sum is turned
into a confidence by the logistic function.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.data.channel_regression import regress_increments, window_increments
from hydrodamp.data.log import Log
from hydrodamp.data.time_scale import motion_time_scale

#: Prior log-odds of forward-starboard-down axes, the most common convention.
PRIOR_LOG_ODDS = 0.6
#: Confidence [%] from which the axes count as known.
SURE_CONFIDENCE = 90

UNDECIDED = "The direction of z is undetermined"
_INDISTINGUISHABLE = "motion alone cannot distinguish FRD over NED from FLU over a world with z up"
_GRAVITY_LOG_ODDS, _DEPTH_LOG_ODDS, _SURFACE_LOG_ODDS = 4.0, 4.0, 0.8  # log-odds of full agreement
_MIN_VERTICAL_SHARE = 0.8  # vertical share of a specific force from which it is gravity
_MIN_DEPTH_CORRELATION = 0.3  # correlation from which depth and vertical velocity agree
_MIN_DIVE_M = 1.0  # m; more than the heave of a surfaced vehicle
_RELATIVE_DEPTH_WINDOW = 4.0  # correlation times; depth changes by more than its noise
_MAX_CONFIDENCE = 99  # %


@dataclass(frozen=True)
class AxisEvidence:
    """Result of one test: log-odds of z down, and its message."""

    log_odds: float
    message: str


@dataclass(frozen=True)
class VerticalAxis:
    """Body axes (FRD or FLU) with confidence [%] and evidence."""

    body: str
    confidence: int
    evidence: tuple[AxisEvidence, ...]

    @classmethod
    def combine(cls, tests: Iterable[AxisEvidence]) -> VerticalAxis:
        """Add the log-odds of all tests to the prior."""
        evidence = tuple(tests)
        total = PRIOR_LOG_ODDS + sum(test.log_odds for test in evidence)
        confidence = round(100 / (1 + math.exp(-abs(total))))
        return cls("FRD" if total > 0 else "FLU", min(_MAX_CONFIDENCE, confidence), evidence)

    @property
    def is_sure(self) -> bool:
        """Whether the confidence suffices."""
        return self.confidence >= SURE_CONFIDENCE

    @property
    def warnings(self) -> tuple[str, ...]:
        """A warning if the axes are not known, with what to write once they are."""
        message = (
            f"{_INDISTINGUISHABLE}: {self.body} has a confidence of {self.confidence} %. Use an "
            "accelerometer, a depth or documentation, then write `frame: FRD`, or `frame: FLU` "
            "with `world: NWU` (`ENU`)."
        )
        return () if self.is_sure else (message,)

    def describe(self, responses: Sequence[str]) -> str:
        """Return the evidence for the direction of z, or what would determine it."""
        evidence = "; ".join(test.message for test in self.evidence)
        if self.is_sure:
            return f"{self.body} by {self.confidence} %: {evidence}."
        observed = f" Responses: {'; '.join(responses)}." if responses else ""
        return (
            f"{UNDECIDED}: {_INDISTINGUISHABLE}{f'; {evidence}' if evidence else ''}.{observed}"
            " Compare with the actual motion, or record a specific force or a depth."
        )


def gravity_test(force: FloatArray, down: FloatArray) -> Iterator[AxisEvidence]:
    """Gravity test: at rest the specific force points up."""
    known = np.isfinite(force).all(axis=1) & np.isfinite(down).all(axis=1)
    size = float(np.median(np.linalg.norm(force[known], axis=1))) if known.any() else 0.0
    if size == 0.0:
        return
    share = float(np.median(np.sum(force * down, axis=1)[known])) / size
    if abs(share) > _MIN_VERTICAL_SHARE:
        side = "+z" if share > 0 else "-z"
        message = f"{abs(share):.0%} of the specific force points towards {side}, which is up"
        yield AxisEvidence(-_GRAVITY_LOG_ODDS * share, message)


def depth_test(
    elapsed: FloatArray, bounds: IntArray, rise: FloatArray, depth: FloatArray
) -> Iterator[AxisEvidence]:
    """Depth test: a depth grows with the velocity along the world's z if z is down."""
    columns = rise[:, np.newaxis], depth[:, np.newaxis]
    window = _RELATIVE_DEPTH_WINDOW * motion_time_scale(elapsed, columns[0], bounds)
    pairs = window_increments(elapsed, bounds, *columns, window)
    if not len(pairs[0]):
        return
    # A tilted Doppler log adds a constant.
    correlation = regress_increments(*(pair - np.median(pair) for pair in pairs)).correlation
    if abs(correlation) > _MIN_DEPTH_CORRELATION:
        evidence = f"correlation {correlation:+.2f}"
        message = f"depth changes with the velocity along the world's z ({evidence})"
        yield AxisEvidence(_DEPTH_LOG_ODDS * correlation, message)


def surface_test(position: FloatArray) -> Iterator[AxisEvidence]:
    """Surface test: a vehicle starts near the surface, so it moves down from its start."""
    position = position[np.isfinite(position)]
    if not len(position):
        return
    low, high = np.quantile(position - position[0], (0.02, 0.98)).tolist()
    if high - low > _MIN_DIVE_M and abs(high + low) > 0.4 * (high - low):
        span = f"{-low:.2g} m towards -z, {max(high, 0.0):.2g} m towards +z"
        message = f"from its start it moves {span}: vehicles start near the surface"
        yield AxisEvidence(math.copysign(_SURFACE_LOG_ODDS, high + low), message)


def vertical_tests(log: Log, depth: FloatArray | None = None) -> Iterator[AxisEvidence]:
    """Yield the tests of a log whose axes are assumed forward-starboard-down.

    Velocity and position in the same axes agree for either direction of z. A specific force and
    an independent depth distinguish them.
    """
    down = np.tile((0.0, 0.0, 1.0), (log.n, 1)) if log.attitude is None else log.down
    if log.specific_force is not None:
        yield from gravity_test(log.specific_force, down)
    if depth is not None and {"u", "w"} & {*log.velocity_names}:
        rise = np.sum(down * log.velocity[:, :3], axis=1)
        yield from depth_test(log.time, log.bounds, rise, depth)
    if log.position is not None:
        yield from surface_test(log.position[:, 2])
