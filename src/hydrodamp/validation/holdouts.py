"""Logs for cross-validation: each fold holds out whole stretches and keeps the rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import BoolArray
from hydrodamp.basis.basis import Basis
from hydrodamp.data.log import Log, Segment
from hydrodamp.data.stretches import take
from hydrodamp.errors import MethodError
from hydrodamp.identification.rows.equations import Rows
from hydrodamp.identification.rows.folds import Folds, folds
from hydrodamp.models.model import DampingModel


@dataclass(frozen=True)
class Holdout:
    """One fold: what to identify from, and what to replay.

    Attributes
    ----------
    train : Log
        All other folds. What a cut leaves of a segment is a segment of its own.
    test : Log
        This fold; each of its segments is replayed from its first sample.
    """

    train: Log
    test: Log


def holdouts(log: Log, n: int | None = None, gap: float = 5.0) -> tuple[Holdout, ...]:
    """Divide a log into folds of whole segments, or of blocks with a gap between them.

    Parameters
    ----------
    log : Log
        What was measured.
    n : int, optional
        How many folds. By default one a segment, but at most ten, and five blocks
        where there is a single segment. More than there are segments: the longest
        are cut into blocks.
    gap : float
        What is left out around the cut between two blocks [s]: errors of neighbouring
        samples are alike, and a block should not be known from its neighbour.

    Returns
    -------
    holdouts : tuple of Holdout
        One a fold.

    Raises
    ------
    MethodError
        If there are fewer than two folds, the gap is negative, or the log is too short.

    Examples
    --------
    >>> log = Log.from_arrays(range(6), {"u": range(6)}, segment="aaabbb")
    >>> [[part.name for part in fold.test.segments] for fold in holdouts(log)]
    [['a'], ['b']]
    """
    divided = folds(_samples(log), n, gap)
    return tuple(_holdout(log, divided, fold) for fold in range(divided.n))


def check_lengths(parts: Sequence[Holdout], models: Sequence[DampingModel]) -> None:
    """Refuse folds that leave too little for every model.

    Parameters
    ----------
    parts : sequence of Holdout
        The folds.
    models : sequence of DampingModel
        Restricted to the free axes. One that is too large alone is a row with a status.

    Raises
    ------
    MethodError
        Names the first such fold and the samples that the smallest model needs.
    """
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
