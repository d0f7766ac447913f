"""PX4's ULog, read by pyulog."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.content import content

_ELEMENT = re.compile(r"(.*)\[(\d+)\]$")
_LONGEST = 64  # values of an array
_HEADER = 16
_KINDS, _ANNOUNCES = b"FIMPQARSODLCB", ord("A")


def read(path: str | Path) -> Recording:
    """Read a ULog."""
    import pyulog

    data = content(path)
    end, is_announced = _breaks_off(data)
    if end < len(data) and not is_announced:  # pyulog may look for the next message for ever
        raise LogError(
            f"the log is cut off or damaged at byte {end}, among the definitions of its messages."
            " Download it from the vehicle again",
            source=str(path),
        )
    # pyulog prints what it stumbles on; standard output is not ours to write to.
    with redirect_stdout(io.StringIO()):
        log = pyulog.ULog(io.BytesIO(data))
    notes: list[str] = []
    topics = tuple(_topics(log, notes))
    if end < len(data):
        notes.append(
            f"the log breaks off or is damaged at byte {end} of {len(data)}; of what follows only"
            " whole messages that could be found again were read"
        )
    elif log.file_corruption:
        notes.append("the log is damaged in places, which pyulog passed over")
    if log.dropouts:
        lost = sum(dropout.duration for dropout in log.dropouts) / 1e3
        first = (log.dropouts[0].timestamp - log.start_timestamp) * 1e-6
        notes.append(
            f"the logger dropped messages {len(log.dropouts)} times, {lost:.3g} s in all, first"
            f" {first:.4g} s after the start"
        )
    if not topics:
        raise LogError(["the log holds no message with a value", *notes], source=str(path))
    return Recording(topics, str(path), "PX4 ULog", tuple(notes))


def _topics(log: Any, notes: list[str]) -> Iterator[Topic]:
    for dataset in sorted(log.data_list, key=lambda it: (it.name, it.multi_id)):
        name = dataset.name if dataset.multi_id == 0 else f"{dataset.name}[{dataset.multi_id}]"
        elements = [*filter(None, map(_ELEMENT.match, dataset.data))]
        long = {found[1] for found in elements if int(found[2]) >= _LONGEST}
        notes += [f"topic `{name}`: the long array `{field}` was left out" for field in long]
        fields = {
            field: np.asarray(values, dtype=np.float64)
            for field, values in dataset.data.items()
            if field.rpartition("[")[0] not in long
        }
        if len(fields.get("timestamp", ())):
            yield Topic(name, fields["timestamp"] / 1e6, fields)


def _breaks_off(data: bytes) -> tuple[int, bool]:
    """Return where the chain of messages ends, and whether one before announces data."""
    place, end, is_announced = _HEADER, len(data), False
    while place + 3 <= end:
        following = place + 3 + data[place] + (data[place + 1] << 8)
        if data[place + 2] not in _KINDS or following > end:
            break
        is_announced = is_announced or data[place + 2] == _ANNOUNCES
        place = following
    return place, is_announced
