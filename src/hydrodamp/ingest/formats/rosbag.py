"""ROS 1 bags and ROS 2 bags (SQLite and MCAP), opened by rosbags."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.advance import counted, shares, within
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import FileError, LogError
from hydrodamp.ingest.formats.extras import extra
from hydrodamp.ingest.formats.message_layout import columns_of

_LARGEST = 1 << 16
_TAKEN = 0.7  # what share of the time it takes to take messages out of the bag
_TOLD = 1000  # after how many messages it is told
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
}


def read(path: str | Path) -> Recording:
    """Read a ROS bag."""
    path = Path(path)
    highlevel = extra("rosbags.highlevel", path)
    if not path.exists():
        raise FileError(f"{path}: cannot be read: No such file or directory")
    types = extra("rosbags.typesys", path)
    fallback = types.get_typestore(types.Stores.LATEST)
    form = _form(path)
    gathered = _Gathered(path)
    try:
        with highlevel.AnyReader([path], default_typestore=fallback) as bag:
            with within(0.0, _TAKEN):
                gathered.read(bag)
            definitions = {**fallback.fielddefs, **bag.typestore.fielddefs}
    except Exception as error:  # a damaged bag fails in ways nobody has listed
        raise LogError(f"{_why(error)}. {_repair(path, error)}", source=str(path)) from error
    with within(_TAKEN, 1.0):
        topics = list(gathered.topics(definitions, form != "ROS 1 bag"))
    if not topics:
        raise LogError(
            ["the bag holds no message that can be read", *gathered.notes], source=str(path)
        )
    return Recording(tuple(topics), str(path), form, tuple(gathered.notes))


@dataclass
class _Gathered:
    """The messages of a bag as they are stored, by topic and type."""

    path: Path
    times: dict[tuple[str, str], list[int]] = field(default_factory=lambda: defaultdict(list))
    messages: dict[tuple[str, str], list[bytes]] = field(default_factory=lambda: defaultdict(list))
    large: dict[str, int] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def read(self, bag: Any) -> None:
        """Read all messages; keep what was read where the rest is damaged."""
        wanted = [it for it in bag.connections if not _is_passed_over(it.msgtype)]
        self._note_passed_over(bag.connections, wanted)
        if not wanted:
            return
        count = 0
        try:
            messages = bag.messages(connections=wanted)
            total = sum(it.msgcount for it in wanted)
            for connection, time, raw in counted(messages, total, _TOLD):
                count += 1
                if len(raw) > _LARGEST:
                    self.large[connection.topic] = len(raw)
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
            for topic, size in self.large.items()
        ]

    def _note_passed_over(self, connections: Any, wanted: Any) -> None:
        for it in connections:
            if it not in wanted:
                self.notes.append(f"topic `{it.topic}` ({it.msgtype}) was left out")
            elif it.msgcount == 0:
                self.notes.append(f"topic `{it.topic}` ({it.msgtype}) holds no message")

    def topics(self, definitions: Any, aligned: bool) -> Iterator[Topic]:
        """Yield the topics, with notes on what of them could not be read."""
        names = [topic for topic, _ in self.messages]
        parts = shares([*map(len, self.messages.values())])
        for ((name, kind), messages), share in zip(self.messages.items(), parts, strict=True):
            try:
                with within(*share):
                    columns = columns_of(messages, kind, definitions, aligned=aligned)
            except KeyError as error:
                self.notes.append(
                    f"topic `{name}` was left out: the bag does not define {error.args[0]}"
                )
                continue
            called = name if names.count(name) == 1 else f"{name} ({kind})"
            keep = np.ones(len(messages), dtype=bool)
            keep[columns.broken] = False
            self._note_fields(called, columns)
            if not keep.any():
                continue
            time = np.array(self.times[name, kind], dtype=np.float64)[keep] / 1e9
            yield Topic(
                called,
                time,
                {path: column[keep] for path, column in columns.numbers.items()},
                {
                    path: tuple(word for word, kept in zip(words, keep, strict=True) if kept)
                    for path, words in columns.texts.items()
                },
                dict.fromkeys(columns.seconds, "s"),
            )

    def _note_fields(self, name: str, columns: Any) -> None:
        for path, length in columns.long.items():
            self.notes.append(f"topic `{name}`: `{path}` of {length} values was left out")
        if count := len(columns.broken):
            self.notes.append(
                f"topic `{name}`: {count} messages end before their fields do and were left out,"
                f" the first is number {columns.broken[0] + 1}"
            )


def _is_passed_over(kind: str) -> bool:
    package, _, name = kind.replace("/msg/", "/").partition("/")
    return name in _PASSED_OVER.get(package, ())


def _form(path: Path) -> str:
    if path.suffix == ".bag":
        return "ROS 1 bag"
    if path.suffix == ".mcap" or (path.is_dir() and any(path.glob("*.mcap*"))):
        return "ROS 2 bag (MCAP)"
    return "ROS 2 bag (SQLite)"


def _why(error: Exception) -> str:
    told = str(error).strip().split("\n")[0].rstrip(".") or type(error).__name__
    return f"it cannot be read as a ROS bag: {told}"


def _repair(path: Path, error: Exception) -> str:
    if path.is_dir() and ("metadata" in str(error) or "missing" in str(error)):
        return "Write its metadata.yaml anew with `ros2 bag reindex FOLDER`"
    inside = [path, *path.glob("*")] if path.is_dir() else [path]
    cures = [_REPAIR[file.suffix] for file in inside if file.suffix in _REPAIR]
    return cures[0] if cures else "The name of a bag must end in .bag, .mcap or .db3"
