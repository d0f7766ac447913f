"""Tables in long form, such as exports of InfluxDB: a name and a value a row."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hydrodamp.data.recording import Recording

_NAMES = ("_field", "field", "name", "variable", "signal", "parameter", "channel", "tag", "key")
_VALUES = ("_value", "value", "val")
_TIMES = ("_time", "time", "timestamp", "t")


def pivot_long_form(recording: Recording) -> Recording:
    """Return a table in long form with a column a name and a row a time; others unchanged."""
    topic = recording.topics[0]
    by_lower = {key.lower(): key for key in (*topic.fields, *topic.texts)}
    name, value, time = (
        next((by_lower[key] for key in keys if key in by_lower), "")
        for keys in (_NAMES, _VALUES, _TIMES)
    )
    labels = topic.texts.get(name, ())
    names = [label for label in dict.fromkeys(labels) if label]
    if len(recording.topics) > 1 or not {value, time} <= {*topic.fields} or len(names) < 2:
        return recording
    stamps, rows = np.unique(topic.fields[time], return_inverse=True)
    fields = {time: stamps}
    for label in names:
        column = np.full(len(stamps), np.nan)
        selected = np.fromiter((it == label for it in labels), np.bool_, len(labels))
        column[rows[selected]] = topic.fields[value][selected]
        fields[label] = column
    units = {time: topic.units[time]} if time in topic.units else {}
    note = f"a table in long form: `{name}` names the columns of the numbers in `{value}`"
    dates = {key: it for key, it in topic.dates.items() if key == time and it.alternative is None}
    wide = replace(topic, fields=fields, texts={}, units=units, faults={}, lines=(), dates=dates)
    return replace(recording, topics=(wide,), notes=(*recording.notes, note))
