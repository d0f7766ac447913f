"""ROS 1 bags and ROS 2 bags (SQLite and MCAP), opened by rosbags."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.message_layout import columns_of
from hydrodamp.progress import Step, progress

_LARGEST = 1 << 16  # bytes of a message
_PASSED_OVER = {
    "sensor_msgs": {"Image", "CompressedImage", "PointCloud", "PointCloud2", "LaserScan"},
    "nav_msgs": {"OccupancyGrid", "Path"},
    "visualization_msgs": {"Marker", "MarkerArray", "ImageMarker", "InteractiveMarkerUpdate"},
    "diagnostic_msgs": {"DiagnosticArray"},
    "rcl_interfaces": {"Log", "ParameterEvent"},
    "rosgraph_msgs": {"Log"},
}
_Stored = dict[tuple[str, str], list[tuple[int, bytes]]]  # times and messages by topic and type

_AT_ONCE = 1000  # messages between two moves of the bar


def read(path: str | Path) -> Recording:
    """Read a ROS bag."""
    from rosbags import highlevel, typesys

    path = Path(path)
    if path.suffix == ".gz":
        raise LogError(
            "a bag is read at the places that its index names. Unpack it with `gunzip FILE`",
            source=str(path),
        )
    fallback = typesys.get_typestore(typesys.Stores.LATEST)
    mcap = path.suffix == ".mcap" or any(path.glob("*.mcap*"))
    form = "ROS 2 bag (MCAP)" if mcap else "ROS 2 bag (SQLite)"
    form = "ROS 1 bag" if path.suffix == ".bag" else form
    notes: list[str] = []
    with (
        highlevel.AnyReader([path], default_typestore=fallback) as reader,
        progress(f"reading {path.name}", reader.message_count) as step,
    ):
        stored = _stored(reader, step, notes)
        definitions = {**fallback.fielddefs, **reader.typestore.fielddefs}
    topics = tuple(_topics(stored, definitions, form != "ROS 1 bag", notes))
    if not topics:
        raise LogError(["the bag holds no message that can be read", *notes], source=str(path))
    return Recording(topics, str(path), form, tuple(notes))


def _stored(reader: Any, step: Step, notes: list[str]) -> _Stored:
    """Return all messages; those before it where a part is damaged."""
    stored: _Stored = defaultdict(list)
    wanted = []
    for it in reader.connections:
        package, _, name = it.msgtype.replace("/msg/", "/").partition("/")
        if name in _PASSED_OVER.get(package, ()):
            notes.append(f"topic `{it.topic}` ({it.msgtype}) was left out")
        elif it.msgcount:
            wanted.append(it)
    count, large = 0, {}
    try:
        for connection, time, raw in reader.messages(wanted) if wanted else ():
            count += 1
            if count % _AT_ONCE == 0:
                step(_AT_ONCE)
            if len(raw) > _LARGEST:
                large[connection.topic] = len(raw)
            else:
                stored[connection.topic, connection.msgtype].append((time, bytes(raw)))
    except Exception as error:  # damaged bags fail in ways that nobody has listed
        if not count:
            raise
        notes.append(
            f"the bag is damaged after message {count} ({error}); what stands before was read"
        )
    notes += [f"topic `{it}`: messages of {size} bytes were left out" for it, size in large.items()]
    return stored


def _topics(stored: _Stored, definitions: Any, aligned: bool, notes: list[str]) -> Iterator[Topic]:
    names = [topic for topic, _ in stored]
    for (name, kind), found in stored.items():
        times, messages = zip(*found, strict=True)
        try:
            columns = columns_of(messages, kind, definitions, aligned=aligned)
        except KeyError as error:
            notes.append(f"topic `{name}` was left out: the bag does not define {error.args[0]}")
            continue
        called = name if names.count(name) == 1 else f"{name} ({kind})"
        if broken := columns.broken:
            notes.append(
                f"topic `{called}`: {len(broken)} messages end before their fields do and were"
                f" left out, the first is number {broken[0] + 1}"
            )
        keep = np.ones(len(messages), dtype=bool)
        keep[columns.broken] = False
        if keep.any():
            yield Topic(
                called,
                np.array(times, dtype=np.float64)[keep] / 1e9,
                {path: column[keep] for path, column in columns.numbers.items()},
                {path: tuple(compress(words, keep)) for path, words in columns.texts.items()},
                dict.fromkeys(columns.seconds, "s"),
            )
