"""ROS 1 bags and ROS 2 bags (SQLite3, MCAP): rosbags reads messages, `message_layout` fields."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.message_layout import deserialize_columns
from hydrodamp.progress import Step, progress

_MAX_MESSAGE_BYTES = 1 << 16  # bytes; larger messages are images or point clouds
_SKIPPED_TYPES = {
    "sensor_msgs": {"Image", "CompressedImage", "PointCloud", "PointCloud2", "LaserScan"},
    "nav_msgs": {"OccupancyGrid", "Path"},
    "visualization_msgs": {"Marker", "MarkerArray", "ImageMarker", "InteractiveMarkerUpdate"},
    "diagnostic_msgs": {"DiagnosticArray"},
    "rcl_interfaces": {"Log", "ParameterEvent"},
    "rosgraph_msgs": {"Log"},
}
_Messages = dict[tuple[str, str], list[tuple[int, bytes]]]  # (time [ns], bytes) by topic and type

_PROGRESS_STEP = 1000  # messages between updates of the progress bar


def read_file(path: str | Path) -> Recording:
    """Read a ROS bag."""
    from rosbags import highlevel, typesys

    path = Path(path)
    if path.suffix == ".gz":
        raise LogError(
            "a compressed bag cannot be read, since its index holds offsets into the bag. Unpack it"
            " with `gunzip FILE`",
            source=str(path),
        )
    default_types = typesys.get_typestore(typesys.Stores.LATEST)
    mcap = path.suffix == ".mcap" or any(path.glob("*.mcap*"))
    form = "ROS 2 bag (MCAP)" if mcap else "ROS 2 bag (SQLite)"
    form = "ROS 1 bag" if path.suffix == ".bag" else form
    notes: list[str] = []
    with (
        highlevel.AnyReader([path], default_typestore=default_types) as reader,
        progress(f"reading {path.name}", reader.message_count) as step,
    ):
        messages = _read_messages(reader, step, notes)
        definitions = {**default_types.fielddefs, **reader.typestore.fielddefs}
    topics = tuple(_make_topics(messages, definitions, form != "ROS 1 bag", notes))
    if not topics:
        raise LogError(["the bag holds no readable message", *notes], source=str(path))
    return Recording(topics, str(path), form, tuple(notes))


def _read_messages(reader: Any, step: Step, notes: list[str]) -> _Messages:
    """Return all messages; for a damaged bag, those before the damage."""
    messages: _Messages = defaultdict(list)
    connections = []
    for connection in reader.connections:
        package, _, name = connection.msgtype.replace("/msg/", "/").partition("/")
        if name in _SKIPPED_TYPES.get(package, ()):
            notes.append(
                f"topic `{connection.topic}` ({connection.msgtype}) is no measurement; skipped"
            )
        elif connection.msgcount:
            connections.append(connection)
    count, oversized = 0, {}
    try:
        for connection, time, raw in reader.messages(connections) if connections else ():
            count += 1
            if count % _PROGRESS_STEP == 0:
                step(_PROGRESS_STEP)
            if len(raw) > _MAX_MESSAGE_BYTES:
                oversized[connection.topic] = len(raw)
            else:
                messages[connection.topic, connection.msgtype].append((time, bytes(raw)))
    except Exception as error:  # the exceptions of damaged bags are undocumented
        if not count:
            raise
        notes.append(
            f"the bag is damaged after message {count} ({error}); the messages before it were read"
        )
    notes += [
        f"topic `{topic}`: messages of {size} bytes exceed {_MAX_MESSAGE_BYTES}; they were skipped"
        for topic, size in oversized.items()
    ]
    return messages


def _make_topics(
    messages_by_topic: _Messages, definitions: Any, aligned: bool, notes: list[str]
) -> Iterator[Topic]:
    names = [topic for topic, _ in messages_by_topic]
    for (name, kind), stamped in messages_by_topic.items():
        times, messages = zip(*stamped, strict=True)
        try:
            columns = deserialize_columns(messages, kind, definitions, aligned=aligned)
        except KeyError as error:
            notes.append(
                f"topic `{name}` was skipped: the bag lacks the definition of {error.args[0]}"
            )
            continue
        label = name if names.count(name) == 1 else f"{name} ({kind})"
        if truncated := columns.truncated:
            notes.append(
                f"topic `{label}`: {len(truncated)} messages are truncated and were skipped;"
                f" the first is number {truncated[0] + 1}"
            )
        keep = np.ones(len(messages), dtype=bool)
        keep[columns.truncated] = False
        if keep.any():
            yield Topic(
                label,
                np.array(times, dtype=np.float64)[keep] / 1e9,
                {path: column[keep] for path, column in columns.numbers.items()},
                {path: tuple(compress(words, keep)) for path, words in columns.texts.items()},
                dict.fromkeys(columns.time_fields, "s"),
            )
