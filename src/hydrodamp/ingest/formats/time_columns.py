"""Columns of times that need another reading: digits such as `hhmmss`, dates next to times."""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.recording import Dates, Recording, Topic
from hydrodamp.ingest.formats.dates import DAY_SECONDS

_TIME = re.compile(r"time|utc|gmt|clock|stamp|hhmmss|zeit|uhr|hora|heure", re.IGNORECASE)
_ELAPSED = re.compile(r"elapsed|since|boot", re.IGNORECASE)
_UTC = re.compile(r"utc|gmt|hhmmss", re.IGNORECASE)
_DATE = re.compile(r"date|day|datum|ymd|yyyy|fecha", re.IGNORECASE)
_MIN_DATE_SECONDS = 1e8  # s since 1970; less is a time of day
_MILLISECOND_DIGITS = 1e7  # from which digits are `hhmmssmmm`
_DATED_DIGITS = 1e13  # from which digits are `yyyymmddhhmmss`


def read_times(recording: Recording) -> Recording:
    """Return a recording whose times of digits, and times with a date, are in seconds."""
    notes: list[str] = []
    topics = tuple(_add_dates(_read_digits(topic, notes), notes) for topic in recording.topics)
    return (
        replace(recording, topics=topics, notes=(*recording.notes, *notes)) if notes else recording
    )


def _read_digits(topic: Topic, notes: list[str]) -> Topic:
    """Return a topic with its columns of `hhmmss` and `yyyymmdd` in seconds."""
    seconds: dict[str, FloatArray] = {}
    dates = {**topic.dates}
    for name, values in topic.fields.items():
        is_time = _TIME.search(name) is not None and _ELAPSED.search(name) is None
        is_stated = _UTC.search(name) is not None
        times = decode_time_digits(values, is_stated=is_stated) if is_time else None
        days = _decode_date_digits(values) if times is None and _DATE.search(name) else None
        if (decoded := days if times is None else times) is not None:
            seconds[name] = decoded
            digits = "hhmmss" if times is not None else "yyyymmdd"
            if _is_of_day(decoded):
                dates[name] = Dates("", None)
            notes.append(f"column `{name}` holds the digits {digits}; it is read in seconds")
    if not seconds:
        return topic
    units = {**topic.units, **dict.fromkeys(seconds, "s")}
    return replace(topic, fields={**topic.fields, **seconds}, units=units, dates=dates)


def decode_time_digits(values: FloatArray, *, is_stated: bool = False) -> FloatArray | None:
    """Return the seconds of digits such as 101459.9; None if values or steps are no such digits.

    Times in seconds may look the same; only `is_stated`, a date or a carry from 59 to 100 decides.
    """
    known = np.isfinite(values)
    digits = values[known]
    if len(digits) < 2 or digits.min() < 0.0:
        return None
    is_dated = bool(digits.min() > _DATED_DIGITS)
    if not is_dated and digits.max() > _MILLISECOND_DIGITS:
        digits = digits / 1e3
    day, of_day = np.divmod(digits, 1e6)
    # Seconds that are no such digits also pass 60 to 99 of each hundred.
    is_time = (of_day < 240000) & (of_day % 1e4 < 6000) & (of_day % 1e2 < 60)
    if not is_time.all() or (day.max() > 0 and not is_dated):
        return None
    since_midnight = decode_time_of_day(of_day)
    if is_dated:
        if (dates := _decode_date_digits(day)) is None:
            return None
        since_midnight = since_midnight + dates
    else:
        since_midnight = np.unwrap(since_midnight, period=DAY_SECONDS)
    if not (is_stated or is_dated or _has_carry(digits, since_midnight)):
        return None
    seconds = np.full(len(values), np.nan)
    seconds[known] = since_midnight
    return seconds


def decode_time_of_day(digits: FloatArray) -> FloatArray:
    """Return the seconds since midnight of digits hhmmss."""
    return digits // 1e4 * 3600.0 + digits // 1e2 % 1e2 * 60.0 + digits % 1e2


def _has_carry(digits: FloatArray, seconds: FloatArray) -> bool:
    """Return whether digits jump at the end of a minute while their seconds continue."""
    jumps, steps = np.abs(np.diff(digits)), np.diff(seconds)
    in_minute = steps[(steps > 0.0) & (np.diff(seconds // 60.0) == 0.0)]
    limit = 2.0 * np.median(in_minute) if len(in_minute) else 0.0
    return bool(((steps > 0.0) & (steps < limit) & (jumps > limit)).any())


def _decode_date_digits(values: FloatArray) -> FloatArray | None:
    """Return the seconds since 1970 of dates such as 20240531; None if they are no such dates."""
    seconds = np.full(len(values), np.nan)
    try:
        for date in np.unique(values[np.isfinite(values)]).astype(np.int64).tolist():
            if not 1970_00_00 < date < 2100_00_00:
                return None
            day = datetime(date // 10000, date // 100 % 100, date % 100, tzinfo=UTC)
            seconds[values == date] = day.timestamp()
    except ValueError:
        return None
    return seconds if np.isfinite(seconds).any() else None


def _add_dates(topic: Topic, notes: list[str]) -> Topic:
    """Add a column of dates to a column of times of day."""
    in_seconds = {
        name: values
        for name, values in topic.fields.items()
        if topic.units.get(name) == "s" and np.isfinite(values).any()
    }
    dates = [name for name, values in in_seconds.items() if _is_date_column(values)]
    times = [name for name, form in topic.dates.items() if not form.order]
    if len(dates) != 1 or len(times) != 1 or not {*times} <= {*in_seconds}:
        return topic
    date, time = dates[0], times[0]
    notes.append(f"column `{time}` counts from the dates in `{date}`")
    forms = {**topic.dates}
    seconds = _join_dates(in_seconds[date], in_seconds[time])
    if (form := forms.get(date)) is not None:
        swapped = form.alternative
        shifted = None if swapped is None else _join_dates(swapped, in_seconds[time])
        forms[time] = Dates(form.order, shifted)
    return replace(topic, fields={**topic.fields, time: seconds}, dates=forms)


def _join_dates(dates: FloatArray, seconds: FloatArray) -> FloatArray:
    """Return dates plus seconds unwrapped at midnight; a missing date follows the nearest row."""
    rows = np.flatnonzero(np.isfinite(dates) & np.isfinite(seconds))
    if not len(rows):
        return np.full(len(dates), np.nan)
    start = dates[rows] - seconds[rows] // DAY_SECONDS * DAY_SECONDS
    if (dates[rows] == dates[rows[0]]).all():  # the date of the start, also after midnight
        start[:] = start[0]
    nearest = np.rint(np.interp(np.arange(len(dates)), rows, np.arange(len(rows))))
    return seconds + start[nearest.astype(np.int64)]


def _is_date_column(values: FloatArray) -> bool:
    known = values[np.isfinite(values)]
    return bool(known.min() > _MIN_DATE_SECONDS and not (known % DAY_SECONDS).any())


def _is_of_day(values: FloatArray) -> bool:
    return bool(0.0 <= np.nanmin(values) < DAY_SECONDS)
