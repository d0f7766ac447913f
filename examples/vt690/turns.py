"""The turns of a log, found by heading alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import hydrodamp as hd
from hydrodamp.data.attitude import euler_from_quaternion

ANGLE, WITHIN = np.radians(30.0), 20.0
"""A vehicle turns where its heading changes by 30 degrees within 20 s."""

BEFORE, AFTER, APART = 20.0, 40.0, 60.0
"""Seconds of a turn's log before and after it; turns that are less than a minute apart are one."""

SURFACE = 1.0
"""Depth [m] above which waves and air are near."""


def with_speed(log: hd.Log) -> hd.Log:
    """Return a log with the speed through the water as a command."""
    speed = np.hypot(log.velocity[:, 0], log.velocity[:, 1])
    names = (*log.command_names, "speed")
    return replace(log, command_names=names, commands=np.column_stack((log.commands, speed)))


def turns(log: hd.Log) -> list[hd.Log]:
    """Return the turns under water, one piece each: heading alone decides."""
    time, turning = log.elapsed, turning_samples(log)
    cuts = np.flatnonzero(np.diff(time[turning]) > APART)
    starts = time[turning[np.concatenate(([0], cuts + 1))]]
    ends = time[turning[np.concatenate((cuts, [-1]))]] + WITHIN
    spans = [log.between(a - BEFORE, b + AFTER) for a, b in zip(starts, ends, strict=True)]
    return [longest(span) for span in spans if span.position[:, 2].min() > SURFACE]


def turning_samples(log: hd.Log) -> np.ndarray:
    """Return the samples from which on the heading changes fast."""
    yaw = np.unwrap(euler_from_quaternion(log.attitude)[:, 2])
    later = np.interp(log.elapsed + WITHIN, log.elapsed, yaw)
    return np.flatnonzero(np.abs(later - yaw) > ANGLE)


def longest(log: hd.Log) -> hd.Log:
    """Return the longest segment: a turn that a gap of the log cuts loses its shorter part."""
    return log.select(max(log.segments, key=lambda part: part.stop - part.start).name)
