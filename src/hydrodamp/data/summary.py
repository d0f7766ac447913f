"""A log on one screen of text."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.data.channels import BLOCKS, unit_of
from hydrodamp.data.record import Segment

_LISTED = 12
_WIDTH = 160


def summary(
    source: str,
    arrays: Mapping[str, FloatArray],
    names: tuple[Sequence[str], Sequence[str]],
    segments: Sequence[Segment],
    notes: Sequence[str],
) -> str:
    """Return what a log holds: its span, columns, ranges and segments."""
    lines = [
        f"Log {source or 'of arrays'}",
        *_head(arrays, segments),
        *_ranges(arrays, *names),
        *_spans(arrays["time"], segments),
        *_notes(notes),
    ]
    return "\n".join(lines)


def _head(arrays: Mapping[str, FloatArray], segments: Sequence[Segment]) -> Iterator[str]:
    time, count = arrays["time"], len(segments)
    steps = np.concatenate([np.diff(time[part.start : part.stop]) for part in segments])
    yield (
        f"  {len(time)} samples, {steps.sum():.6g} s in {count}"
        f" segment{'s' if count > 1 else ''}, median step {np.median(steps):.4g} s"
    )
    optional = [block for block in BLOCKS if block.name not in ("time", "velocity")]
    there = [block.title for block in optional if block.name in arrays]
    absent = [block.title for block in optional if block.name not in arrays]
    yield f"  with {', '.join(there) or 'velocity only'}" + (
        f"; without {', '.join(absent)}" if absent else ""
    )


def _ranges(
    arrays: Mapping[str, FloatArray], velocities: Sequence[str], commands: Sequence[str]
) -> Iterator[str]:
    for name in velocities:
        yield _range(name, arrays["velocity"][:, VELOCITIES.index(name)], unit_of(name))
    for name, values in zip(commands[:_LISTED], arrays["commands"].T, strict=False):
        yield _range(name, values, "")
    yield from _more(len(commands), "commands")


def _range(name: str, values: FloatArray, unit: str) -> str:
    return f"  {name:<14} {values.min():>10.4g} .. {values.max():<10.4g} {unit}".rstrip()


def _spans(time: FloatArray, segments: Sequence[Segment]) -> Iterator[str]:
    yield "  segment            samples  from [s]    to [s]"
    for part in segments[:_LISTED]:
        first, last = time[part.start], time[part.stop - 1]
        yield f"  {part.name:<18} {len(part):>7} {first:>9.6g} {last:>9.6g}"
    yield from _more(len(segments), "segments")


def _notes(notes: Sequence[str]) -> Iterator[str]:
    if notes:
        yield "  what was done to it"
    yield from (f"    {textwrap.shorten(note, _WIDTH)}" for note in notes[:_LISTED])
    yield from _more(len(notes), "notes")


def _more(count: int, what: str) -> Iterator[str]:
    if count > _LISTED:
        yield f"  ... and {count - _LISTED} more {what}"
