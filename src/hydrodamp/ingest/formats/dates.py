"""Dates and times of day in text, and the order of day and month in the files of a call."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
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
    r"\s*(?:(\d{4})[-/.](\d\d?)[-/.](\d\d?)|(\d\d?)[-/.](\d\d?)[-/.](\d{4}))?"
    r"(?:^|[T_, ]+(?!2[5-9]|[3-9]\d)|$)"  # hours above 24 are no time of a date
    r"(?:(\d\d?):([0-5]\d)(?::((?:[0-5]\d|60)(?:[.,]\d*)?))?\s*([ap]m)?)?"
    r"\s*(?:z|utc|gmt)?(?:([+-]\d\d?)(?::?(\d\d))?)?\s*$",
    re.IGNORECASE,
)
_COMPACT = re.compile(r"\s*(\d{4})(\d\d)(\d\d)[T_ ](\d\d)(\d\d)(\d\d)", re.IGNORECASE)
_TWO_DIGIT_YEAR = re.compile(r"(\s*\d\d?([/.])\d\d?\2)(\d\d)(?![\d:])")
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_NAMED_MONTH = re.compile(
    rf"\s*(\d\d?)[- /.]({'|'.join(_MONTHS)})[a-z]*[- /.,]*(\d{{4}}|\d\d)(?![\d:])", re.IGNORECASE
)
DAY_SECONDS = UNITS["time"]["d"]
_ORDERS = ("day first", "month first")
_ISO = "to exclude the other, write dates as year-month-day"


def is_missing(cell: str) -> bool:
    """Return whether a cell marks a missing value."""
    return cell.strip().lower() in MISSING


def is_date(cell: str) -> bool:
    """Return whether a cell holds a date, or a time of day with seconds."""
    match = _match_date(cell)
    return match is not None and (match[1] or match[6] or match[9]) is not None


def _match_date(cell: str) -> re.Match[str] | None:
    cell = _COMPACT.sub(r"\1-\2-\3T\4:\5:\6", cell)
    cell = _TWO_DIGIT_YEAR.sub(r"\g<1>20\3", cell)
    if named := _NAMED_MONTH.match(cell):
        day, month, year = named[1], _MONTHS.index(named[2].lower()) + 1, named[3]
        cell = f"{'20' * (len(year) == 2)}{year}-{month}-{day}{cell[named.end() :]}"
    return _DATE.match(cell)


def parse_dates(cells: Sequence[str]) -> tuple[FloatArray, Dates | None]:
    """Return seconds since 1970, or unwrapped since midnight [s], and the order of day and month.

    Dates that both orders allow are read day first; with `am` or `pm`, month first.
    """
    matches = {cell: _match_date(cell) for cell in dict.fromkeys(cells) if not is_missing(cell)}
    pairs = {(int(match[4]), int(match[5])) for match in matches.values() if match and match[4]}
    if not pairs:
        is_of_day = not any(match is not None and match[1] for match in matches.values())
        return _read_dates(cells, matches, 0), Dates("", None) if is_of_day else None
    possible = [order for order in (0, 1) if all(pair[1 - order] <= 12 for pair in pairs)]
    is_american = any(match is not None and match[10] for match in matches.values())
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
            text = f"{match[1] or match[6]}-{match[month]:0>2}-{match[day]:0>2}"
            days[date] = float(np.datetime64(text, "s").astype(np.float64))
        hour = int(match[7] or 0)
        if match[10]:
            hour = hour % 12 + 12 * (match[10].lower() == "pm")
        zone = 0
        if match[11]:
            zone = int(match[11]) * 3600 + int(match[11][0] + (match[12] or "0")) * 60
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
    columns = [*_list_dates(recordings)]
    sources = {dates.order: source for source, _, dates in columns if dates.alternative is None}
    if all(dates.alternative is None for _, _, dates in columns):
        return [*recordings]
    if len(sources) == 1:
        ((order, source),) = sources.items()
        reason = f"as {source} excludes the other order"
    else:
        spans = {name: _span_of(columns, name) for name in _ORDERS}
        order = next(dates.order for _, _, dates in columns if dates.alternative is not None)
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


def _span_of(columns: Iterable[tuple[str, FloatArray, Dates]], order: str) -> float:
    """Return the span of all dates in one order [s]."""
    choices = (
        seconds if dates.alternative is None or dates.order == order else dates.alternative
        for _, seconds, dates in columns
    )
    limits = [limit(seconds) for seconds, limit in product(choices, (np.nanmin, np.nanmax))]
    return float(max(limits) - min(limits))


def _read_in_order(recording: Recording, order: str, reason: str) -> Recording:
    """Return a recording with its ambiguous dates in one order, and a note on them."""
    topics, names = [], list[str]()
    for topic in recording.topics:
        fields, dates = {**topic.fields}, {**topic.dates}
        for key, form in topic.dates.items():
            if form.alternative is not None:
                names.append(f"`{key}`")
                fields[key] = fields[key] if form.order == order else form.alternative
                del dates[key]
        topics.append(replace(topic, fields=fields, dates=dates))
    if not names:
        return recording
    columns = ", ".join(first_few(names, 4, "columns"))
    note = f"the dates in {columns} are read {order}, {reason}"
    return replace(recording, topics=tuple(topics), notes=(*recording.notes, note))
