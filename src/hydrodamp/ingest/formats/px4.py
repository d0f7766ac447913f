"""PX4 ULog files, read by pyulog after a scan of the message headers for damage."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.ardupilot import NO_MESSAGE
from hydrodamp.ingest.formats.content import as_numbers, read_bytes

_ELEMENT = re.compile(r"(.*)\[(\d+)\]$")
_MAX_ARRAY_LENGTH = 64  # values; longer arrays are no samples of one instant
_HEADER_BYTES = 16
_MESSAGE_TYPES, _SUBSCRIPTION = b"FIMPQARSODLCB", ord("A")


def read_file(path: str | Path) -> Recording:
    """Read a ULog."""
    import pyulog

    data = read_bytes(path)
    end, has_subscription = _scan_messages(data)
    if end < len(data) and not has_subscription:  # pyulog may search for the next message forever
        raise LogError(
            f"the log is truncated or damaged at byte {end}, in the definitions section."
            " Download it from the vehicle again",
            source=str(path),
        )
    # pyulog prints its warnings to standard output, which belongs to the caller.
    with redirect_stdout(io.StringIO()):
        log = pyulog.ULog(io.BytesIO(data))
    notes: list[str] = []
    topics = tuple(_make_topics(log, notes))
    if end < len(data):
        notes.append(
            f"the log is truncated or damaged at byte {end} of {len(data)}; after it, only complete"
            " messages were read"
        )
    elif log.file_corruption:
        notes.append("the log is damaged; pyulog skipped the damaged bytes")
    if log.dropouts:
        lost_seconds = sum(dropout.duration for dropout in log.dropouts) / 1e3
        first = (log.dropouts[0].timestamp - log.start_timestamp) * 1e-6
        notes.append(
            f"the logger dropped messages {len(log.dropouts)} times, {lost_seconds:.3g} s in all,"
            f" first {first:.4g} s after the start"
        )
    if not topics:
        raise LogError([NO_MESSAGE, *notes], source=str(path))
    return Recording(topics, str(path), "PX4 ULog", tuple(notes))


def _make_topics(log: Any, notes: list[str]) -> Iterator[Topic]:
    for dataset in sorted(log.data_list, key=lambda dataset: (dataset.name, dataset.multi_id)):
        name = dataset.name if dataset.multi_id == 0 else f"{dataset.name}[{dataset.multi_id}]"
        elements = [*filter(None, map(_ELEMENT.match, dataset.data))]
        long = {match[1] for match in elements if int(match[2]) >= _MAX_ARRAY_LENGTH}
        notes += [
            f"topic `{name}`: array `{field}` has more than {_MAX_ARRAY_LENGTH} values; skipped"
            for field in long
        ]
        fields = {
            field: as_numbers(values)
            for field, values in dataset.data.items()
            if field.rpartition("[")[0] not in long
        }
        if len(fields.get("timestamp", ())):
            yield Topic(name, fields["timestamp"] / 1e6, fields)


def _scan_messages(data: bytes) -> tuple[int, bool]:
    """Return the offset of the first invalid message, and whether a subscription precedes it."""
    offset, end, has_subscription = _HEADER_BYTES, len(data), False
    while offset + 3 <= end and data[offset + 2] in _MESSAGE_TYPES:
        following = offset + 3 + data[offset] + (data[offset + 1] << 8)
        if following > end:
            break
        has_subscription = has_subscription or data[offset + 2] == _SUBSCRIPTION
        offset = following
    return offset, has_subscription
