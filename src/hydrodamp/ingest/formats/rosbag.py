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

_LARGEST = 1 << 16  # bytes of a message
_PASSED_OVER = {
    "sensor_msgs": {"Image", "CompressedImage", "PointCloud", "PointCloud2", "LaserScan"},
    "nav_msgs": {"OccupancyGrid", "Path"},
    "visualization_msgs": {"Marker", "MarkerArray", "ImageMarker", "InteractiveMarkerUpdate"},
    "diagnostic_msgs": {"DiagnosticArray"},
    "rcl_interfaces": {"Log", "ParameterEvent"},
    "rosgraph_msgs": {"Log"},
}
_REPAIR = {
    ".bag": "Repair it with `rosbag reindex FILE`, then read it again",
    ".mcap": "Repair it with `mcap recover FILE -o WHOLE.mcap`, then read that",
    ".db3": "Repair it with `sqlite3 FILE .recover | sqlite3 WHOLE.db3`, or run"
    " `ros2 bag reindex` on its folder",
    ".gz": "Unpack it with `gunzip FILE`: a bag is read at places that its index names",
}


def read(path: str | Path) -> Recording:
    """Read a ROS bag."""
    from rosbags import highlevel, typesys

    path = Path(path)
    fallback = typesys.get_typestore(typesys.Stores.LATEST)
    if path.suffix == ".bag":
        form = "ROS 1 bag"
    else:
        mcap = path.suffix == ".mcap" or any(path.glob("*.mcap*"))
        form = "ROS 2 bag (MCAP)" if mcap else "ROS 2 bag (SQLite)"
    bag = _Bag(path)
    try:
        with highlevel.AnyReader([path], default_typestore=fallback) as reader:
            bag.read(reader)
            definitions = {**fallback.fielddefs, **reader.typestore.fielddefs}
    except Exception as error:  # a damaged bag fails in ways nobody has listed
        raise LogError(f"{_why(error)}. {_repair(path, error)}", source=str(path)) from error
    topics = tuple(bag.topics(definitions, form != "ROS 1 bag"))
    if not topics:
        raise LogError(["the bag holds no message that can be read", *bag.notes], source=str(path))
    return Recording(topics, str(path), form, tuple(bag.notes))


@dataclass
class _Bag:
    """The messages of a bag as they are stored, by topic and type."""

    path: Path
    times: dict[tuple[str, str], list[int]] = field(default_factory=lambda: defaultdict(list))
    messages: dict[tuple[str, str], list[bytes]] = field(default_factory=lambda: defaultdict(list))
    notes: list[str] = field(default_factory=list)

    def read(self, reader: Any) -> None:
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
                if len(raw) > _LARGEST:
                    large[connection.topic] = len(raw)
                    continue
                key = (connection.topic, connection.msgtype)
                self.times[key].append(time)
                self.messages[key].append(bytes(raw))
        except Exception as error:  # as above
            if not count:
                raise
            self.notes.append(
                f"the bag is damaged after message {count} ({_why(error)}); what stands before"
                f" was read. {_repair(self.path, error)}"
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


def _why(error: Exception) -> str:
    told = str(error).strip().split("\n")[0].rstrip(".") or type(error).__name__
    return f"it cannot be read as a ROS bag: {told}"


def _repair(path: Path, error: Exception) -> str:
    if path.is_dir() and ("metadata" in str(error) or "missing" in str(error)):
        return "Write its metadata.yaml anew with `ros2 bag reindex FOLDER`"
    inside = [path, *path.glob("*")] if path.is_dir() else [path]
    cures = [_REPAIR[file.suffix] for file in inside if file.suffix in _REPAIR]
    return cures[0] if cures else "The name of a bag must end in .bag, .mcap or .db3"
