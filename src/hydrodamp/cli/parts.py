"""From LOG, --train and --test to the logs to identify and to replay on."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hydrodamp.errors import HydrodampWarning, ProblemError

if TYPE_CHECKING:
    from hydrodamp.data.log import Log

_NUMBER = r"[0-9]+(?:\.[0-9]*)?(?:[eE][+-]?[0-9]+)?|\.[0-9]+"
_SPAN = re.compile(rf"({_NUMBER}):({_NUMBER})")
_DASHED = re.compile(rf"({_NUMBER})\s*-\s*({_NUMBER})")


def read(paths: Sequence[str], mapping: str | None) -> Log:
    """Return the logs of some files, one after another."""
    from hydrodamp.ingest.read import read_log, read_logs

    once = tuple(dict.fromkeys(paths))
    return read_log(once[0], mapping) if len(once) == 1 else read_logs(once, mapping)


def train_alone(logs: Sequence[str], train: Sequence[str], mapping: str | None) -> Log:
    """Return the log to identify on: all of LOG unless --train says less."""
    if not logs and not train:
        raise ProblemError("there is nothing to identify on: name a LOG.")
    whole = read(logs, mapping) if logs else None
    return whole if whole is not None and not train else part("--train", train, whole, mapping)


def train_and_test(
    logs: Sequence[str], train: Sequence[str], test: Sequence[str], mapping: str | None
) -> tuple[Log, Log, str]:
    """Return the log to identify on, the one to replay, and what both share."""
    for option, values in (("--train", train), ("--test", test)):
        if not values:
            raise ProblemError(
                f"`{option}` is missing: name files, START:END seconds of LOG, or its segments."
            )
    whole = read(logs, mapping) if logs else None
    learn, held_out = (
        part(option, values, whole, mapping)
        for option, values in (("--train", train), ("--test", test))
    )
    shared = _shared_files(train, test) if whole is None else _shared_time(train, test, whole)
    if shared:
        warnings.warn(
            f"training and test data share {shared}: errors on data that were fitted say little.",
            HydrodampWarning,
            stacklevel=2,
        )
    return learn, held_out, shared


def part(option: str, values: Sequence[str], whole: Log | None, mapping: str | None) -> Log:
    """Return what one option names."""
    from hydrodamp.data.log import concatenate

    if whole is None:
        for value in values:
            if not _is_file(value):
                what = "is a span" if _SPAN.fullmatch(value) else "is no file"
                raise ProblemError(
                    f"`{option} {value}` {what}, and there is no LOG to take a span or a segment "
                    "from: name the LOG first, or give files."
                )
        return read(values, mapping)
    pieces = [_piece(option, value, whole) for value in dict.fromkeys(values)]
    return pieces[0] if len(pieces) == 1 else concatenate(pieces)


def _piece(option: str, value: str, whole: Log) -> Log:
    """Return a segment or a span of LOG."""
    if value in {segment.name for segment in whole.segments}:
        return whole.select(value)
    if _is_file(value):
        raise ProblemError(
            f"`{option} {value}` is a file, and LOG is given too: leave LOG out, or name START:END "
            "seconds or segments of it."
        )
    if found := _DASHED.fullmatch(value.strip()):
        raise ProblemError(
            f"`{option} {value}` is no segment of LOG. Did you mean the span {found[1]}:{found[2]}?"
        )
    return whole.between(*span(value)) if ":" in value else whole.select(value)


def span(value: str) -> tuple[float, float]:
    """Return start and end of ``START:END``."""
    found = _SPAN.fullmatch(value.strip())
    if not found or not float(found[1]) < float(found[2]):
        raise ProblemError(
            f"a span must be START:END in seconds from the first sample of LOG, with START before "
            f"END and neither negative, such as 0:900; got '{value}'."
        )
    return float(found[1]), float(found[2])


def _is_file(value: str) -> bool:
    from hydrodamp.ingest.formats.detect import FORMATS

    suffix = Path(value).suffix.lower()
    return Path(value).exists() or any(suffix in form.suffixes for form in FORMATS)


def _shared_files(train: Sequence[str], test: Sequence[str]) -> str:
    learnt = {Path(name).resolve() for name in train}
    return ", ".join(dict.fromkeys(name for name in test if Path(name).resolve() in learnt))


def _shared_time(train: Sequence[str], test: Sequence[str], whole: Log) -> str:
    """Return the spans of LOG that stand in both parts [s from its first sample]."""
    import numpy as np

    names = {segment.name for segment in whole.segments}
    both = np.ones(whole.n, dtype=bool)
    for values in (train, test):
        taken = np.zeros(whole.n, dtype=bool)
        for value in values:
            if value not in names and _SPAN.fullmatch(value.strip()):
                start, end = whole.elapsed.searchsorted(span(value))
                taken[start:end] = True
            else:
                for piece in whole.select(value).segments:
                    (own,) = (each for each in whole.segments if each.name == piece.name)
                    taken[own.start : own.stop] = True
        both &= taken
    edges = np.flatnonzero(np.diff(both, prepend=False, append=False)).reshape(-1, 2)
    return ", ".join(f"{whole.elapsed[a]:.6g}:{whole.elapsed[b - 1]:.6g}" for a, b in edges)
