"""Data that stand in both the training and the test part."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hydrodamp.data.log import Log

Stretch = tuple[float, float]
"""Start and end on the running clock of LOG [s]."""


def overlap(
    train: Mapping[str, Stretch | None], test: Mapping[str, Stretch | None], whole: Log | None
) -> str:
    """Return what two parts share, in words."""
    if whole is None:
        return ", ".join(dict.fromkeys(_files(tuple(train), tuple(test))))
    return ", ".join(dict.fromkeys(_stretches(train, test, whole)))


def _files(train: Sequence[str], test: Sequence[str]) -> Iterator[str]:
    learnt = {Path(name).resolve() for name in train}
    return (name for name in test if Path(name).resolve() in learnt)


def _stretches(
    train: Mapping[str, Stretch | None], test: Mapping[str, Stretch | None], whole: Log
) -> Iterator[str]:
    for one, first in train.items():
        for other, second in test.items():
            for a, b in _rows(one, first, whole):
                for c, d in _rows(other, second, whole):
                    start, stop = max(a, c), min(b, d)
                    if start < stop:
                        yield _called(one, first, other, second, whole, (start, stop))


def _rows(name: str, span: Stretch | None, whole: Log) -> list[tuple[int, int]]:
    """Return the first and one-past-last samples of a part."""
    from hydrodamp.data.record import goes_by

    if span is None:
        return [(part.start, part.stop) for part in whole.segments if goes_by(part.name, name)]
    first, last = whole.elapsed.searchsorted(span).tolist()
    return [(first, last)]


def _called(
    one: str,
    first: Stretch | None,
    other: str,
    second: Stretch | None,
    whole: Log,
    rows: tuple[int, int],
) -> str:
    if one == other:
        return one
    if first is not None and second is not None:
        return f"{max(first[0], second[0]):g}:{min(first[1], second[1]):g}"
    start, end = whole.elapsed[rows[0]], whole.elapsed[rows[1] - 1]
    names = " and ".join(name for name, span in ((one, first), (other, second)) if span is None)
    return f"{start:.6g}:{end:.6g} of {names}"
