"""From LOG, --train and --test to the logs to identify and to replay on."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hydrodamp.cli.overlap import overlap
from hydrodamp.errors import HydrodampWarning, ProblemError

if TYPE_CHECKING:
    from hydrodamp.data.log import Log

_NUMBER = r"[0-9]+(?:\.[0-9]*)?(?:[eE][+-]?[0-9]+)?|\.[0-9]+"
_SPAN = re.compile(rf"({_NUMBER}):({_NUMBER})")
_DASHED = re.compile(rf"({_NUMBER})\s*-\s*({_NUMBER})")
_FILES = (".csv", ".txt", ".dat", ".mcap", ".bag", ".bin", ".ulg", ".mat", ".parquet")


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
    chosen = tuple(
        part(option, values, whole, mapping)
        for option, values in (("--train", train), ("--test", test))
    )
    shared = overlap(_spans(train, whole), _spans(test, whole), whole)
    _warn(shared)
    return chosen[0], chosen[1], shared


def train_alone(logs: Sequence[str], train: Sequence[str], mapping: str | None) -> Log:
    """Return the log to identify on: all of LOG unless --train says less."""
    if not logs and not train:
        raise ProblemError("there is nothing to identify on: name a LOG.")
    whole = read(logs, mapping) if logs else None
    if whole is not None and not train:
        return whole
    return part("--train", train, whole, mapping)


def read(paths: Sequence[str], mapping: str | None) -> Log:
    """Return the logs of some files, one after another."""
    from hydrodamp.cli.reading import reading
    from hydrodamp.ingest.read import read_log, read_logs

    once = tuple(dict.fromkeys(paths))
    with reading(once):
        return read_log(paths[0], mapping) if len(paths) == 1 else read_logs(once, mapping)


def part(option: str, values: Sequence[str], whole: Log | None, mapping: str | None) -> Log:
    """Return what one option names."""
    if whole is None:
        for value in values:
            _refuse_part(option, value)
        return read(values, mapping)
    names = {segment.name for segment in whole.segments}
    for value in values:
        if value not in names:
            _refuse_file(option, value)
            _refuse_dash(option, value)
    if not any(":" in value and value not in names for value in values):
        return whole.select(*dict.fromkeys(values))
    from hydrodamp.data.concatenation import concatenate

    pieces = [
        whole.select(value) if value in names or ":" not in value else whole.between(*span(value))
        for value in dict.fromkeys(values)
    ]
    return pieces[0] if len(pieces) == 1 else concatenate(pieces)


def span(value: str) -> tuple[float, float]:
    """Return start and end of ``START:END``."""
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


def _refuse_dash(option: str, value: str) -> None:
    """Refuse a span written with a dash."""
    if found := _DASHED.fullmatch(value.strip()):
        raise ProblemError(
            f"`{option} {value}` is no segment of LOG. Did you mean the span {found[1]}:{found[2]}?"
        )


def _spans(values: Sequence[str], whole: Log | None) -> dict[str, tuple[float, float] | None]:
    """Return what was said, with start and end where it is a span."""
    names = () if whole is None else {segment.name for segment in whole.segments}
    return {
        value: span(value) if value not in names and _SPAN.fullmatch(value) else None
        for value in values
    }


def _warn(shared: str) -> None:
    if shared:
        warnings.warn(
            f"training and test data share {shared}: errors on data that were fitted say little.",
            HydrodampWarning,
            stacklevel=3,
        )
