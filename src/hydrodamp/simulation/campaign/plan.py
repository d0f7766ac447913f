"""The runs of the campaign: propeller speeds and steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray

FIRST_STEP = 5.0
"""Time of the first step of every run [s]."""

HEADING_STEPS = (60.0, -90.0, 120.0, -100.0, 70.0, -120.0, 90.0, -60.0, 100.0, -70.0)
"""Changes of the heading wanted [deg]; they add up to zero."""

DEPTH_STEPS = (3.0, -4.0, 5.0, -4.0, 3.5, -5.0, 4.5, -3.0)
"""Changes of the depth wanted [m]; they add up to zero."""

HEADING_HOLDS = (25.0, 20.0, 22.0, 24.0, 21.0, 23.0, 25.0)
"""Time from a heading step to the next [s]."""

DEPTH_HOLDS = (16.0, 14.0, 17.0, 15.0, 18.0, 14.0, 16.0)
"""Time from a depth step to the next [s]."""


@dataclass(frozen=True)
class Steps:
    """A staircase of reference values that starts from zero and repeats."""

    changes: tuple[float, ...]
    holds: tuple[float, ...]
    first: float = FIRST_STEP

    def at(self, time: FloatArray) -> FloatArray:
        """Return the reference at the times given."""
        count = 2 + int(np.max(time, initial=0.0) / min(self.holds))
        starts = self.first + np.cumsum([0.0, *np.resize(self.holds, count - 1)])
        levels = np.concatenate(([0.0], np.cumsum(np.resize(self.changes, count))))
        reference: FloatArray = levels[np.searchsorted(starts, time, side="right")]
        return reference


STEADY = Steps((0.0,), HEADING_HOLDS)
"""No step at all: hold what there is."""


@dataclass(frozen=True)
class Run:
    """One run: a propeller speed, and what the autopilot is asked for."""

    name: str
    rpm: float
    heading: Steps = STEADY
    depth: Steps = STEADY


def _headings(place: int) -> Steps:
    return Steps(_from(place, HEADING_STEPS), _from(place, HEADING_HOLDS))


def _depths(place: int) -> Steps:
    return Steps(_from(place, DEPTH_STEPS), _from(place, DEPTH_HOLDS))


def _from(place: int, values: tuple[float, ...]) -> tuple[float, ...]:
    return values[place:] + values[:place]


TRAINING = (
    Run("depth-2600", 2600.0, depth=_depths(0)),
    Run("yaw-1800", 1800.0, heading=_headings(0)),
    Run("yaw-2133", 2133.0, heading=_headings(2)),
    Run("yaw-2600", 2600.0, heading=_headings(4)),
)
"""The estimation runs of section V-B, in its order."""

TESTING = (
    Run("depth-2133", 2133.0, depth=_depths(3)),
    Run("yaw-2350", 2350.0, heading=_headings(5)),
)
"""The validation runs of section V-B, in its order."""
