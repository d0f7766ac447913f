"""Logs for cross-validation: each fold holds out whole stretches and keeps the rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import BoolArray
from hydrodamp.basis.basis import Basis
from hydrodamp.data.log import Log, Segment, take
from hydrodamp.errors import MethodError
from hydrodamp.identification.folds import Folds, folds
from hydrodamp.identification.rows import Rows
from hydrodamp.models.model import DampingModel


@dataclass(frozen=True)
class Holdout:
    """One fold: what to identify from, and what to replay."""

    train: Log
    test: Log


def holdouts(log: Log, n: int | None = None, gap: float = 5.0) -> tuple[Holdout, ...]:
    """Divide a log into folds of whole segments, or of blocks with a gap between them."""
    divided = folds(_samples(log), n, gap)
    return tuple(_holdout(log, divided, fold) for fold in range(divided.n))


def check_lengths(parts: Sequence[Holdout], models: Sequence[DampingModel]) -> None:
    """Refuse folds that leave too little for every model."""
    needed = min((max(map(len, model.terms), default=0) for model in models), default=0)
    for number, fold in enumerate(parts, start=1):
        if fold.train.n < needed:
            raise MethodError(
                f"fold {number} of {len(parts)} leaves {fold.train.n} samples to identify from, "
                f"and the smallest model needs {needed}: give a longer log, a smaller gap, or "
                "folds that hold out less."
            )


def _samples(log: Log) -> Rows:
    """Return a row a sample, without anything but its segment and time."""
    lengths = [len(part) for part in log.segments]
    segment = np.repeat(np.arange(len(lengths)), lengths)
    return Rows(Basis(()), np.empty((log.n, 0)), np.zeros((log.n, 6)), segment, log.time)


def _holdout(log: Log, divided: Folds, fold: int) -> Holdout:
    here = divided.part == fold
    rest = ~here & (divided.part >= 0)
    stretches = [_stretches(log, chosen) for chosen in (rest, here)]
    if not all(stretches):
        raise MethodError(
            f"{divided.made}: fold {fold + 1} leaves no two neighbouring samples to "
            f"{'replay' if stretches[0] else 'identify from'}. Give a longer log, fewer folds "
            "or a smaller gap."
        )
    train, test = (take(log, pieces) for pieces in stretches)
    return Holdout(train, test)


def _stretches(log: Log, chosen: BoolArray) -> list[Segment]:
    """Return what is chosen of each segment; a piece of one has its start [s] in its name."""
    found = []
    for part in log.segments:
        kept = np.concatenate([[False], chosen[part.start : part.stop], [False]])
        edges = part.start + np.flatnonzero(kept[1:] != kept[:-1]).reshape(-1, 2)
        for start, stop in edges[np.diff(edges, axis=1).ravel() >= 2].tolist():
            whole = stop - start == len(part)
            since = log.time[start] - log.time[part.start]
            name = part.name if whole else f"{part.name}+{since:.6g}s"
            found.append(Segment(name, start, stop))
    return found
