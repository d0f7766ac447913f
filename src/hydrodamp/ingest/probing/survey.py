"""What is in a log, before anything is identified from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.data.log import Log


@dataclass(frozen=True)
class SegmentFacts:
    """One segment of a log."""

    name: str
    n_samples: int
    start: float
    end: float
    step: float
    longest_step: float


@dataclass(frozen=True)
class Channel:
    """One column of a log."""

    name: str
    unit: str
    mean: float
    std: float
    low: float
    high: float
    n_changes: int


@dataclass(frozen=True)
class Survey:
    """What a log holds."""

    source: str
    n_samples: int
    duration: float
    segments: tuple[SegmentFacts, ...]
    velocities: tuple[Channel, ...]
    commands: tuple[Channel, ...]
    has: tuple[str, ...]


def survey(log: Log) -> Survey:
    """Look through a log."""
    parts = {
        "attitude": log.attitude,
        "wrench": log.wrench,
        "acceleration": log.acceleration,
        "eta": log.propulsion_ratio,
        "position": log.position,
        "specific_force": log.specific_force,
    }
    return Survey(
        source=log.source or "in memory",
        n_samples=log.n,
        duration=log.duration,
        segments=tuple(_segments(log)),
        velocities=tuple(
            _channel(log, name, "m/s" if name in "uvw" else "rad/s", log.velocity[:, place])
            for place, name in enumerate(VELOCITIES)
            if name in log.velocity_names
        ),
        commands=tuple(_channel(log, name, "", log.command(name)) for name in log.command_names),
        has=tuple(name for name, part in parts.items() if part is not None),
    )


def _segments(log: Log) -> list[SegmentFacts]:
    found = []
    for segment in log.segments:
        time = log.time[segment.start : segment.stop]
        steps = np.diff(time) if len(time) > 1 else np.zeros(1)
        ends = float(time[0]), float(time[-1])
        step = float(np.median(steps)), float(steps.max())
        found.append(SegmentFacts(segment.name, len(time), *ends, *step))
    return found


def _channel(log: Log, name: str, unit: str, values: FloatArray) -> Channel:
    changed = np.diff(values) != 0.0
    changed[log.bounds[1:, 0] - 1] = False
    return Channel(
        name=name,
        unit=unit,
        mean=float(values.mean()),
        std=float(values.std()),
        low=float(values.min()),
        high=float(values.max()),
        n_changes=int(changed.sum()),
    )
