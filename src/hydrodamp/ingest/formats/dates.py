"""Dates and times of day in text, and the order of day and month in the files of a call."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from itertools import product

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.channels import UNITS
from hydrodamp.data.recording import Dates, Recording
from hydrodamp.errors import first_few

#: Cells without a value, in lower case.
MISSING = frozenset(
    {"", "nan", "-nan", "na", "n/a", "#n/a", "null", "none", "nat", "-", "--", "---"}
    | {"1.#qnan", "-1.#ind"}
)

_DATE = re.compile(
    r"\s*(?:(\d{4})[-/.](\d\d?)[-/.](\d\d?)|(\d\d?)[-/.](\d\d?)[-/.](\d{4}))?(?:^|[T, ]+|$)"
    r"(?:(\d\d?):(\d\d)(?::(\d\d(?:[.,]\d*)?))?\s*([ap]m)?)?\s*(?:z|utc|([+-]\d\d):?(\d\d))?\s*$",
    re.IGNORECASE,
)
DAY_SECONDS = UNITS["time"]["d"]
_ORDERS = ("day first", "month first")
_ISO = "to exclude the other, write dates as year-month-day"


def is_missing(cell: str) -> bool:
    """Return whether a cell marks a missing value."""
    return cell.strip().lower() in MISSING


def is_date(cell: str) -> bool:
    """Return whether a cell holds a date, or a time of day with seconds."""
    match = _DATE.match(cell)
    return match is not None and (match[1] or match[6] or match[9]) is not None


def parse_dates(cells: Sequence[str]) -> tuple[FloatArray, Dates | None]:
    """Return seconds since 1970, or unwrapped since midnight [s], and the order of day and month.

    Dates that both orders allow are read day first; with `am` or `pm`, month first.
    """
    matches = {cell: _DATE.match(cell) for cell in dict.fromkeys(cells) if not is_missing(cell)}
    pairs = {(int(it[4]), int(it[5])) for it in matches.values() if it and it[4]}
    if not pairs:
        is_of_day = not any(it is not None and it[1] for it in matches.values())
        return _read_dates(cells, matches, 0), Dates("", None) if is_of_day else None
    possible = [order for order in (0, 1) if all(pair[1 - order] <= 12 for pair in pairs)]
    is_american = any(it is not None and it[10] for it in matches.values())
    order = int(is_american) if len(possible) == 2 else (possible or [0])[0]
    alternative = None
    if len(possible) == 2 and any(first != second for first, second in pairs):
        alternative = _read_dates(cells, matches, 1 - order)
    seconds = _read_dates(cells, matches, order)
    is_open = alternative is not None or len(possible) == 1
    return seconds, Dates(_ORDERS[order], alternative) if is_open else None


def _read_dates(
    cells: Sequence[str], matches: dict[str, re.Match[str] | None], order: int
) -> FloatArray:
    """Return the seconds of cells with the day (0) or the month (1) first."""
    days: dict[tuple[str | None, ...], float] = {(None,) * 6: 0.0}
    seconds = np.full(len(cells), np.nan)
    for row, cell in enumerate(cells):
        if (match := matches.get(cell)) is None:
            continue
        if (date := match.groups()[:6]) not in days:
            day, month = (3, 2) if match[1] else (4 + order, 5 - order)
            year_month_day = (int(match[1] or match[6]), int(match[month]), int(match[day]))
            days[date] = datetime(*year_month_day, tzinfo=UTC).timestamp()
        hour = int(match[7] or 0)
        if match[10]:
            hour = hour % 12 + 12 * (match[10].lower() == "pm")
        zone = (int(match[11]) * 60 + int(match[11][0] + match[12])) * 60 if match[11] else 0
        second_of_minute = float((match[9] or "0").replace(",", "."))
        seconds[row] = days[date] + hour * 3600 + int(match[8] or 0) * 60 + second_of_minute - zone
    known = ~np.isnan(seconds)
    if seconds[known].max(initial=0.0) <= DAY_SECONDS:
        seconds[known] = np.unwrap(seconds[known], period=DAY_SECONDS)
    return seconds


def settle_dates(recordings: Sequence[Recording]) -> list[Recording]:
    """Read ambiguous dates of all recordings in one order of day and month, with a note.

    A recording that excludes the other order decides; else the smallest span of all dates.
    """
    listed = [*_list_dates(recordings)]
    settled = {dates.order: source for source, _, dates in listed if dates.alternative is None}
    if all(dates.alternative is None for _, _, dates in listed):
        return [*recordings]
    if len(settled) == 1:
        ((order, source),) = settled.items()
        reason = f"as {source} excludes the other order"
    else:
        spans = {name: _span_of(listed, name) for name in _ORDERS}
        order = next(dates.order for _, _, dates in listed if dates.alternative is not None)
        order = min((order, *_ORDERS), key=lambda name: spans[name])
        is_nearest = len({*spans.values()}) > 1
        reason = "which gives the shortest span" if is_nearest else f"as both orders fit; {_ISO}"
    return [_read_in_order(recording, order, reason) for recording in recordings]


def _list_dates(recordings: Iterable[Recording]) -> Iterator[tuple[str, FloatArray, Dates]]:
    """Yield source, seconds and order of all columns of dates whose order matters."""
    for recording in recordings:
        for topic in recording.topics:
            for name, dates in topic.dates.items():
                if dates.order:
                    yield recording.source, topic.fields[name], dates


def _span_of(listed: Iterable[tuple[str, FloatArray, Dates]], order: str) -> float:
    """Return the span of all dates in one order [s]."""
    read = (
        seconds if dates.alternative is None or dates.order == order else dates.alternative
        for _, seconds, dates in listed
    )
    limits = [limit(seconds) for seconds, limit in product(read, (np.nanmin, np.nanmax))]
    return float(max(limits) - min(limits))


def _read_in_order(recording: Recording, order: str, reason: str) -> Recording:
    """Return a recording with its ambiguous dates in one order, and a note on them."""
    topics, names = [], list[str]()
    for topic in recording.topics:
        ambiguous = {key: it for key, it in topic.dates.items() if it.alternative is not None}
        names += [f"`{key}`" for key in ambiguous]
        moved = {key: it.alternative for key, it in ambiguous.items() if it.order != order}
        fields = {**topic.fields, **{key: it for key, it in moved.items() if it is not None}}
        dates = {key: it for key, it in topic.dates.items() if key not in ambiguous}
        topics.append(replace(topic, fields=fields, dates=dates))
    if not names:
        return recording
    listed = ", ".join(first_few(names, 4, "columns"))
    note = f"the dates in {listed} are read {order}, {reason}"
    return replace(recording, topics=tuple(topics), notes=(*recording.notes, note))
