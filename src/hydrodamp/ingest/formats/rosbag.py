"""ROS 1 bags and ROS 2 bags (SQLite and MCAP), opened by rosbags."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
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
    if path.suffix == ".bag":
        form = "ROS 1 bag"
    else:
        mcap = path.suffix == ".mcap" or any(path.glob("*.mcap*"))
        form = "ROS 2 bag (MCAP)" if mcap else "ROS 2 bag (SQLite)"
    bag = _Bag()
    with (
        highlevel.AnyReader([path], default_typestore=fallback) as reader,
        progress(f"reading {path.name}", reader.message_count) as step,
    ):
        bag.read(reader, step)
        definitions = {**fallback.fielddefs, **reader.typestore.fielddefs}
    topics = tuple(bag.topics(definitions, form != "ROS 1 bag"))
    if not topics:
        raise LogError(["the bag holds no message that can be read", *bag.notes], source=str(path))
    return Recording(topics, str(path), form, tuple(bag.notes))


@dataclass
class _Bag:
    """The messages of a bag as they are stored, by topic and type."""

    times: dict[tuple[str, str], list[int]] = field(default_factory=lambda: defaultdict(list))
    messages: dict[tuple[str, str], list[bytes]] = field(default_factory=lambda: defaultdict(list))
    notes: list[str] = field(default_factory=list)

    def read(self, reader: Any, step: Step) -> None:
        """Read all messages; keep what was read where the rest is damaged."""
        wanted = []
        for it in reader.connections:
            package, _, name = it.msgtype.replace("/msg/", "/").partition("/")
            if name in _PASSED_OVER.get(package, ()):
                self.notes.append(f"topic `{it.topic}` ({it.msgtype}) was left out")
                continue
            wanted.append(it)
            if it.msgcount == 0:
                self.notes.append(f"topic `{it.topic}` ({it.msgtype}) holds no message")
        if not wanted:
            return
        count, large = 0, {}
        try:
            for connection, time, raw in reader.messages(connections=wanted):
                count += 1
                if count % _AT_ONCE == 0:
                    step(_AT_ONCE)
                if len(raw) > _LARGEST:
                    large[connection.topic] = len(raw)
                    continue
                key = (connection.topic, connection.msgtype)
                self.times[key].append(time)
                self.messages[key].append(bytes(raw))
        except Exception as error:  # damaged bags fail in ways that nobody has listed
            if not count:
                raise
            self.notes.append(
                f"the bag is damaged after message {count} ({error}); what stands before was read"
            )
        self.notes += [
            f"topic `{topic}`: messages of {size} bytes were left out"
            for topic, size in large.items()
        ]

    def topics(self, definitions: Any, aligned: bool) -> Iterator[Topic]:
        """Yield the topics, with notes on what of them could not be read."""
        names = [topic for topic, _ in self.messages]
        for (name, kind), messages in self.messages.items():
            try:
                columns = columns_of(messages, kind, definitions, aligned=aligned)
            except KeyError as error:
                self.notes.append(
                    f"topic `{name}` was left out: the bag does not define {error.args[0]}"
                )
                continue
            called = name if names.count(name) == 1 else f"{name} ({kind})"
            for path, length in columns.long.items():
                self.notes.append(f"topic `{called}`: `{path}` of {length} values was left out")
            if broken := columns.broken:
                self.notes.append(
                    f"topic `{called}`: {len(broken)} messages end before their fields do and were"
                    f" left out, the first is number {broken[0] + 1}"
                )
            keep = np.ones(len(messages), dtype=bool)
            keep[columns.broken] = False
            if keep.any():
                yield Topic(
                    called,
                    np.array(self.times[name, kind], dtype=np.float64)[keep] / 1e9,
                    {path: column[keep] for path, column in columns.numbers.items()},
                    {
                        path: tuple(word for word, kept in zip(words, keep, strict=True) if kept)
                        for path, words in columns.texts.items()
                    },
                    dict.fromkeys(columns.seconds, "s"),
                )
