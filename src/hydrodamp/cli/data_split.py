"""Training and test data from LOG, --train and --test."""

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
CLOCK_TOLERANCE = 1.0  # s; rounding of times copied from output
_SPAN = re.compile(rf"({_NUMBER}):({_NUMBER})")


def read_logs(paths: Sequence[str], mapping: str | None) -> hd.Log:
    """Return the concatenated logs of files."""
    once = tuple(dict.fromkeys(paths))
    return hd.read_log(once[0], mapping) if len(once) == 1 else hd.read_logs(once, mapping)


def warn_quality_issues(
    log: hd.Log, length: float | None = None, reference: hd.Log | None = None
) -> None:
    """Warn of quality issues of a log that a reference log does not have."""
    earlier_issues = () if reference is None else hd.check_quality(reference, length)
    known = {(issue.channel, issue.problem) for issue in earlier_issues}
    for issue in hd.check_quality(log, length):
        # The vehicle check covers commands.
        is_new = issue.where or (issue.channel, issue.problem) not in known
        if is_new and issue.channel not in log.command_names:
            warnings.warn(f"{log.source or 'log'}: {issue}", HydrodampWarning, stacklevel=2)


def training_log(logs: Sequence[str], train: Sequence[str], mapping: str | None) -> hd.Log:
    """Return the training data: LOG, or the data of --train."""
    if not logs and not train:
        raise ProblemError("there are no training data: name a LOG.")
    log = read_logs(logs, mapping) if logs else None
    return log if log is not None and not train else select_data("--train", train, log, mapping)


def train_and_test(
    logs: Sequence[str], train: Sequence[str], test: Sequence[str], mapping: str | None
) -> tuple[hd.Log, hd.Log, dict[str, str]]:
    """Return training data, test data and their overlap, for provenance."""
    data_names = {"--train": train, "--test": test}
    for option, values in data_names.items():
        if not values:
            raise ProblemError(
                f"`{option}` is missing: give files, START:END in seconds of LOG, or its segments."
            )
    log = read_logs(logs, mapping) if logs else None
    train_log, test_log = (
        select_data(option, values, log, mapping) for option, values in data_names.items()
    )
    overlap = _overlap_files(train, test) if log is None else _overlap_time(train, test, log)
    if overlap:
        warnings.warn(
            f"training and test data share {overlap}: errors on training data are optimistic.",
            HydrodampWarning,
            stacklevel=2,
        )
    return train_log, test_log, {"overlap": overlap} if overlap else {}


def select_data(
    option: str, values: Sequence[str], whole: hd.Log | None, mapping: str | None
) -> hd.Log:
    """Return the data that an option names."""
    if whole is not None:
        return hd.concatenate(
            select_segment(option, value, whole) for value in dict.fromkeys(values)
        )
    for value in values:
        if not _is_file(value):
            raise ProblemError(
                f"`{option} {value}` is not a file, and there is no LOG to select it from: name a "
                "LOG, or give files."
            )
    return read_logs(values, mapping)


def select_segment(option: str, value: str, whole: hd.Log) -> hd.Log:
    """Return a segment or a time span of LOG."""
    is_segment = value in {segment.name for segment in whole.segments}
    if not is_segment and _is_file(value):
        raise ProblemError(
            f"`{option} {value}` is a file, but LOG is given too: omit LOG, or give START:END in "
            "seconds or segments of it."
        )
    if is_segment or ":" not in value:
        return whole.select(value)
    match = _SPAN.fullmatch(value.strip())
    if not match or not float(match[1]) < float(match[2]):
        raise ProblemError(
            "a time span must be START:END in seconds from the first sample of LOG, or by its "
            f"clock, with 0 <= START < END, such as 0:900; got '{value}'."
        )
    start, end = float(match[1]), float(match[2])
    shift = _shift(start, end, whole)
    if shift and option:
        note(
            f"`{option} {value}` is by the clock of the log: {start + shift:.10g}:"
            f"{end + shift:.10g} in seconds from its first sample."
        )
    return whole.between(start + shift, end + shift)


def _shift(start: float, end: float, log: hd.Log) -> float:
    """Return the offset of a time span by the clock of the log; 0 if it is in seconds."""
    if end <= log.elapsed[-1] + CLOCK_TOLERANCE:
        return 0.0
    shifts = (log.elapsed - log.time).round(3)
    runs = {shift: log.time[shifts == shift] for shift in dict.fromkeys(shifts.tolist())}
    fit = [
        shift
        for shift, time in runs.items()
        if time[0] - CLOCK_TOLERANCE <= start and end <= time[-1] + CLOCK_TOLERANCE
    ]
    return float(fit[0]) if len(fit) == 1 else 0.0


def _is_file(value: str) -> bool:
    from hydrodamp.ingest.formats.files import FORMATS

    suffix = Path(value).suffix.lower()
    return Path(value).exists() or any(suffix in form.suffixes for form in FORMATS)


def _overlap_files(train: Sequence[str], test: Sequence[str]) -> str:
    train_paths = {Path(name).resolve() for name in train}
    return ", ".join(dict.fromkeys(name for name in test if Path(name).resolve() in train_paths))


def _overlap_time(train: Sequence[str], test: Sequence[str], log: hd.Log) -> str:
    """Return the time spans of LOG in both training and test data [s]."""
    import numpy as np

    index = np.arange(log.n, dtype=float)
    numbered = replace(log, commands=index[:, None], command_names=("index",))
    train_paths, held_out = (
        select_data("", each, numbered, None).commands for each in (train, test)
    )
    both = np.isin(index, train_paths) & np.isin(index, held_out)
    edges = np.flatnonzero(np.diff(both, prepend=False, append=False)).reshape(-1, 2)
    return ", ".join(f"{log.elapsed[a]:.10g}:{log.elapsed[b - 1]:.10g}" for a, b in edges)
