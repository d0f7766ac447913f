"""Columns of times that need another reading: digits such as `hhmmss`, dates next to times."""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.recording import Dates, Recording, Topic

_TIME = re.compile(r"time|utc|gmt|clock|stamp|hhmmss|zeit|uhr|hora|heure", re.IGNORECASE)
_UTC = re.compile(r"utc|gmt|hhmmss", re.IGNORECASE)
_DATE = re.compile(r"date|day|datum|ymd|yyyy|fecha", re.IGNORECASE)
_DAY_SECONDS = 86400.0  # s
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
        is_stated = _UTC.search(name) is not None
        times = decode_time_digits(values, is_stated=is_stated) if _TIME.search(name) else None
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

    Within a minute, times in seconds look the same; only `is_stated` decides.
    """
    known = np.isfinite(values)
    digits = values[known]
    if len(digits) < 2 or digits.min() < 0.0:
        return None
    is_dated = digits.min() > _DATED_DIGITS
    if not is_dated and digits.max() > _MILLISECOND_DIGITS:
        digits = digits / 1e3
    day, of_day = np.divmod(digits, 1e6)
    hour, minute, second = of_day // 1e4, of_day // 1e2 % 1e2, of_day % 1e2
    is_time = bool((hour < 24).all() and (minute < 60).all() and (second < 60).all())
    # Seconds that are no such digits also pass 60 to 99 of each hundred.
    is_other = bool(day.max() > 0) and not is_dated
    n_minutes = np.count_nonzero(np.diff(hour * 60 + minute))
    is_slow = 2 * n_minutes >= len(digits)
    if not is_time or is_other or is_slow or not (is_stated or n_minutes):
        return None
    since_midnight = hour * 3600 + minute * 60 + second
    if is_dated:
        if (dates := _decode_date_digits(day)) is None:
            return None
        since_midnight = since_midnight + dates
    else:
        since_midnight = np.unwrap(since_midnight, period=_DAY_SECONDS)
    seconds = np.full(len(values), np.nan)
    seconds[known] = since_midnight
    return seconds


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
    """Add the first date of a column of dates to a column of times of day."""
    named = {
        name: values
        for name, values in topic.fields.items()
        if topic.units.get(name) == "s" and np.isfinite(values).any()
    }
    dates = [name for name, values in named.items() if _is_date_column(values)]
    times = [name for name, it in topic.dates.items() if not it.order]
    if len(dates) != 1 or len(times) != 1:
        return topic
    date, time = dates[0], times[0]
    notes.append(f"column `{time}` counts from the first date in `{date}`")
    days = {**topic.dates}
    seconds = named[time] + _first(named[date])
    if (order := days.get(date)) is not None:
        shift = None if order.alternative is None else named[time] + _first(order.alternative)
        days[time] = Dates(order.order, shift)
    return replace(topic, fields={**topic.fields, time: seconds}, dates=days)


def _is_date_column(values: FloatArray) -> bool:
    known = values[np.isfinite(values)]
    return bool(known.min() > _MIN_DATE_SECONDS and not (known % _DAY_SECONDS).any())


def _is_of_day(values: FloatArray) -> bool:
    return bool(0.0 <= np.nanmin(values) < _DAY_SECONDS)


def _first(values: FloatArray) -> float:
    return float(values[np.isfinite(values)][0])
