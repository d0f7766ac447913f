"""Tables in long form, such as exports of InfluxDB: a name and a value a row."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from hydrodamp.data.recording import Dates, Recording, Topic
from hydrodamp.errors import unique_names
from hydrodamp.ingest.formats.content import MAX_COLUMNS

_NAMES = ("_field", "field", "name", "variable", "signal", "parameter", "channel", "tag", "key")
_VALUES = ("_value", "value", "val")
_TIMES = ("_time", "time", "timestamp", "t")
#: Columns of InfluxDB and pandas that hold no data.
_ANNOTATION = re.compile(r"result|table|_start|_stop|column \d+|unnamed: \d+", re.IGNORECASE)


def pivot_long_form(recording: Recording) -> Recording:
    """Return a table in long form with a column a name and a row a time; others unchanged."""
    topic = recording.topics[0]
    by_lower = {key.lower(): key for key in (*topic.fields, *topic.texts)}
    name, value, time = (
        next((by_lower[key] for key in keys if key in by_lower), "")
        for keys in (_NAMES, _VALUES, _TIMES)
    )
    measurements = {
        key
        for key, values in topic.fields.items()
        if not _ANNOTATION.fullmatch(key) and np.isfinite(values).any()
    } - {value, time}
    is_complete = {value, time} <= topic.fields.keys() and name in topic.texts
    if len(recording.topics) > 1 or not is_complete or measurements:
        return recording
    labels = _join_texts(topic, name)
    names = [label for label in dict.fromkeys(labels) if label]
    if not 2 <= len(names) <= MAX_COLUMNS:
        return recording
    stamps, first_rows, rows = np.unique(topic.fields[time], return_index=True, return_inverse=True)
    index = {label: k for k, label in enumerate(["", *names])}
    label_of_row = np.array([index[label] for label in labels])
    fields = {time: stamps}
    for k, column in enumerate(unique_names([time, *names])[1:], start=1):
        selected = label_of_row == k
        fields[column] = np.full(len(stamps), np.nan)
        fields[column][rows[selected]] = topic.fields[value][selected]
    units = {time: topic.units[time]} if time in topic.units else {}
    note = f"a table in long form: `{name}` names the columns of the numbers in `{value}`"
    dates = {
        key: Dates(form.order, None if form.alternative is None else form.alternative[first_rows])
        for key, form in topic.dates.items()
        if key == time
    }
    wide = replace(topic, fields=fields, texts={}, units=units, faults={}, lines=(), dates=dates)
    return replace(recording, topics=(wide,), notes=(*recording.notes, note))


def _join_texts(topic: Topic, name: str) -> list[str]:
    """Return the name of each row, after the other texts that distinguish rows of one name."""
    names = topic.texts[name]
    qualifiers = [
        texts
        for key, texts in topic.texts.items()
        if key != name
        and not _ANNOTATION.fullmatch(key)
        and len({*zip(names, texts, strict=True)}) > len({*names})
    ]
    rows = zip(*qualifiers, names, strict=True)
    return [".".join(filter(None, row)) if row[-1] else "" for row in rows]
