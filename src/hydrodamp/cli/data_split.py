"""From LOG, --train and --test to the logs to identify and to replay on."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import hydrodamp as hd
from hydrodamp.cli.output import note
from hydrodamp.errors import HydrodampWarning, ProblemError

_NUMBER = r"[0-9]+(?:\.[0-9]*)?(?:[eE][+-]?[0-9]+)?|\.[0-9]+"
_ROUNDED = 1.0  # s, by which the ends of a clock may be copied wrongly
_SPAN = re.compile(rf"({_NUMBER}):({_NUMBER})")


def read(paths: Sequence[str], mapping: str | None) -> hd.Log:
    """Return the logs of some files, one after another."""
    once = tuple(dict.fromkeys(paths))
    return hd.read_log(once[0], mapping) if len(once) == 1 else hd.read_logs(once, mapping)


def suspect(log: hd.Log, length: float | None = None, after: hd.Log | None = None) -> None:
    """Say what looks wrong about a log, and was not said of the one before it."""
    said = () if after is None else hd.check_quality(after, length)
    known = {(one.channel, one.problem) for one in said}
    for one in hd.check_quality(log, length):
        # Of commands, the vehicle says what they are.
        is_new = one.where or (one.channel, one.problem) not in known
        if is_new and one.channel not in log.command_names:
            warnings.warn(f"{log.source or 'log'}: {one}", HydrodampWarning, stacklevel=2)


def train_alone(logs: Sequence[str], train: Sequence[str], mapping: str | None) -> hd.Log:
    """Return the log to identify on: all of LOG unless --train says less."""
    if not logs and not train:
        raise ProblemError("there is nothing to identify on: name a LOG.")
    whole = read(logs, mapping) if logs else None
    return whole if whole is not None and not train else part("--train", train, whole, mapping)


def train_and_test(
    logs: Sequence[str], train: Sequence[str], test: Sequence[str], mapping: str | None
) -> tuple[hd.Log, hd.Log, dict[str, str]]:
    """Return the log to identify on, the one to replay, and what both share, for provenance."""
    asked = {"--train": train, "--test": test}
    for option, values in asked.items():
        if not values:
            raise ProblemError(
                f"`{option}` is missing: name files, START:END seconds of LOG, or its segments."
            )
    whole = read(logs, mapping) if logs else None
    learn, held_out = (part(option, values, whole, mapping) for option, values in asked.items())
    shared = _shared_files(train, test) if whole is None else _shared_time(train, test, whole)
    if shared:
        warnings.warn(
            f"training and test data share {shared}: errors on data that were fitted say little.",
            HydrodampWarning,
            stacklevel=2,
        )
    return learn, held_out, {"overlap": shared} if shared else {}


def part(option: str, values: Sequence[str], whole: hd.Log | None, mapping: str | None) -> hd.Log:
    """Return what one option names."""
    if whole is not None:
        return hd.concatenate(_piece(option, value, whole) for value in dict.fromkeys(values))
    for value in values:
        if not _is_file(value):
            raise ProblemError(
                f"`{option} {value}` is no file, and there is no LOG to take a span or a segment "
                "from: name the LOG first, or give files."
            )
    return read(values, mapping)


def _piece(option: str, value: str, whole: hd.Log) -> hd.Log:
    """Return a segment or a span of LOG."""
    is_segment = value in {segment.name for segment in whole.segments}
    if not is_segment and _is_file(value):
        raise ProblemError(
            f"`{option} {value}` is a file, and LOG is given too: leave LOG out, or name START:END "
            "seconds or segments of it."
        )
    if is_segment or ":" not in value:
        return whole.select(value)
    found = _SPAN.fullmatch(value.strip())
    if not found or not float(found[1]) < float(found[2]):
        raise ProblemError(
            "a span must be START:END in seconds from the first sample of LOG, or by its clock, "
            f"with START before END and neither negative, such as 0:900; got '{value}'."
        )
    start, end = float(found[1]), float(found[2])
    shift = _shift(start, end, whole)
    if shift and option:  # once, and not where what both parts share is looked for
        note(
            f"`{option} {value}` is by the clock of the log: {start + shift:.10g}:"
            f"{end + shift:.10g} in seconds from its first sample."
        )
    return whole.between(start + shift, end + shift)


def _shift(start: float, end: float, whole: hd.Log) -> float:
    """Return what turns a span into seconds from the first sample, where it is by the clock."""
    if end <= whole.elapsed[-1] + _ROUNDED:
        return 0.0
    shifts = (whole.elapsed - whole.time).round(3)
    runs = {one: whole.time[shifts == one] for one in dict.fromkeys(shifts.tolist())}
    fit = [
        one
        for one, time in runs.items()
        if time[0] - _ROUNDED <= start and end <= time[-1] + _ROUNDED
    ]
    return float(fit[0]) if len(fit) == 1 else 0.0


def _is_file(value: str) -> bool:
    from hydrodamp.ingest.formats.files import FORMATS

    suffix = Path(value).suffix.lower()
    return Path(value).exists() or any(suffix in form.suffixes for form in FORMATS)


def _shared_files(train: Sequence[str], test: Sequence[str]) -> str:
    learnt = {Path(name).resolve() for name in train}
    return ", ".join(dict.fromkeys(name for name in test if Path(name).resolve() in learnt))


def _shared_time(train: Sequence[str], test: Sequence[str], whole: hd.Log) -> str:
    """Return the spans of LOG that stand in both parts [s from its first sample]."""
    import numpy as np

    place = np.arange(whole.n, dtype=float)
    numbered = replace(whole, commands=place[:, None], command_names=("place",))
    learnt, held_out = (part("", each, numbered, None).commands for each in (train, test))
    both = np.isin(place, learnt) & np.isin(place, held_out)
    edges = np.flatnonzero(np.diff(both, prepend=False, append=False)).reshape(-1, 2)
    return ", ".join(f"{whole.elapsed[a]:.10g}:{whole.elapsed[b - 1]:.10g}" for a, b in edges)
