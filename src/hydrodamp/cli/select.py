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
_FILES = (".csv", ".txt", ".dat", ".mcap", ".bag", ".bin", ".ulg", ".mat", ".parquet")


def train_and_test(
    logs: Sequence[str], train: Sequence[str], test: Sequence[str], mapping: str | None
) -> tuple[Log, Log]:
    """Return the log to identify on and the one to replay.

    Parameters
    ----------
    logs : sequence of str
        Files; empty where ``train`` and ``test`` are files.
    train, test : sequence of str
        Files, or ``START:END`` seconds or segment names of the logs.
    mapping : str or None
        A mapping file.

    Returns
    -------
    train, test : Log
        Both with the segments they consist of.

    Raises
    ------
    ProblemError
        If the two are not said, or said in a way that cannot be.
    LogError
        If a log has faults, or lacks such a span or segment.
    """
    for option, values in (("--train", train), ("--test", test)):
        if not values:
            raise ProblemError(
                f"`{option}` is missing: name files, START:END seconds of LOG, or its segments."
            )
    whole = read(logs, mapping) if logs else None
    chosen = tuple(
        part(option, values, whole, mapping)
        for option, values in (("--train", train), ("--test", test))
    )
    _warn_if_shared(train, test)
    return chosen[0], chosen[1]


def train_alone(logs: Sequence[str], train: Sequence[str], mapping: str | None) -> Log:
    """Return the log to identify on: all of LOG unless --train says less.

    Parameters
    ----------
    logs : sequence of str
        Files; empty where ``train`` are files.
    train : sequence of str
        As in :func:`train_and_test`; empty for all.
    mapping : str or None
        A mapping file.

    Returns
    -------
    log : Log
        With the segments it consists of.

    Raises
    ------
    ProblemError
        If neither is said, or said in a way that cannot be.
    LogError
        If a log has faults, or lacks such a span or segment.
    """
    if not logs and not train:
        raise ProblemError("there is nothing to identify on: name a LOG.")
    whole = read(logs, mapping) if logs else None
    if whole is not None and not train:
        return whole
    return part("--train", train, whole, mapping)


def read(paths: Sequence[str], mapping: str | None) -> Log:
    """Return the logs of some files, one after another.

    Parameters
    ----------
    paths : sequence of str
        Files.
    mapping : str or None
        A mapping file.

    Returns
    -------
    log : Log
        Each file in segments of its own.

    Raises
    ------
    LogError
        If a file has faults.
    FileError
        If a file cannot be read.
    """
    from hydrodamp.cli.progress import progress
    from hydrodamp.data.read import read_log, read_logs

    with progress(f"reading {', '.join(Path(path).name for path in paths[:3])}"):
        if len(paths) == 1:
            return read_log(paths[0], mapping)
        return read_logs(tuple(dict.fromkeys(paths)), mapping)


def part(option: str, values: Sequence[str], whole: Log | None, mapping: str | None) -> Log:
    """Return what one option names.

    Parameters
    ----------
    option : str
        How messages call it.
    values : sequence of str
        Files, spans or segment names.
    whole : Log or None
        LOG, where it was given.
    mapping : str or None
        A mapping file.

    Returns
    -------
    log : Log
        The files, or the parts of LOG.

    Raises
    ------
    ProblemError
        If files stand beside LOG, or spans or names without it.
    LogError
        If LOG lacks such a span or segment.
    """
    if whole is None:
        for value in values:
            _refuse_part(option, value)
        return read(values, mapping)
    names = {segment.name for segment in whole.segments}
    for value in values:
        if value not in names:
            _refuse_file(option, value)
    if not any(":" in value and value not in names for value in values):
        return whole.select(*dict.fromkeys(values))
    from hydrodamp.data.log import concatenate

    pieces = [
        whole.select(value) if value in names or ":" not in value else whole.between(*span(value))
        for value in dict.fromkeys(values)
    ]
    return pieces[0] if len(pieces) == 1 else concatenate(pieces)


def span(value: str) -> tuple[float, float]:
    """Return start and end of ``START:END``.

    Parameters
    ----------
    value : str
        Two numbers of seconds, neither negative, the second the larger.

    Returns
    -------
    start, end : float
        From the first sample of LOG [s].

    Raises
    ------
    ProblemError
        If it is anything else.

    Examples
    --------
    >>> span("0:900")
    (0.0, 900.0)
    """
    found = _SPAN.fullmatch(value.strip())
    if not found or not float(found[1]) < float(found[2]):
        raise ProblemError(
            f"a span must be START:END in seconds from the first sample of LOG, with START before "
            f"END and neither negative, such as 0:900; got '{value}'."
        )
    return float(found[1]), float(found[2])


def _refuse_part(option: str, value: str) -> None:
    """Refuse a span or a segment name where there is no LOG to take it from."""
    if Path(value).exists() or Path(value).suffix.lower() in _FILES:
        return
    what = "is a span" if _SPAN.fullmatch(value) else "is no file"
    raise ProblemError(
        f"`{option} {value}` {what}, and there is no LOG to take a span or a segment from: name "
        "the LOG first, or give files."
    )


def _refuse_file(option: str, value: str) -> None:
    """Refuse a file beside LOG."""
    if Path(value).is_file() or Path(value).suffix.lower() in _FILES:
        raise ProblemError(
            f"`{option} {value}` is a file, and LOG is given too: leave LOG out, or name START:END "
            "seconds or segments of it."
        )


def _warn_if_shared(train: Sequence[str], test: Sequence[str]) -> None:
    shared = [value for value in test if value in train]
    spans = [[span(v) for v in values if _SPAN.fullmatch(v)] for values in (train, test)]
    shared += [
        f"{max(a, c):g}:{min(b, d):g}"
        for a, b in spans[0]
        for c, d in spans[1]
        if (a, b) != (c, d) and max(a, c) < min(b, d)
    ]
    if shared:
        warnings.warn(
            f"training and test data share {', '.join(dict.fromkeys(shared))}: errors on data that "
            "were fitted say little.",
            HydrodampWarning,
            stacklevel=2,
        )
