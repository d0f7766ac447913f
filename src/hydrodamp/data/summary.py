"""A log on one screen of text."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import VELOCITIES

if TYPE_CHECKING:
    from hydrodamp.data.log import Log

_LISTED = 12
_WIDTH = 160


def summary(log: Log) -> str:
    """Return what a log holds: its span, columns, ranges and segments."""
    return "\n".join((*_head(log), *_ranges(log), *_segments(log), *_notes(log)))


def _head(log: Log) -> Iterator[str]:
    count = len(log.segments)
    steps = np.concatenate([np.diff(log.time[a:b]) for a, b in log.bounds])
    yield f"Log {log.source or 'of arrays'}"
    yield (
        f"  {log.n} samples, {log.duration:.6g} s in {count}"
        f" segment{'s' if count > 1 else ''}, median step {np.median(steps):.4g} s"
    )
    optional = {
        "attitude": log.attitude,
        "wrench": log.wrench,
        "acceleration": log.acceleration,
        "propulsion ratio": log.propulsion_ratio,
    }
    extra = {"position": log.position, "specific force": log.specific_force}
    present = [name for name, block in optional.items() if block is not None]
    present += [name for name, block in extra.items() if block is not None]
    absent = [name for name, block in optional.items() if block is None]
    yield f"  with {', '.join(present) or 'velocity only'}" + (
        f"; without {', '.join(absent)}" if absent else ""
    )


def _ranges(log: Log) -> Iterator[str]:
    for index, name in enumerate(VELOCITIES):
        if name in log.velocity_names:
            unit = "m/s" if index < 3 else "rad/s"
            yield _range(name, log.velocity[:, index], unit)
    for name in log.command_names[:_LISTED]:
        yield _range(name, log.command(name), "")
    yield from _more(len(log.command_names), "commands")


def _range(name: str, values: FloatArray, unit: str) -> str:
    return f"  {name:<14} {values.min():>10.4g} .. {values.max():<10.4g} {unit}".rstrip()


def _segments(log: Log) -> Iterator[str]:
    yield "  segment            samples  from [s]    to [s]"
    for part in log.segments[:_LISTED]:
        first, last = log.time[part.start], log.time[part.stop - 1]
        yield f"  {part.name:<18} {len(part):>7} {first:>9.6g} {last:>9.6g}"
    yield from _more(len(log.segments), "segments")


def _notes(log: Log) -> Iterator[str]:
    if log.notes:
        yield "  what was done to it"
    yield from (f"    {textwrap.shorten(note, _WIDTH)}" for note in log.notes[:_LISTED])
    yield from _more(len(log.notes), "notes")


def _more(count: int, what: str) -> Iterator[str]:
    if count > _LISTED:
        yield f"  ... and {count - _LISTED} more {what}"
