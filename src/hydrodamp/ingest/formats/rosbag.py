"""ROS 1 bags and ROS 2 bags (SQLite3, MCAP), read by rosbags, and the CDR layout of their messages.

The layout gives the byte offsets of all fields, so that NumPy decodes many messages at once.
Messages of one type with equal string and sequence lengths have equal offsets. The first message of
each such group is parsed field by field; the others are views into one block of bytes. ROS 1
serialization is the same without alignment and encapsulation header.
"""

from __future__ import annotations

import struct
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.cut_bags import repaired_copies
from hydrodamp.progress import Step, progress

#: Longer arrays are no samples of one instant; they are skipped.
MAX_ARRAY_LENGTH = 64

_NUMPY_TYPES = {
    "bool": "?",
    "float32": "f4",
    "float64": "f8",
    **dict.fromkeys(("byte", "char", "octet"), "u1"),
    **{f"int{8 * size}": f"i{size}" for size in (1, 2, 4, 8)},
    **{f"uint{8 * size}": f"u{size}" for size in (1, 2, 4, 8)},
}
_TIME_TYPES = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
_EMPTY_MESSAGE_FIELD = "structure_needs_at_least_one_member"
_BASE, _NAME, _ARRAY = 1, 2, 3  # rosbags.interfaces.Nodetype

Fielddefs = Mapping[str, tuple[Any, Sequence[tuple[str, Any]]]]

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
    path = Path(path)
    if path.suffix == ".gz":
        raise LogError(
            "a compressed bag cannot be read, since its index holds offsets into the bag. Unpack it"
            " with `gunzip FILE`",
            source=str(path),
        )
    mcap = path.suffix == ".mcap" or any(path.glob("*.mcap*"))
    form = "ROS 1 bag" if path.suffix == ".bag" else f"ROS 2 bag ({'MCAP' if mcap else 'SQLite'})"
    notes: list[str] = []
    try:
        messages, definitions = _read_bag([path], notes)
    except Exception:  # the exceptions of damaged bags are undocumented
        messages = {}
        with suppress(Exception), repaired_copies(path) as copies:
            messages, definitions = _read_bag(copies, [])
        if not messages:
            raise
        notes = ["the bag is cut off or damaged; the whole messages before the cut were read"]
    topics = tuple(_make_topics(messages, definitions, form != "ROS 1 bag", notes))
    if not topics:
        raise LogError(["the bag holds no readable message", *notes], source=str(path))
    return Recording(topics, str(path), form, tuple(notes))


def _read_bag(paths: Sequence[Path], notes: list[str]) -> tuple[_Messages, Any]:
    """Return the messages of a bag and the definitions of their types."""
    from rosbags import highlevel, typesys

    default_types = typesys.get_typestore(typesys.Stores.LATEST)
    with (
        highlevel.AnyReader(paths, default_typestore=default_types) as reader,
        progress(f"reading {paths[0].name}", reader.message_count) as step,
    ):
        messages = _read_messages(reader, step, notes)
        return messages, {**default_types.fielddefs, **reader.typestore.fielddefs}


def _read_messages(reader: Any, step: Step, notes: list[str]) -> _Messages:
    """Return all messages; for a damaged bag, those before the damage."""
    messages: _Messages = defaultdict(list)
    connections = []
    for connection in reader.connections:
        package, _, name = connection.msgtype.replace("/msg/", "/").partition("/")
        if name in _SKIPPED_TYPES.get(package, ()):
            topic = f"topic `{connection.topic}` ({connection.msgtype})"
            notes.append(f"{topic} is no measurement; skipped")
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
            fault = f"the bag lacks the definition of {error.args[0]}"
            notes.append(f"topic `{name}` was skipped: {fault}")
            continue
        label = name if names.count(name) == 1 else f"{name} ({kind})"
        if truncated := columns.truncated:
            notes.append(
                f"topic `{label}`: {len(truncated)} messages are truncated and were skipped;"
                f" the first is number {truncated[0] + 1}"
            )
        keep = np.isin(np.arange(len(messages)), truncated, invert=True)
        if keep.any():
            yield Topic(
                label,
                np.array(times, dtype=np.float64)[keep] / 1e9,
                {path: column[keep] for path, column in columns.numbers.items()},
                {path: tuple(compress(words, keep)) for path, words in columns.texts.items()},
                dict.fromkeys(columns.time_fields, "s"),
            )


@dataclass
class CdrLayout:
    """Byte offsets of the fields; messages with equal counts share one layout."""

    order: str
    numbers: dict[str, tuple[int, str]] = field(default_factory=dict)
    stamps: dict[str, int] = field(default_factory=dict)
    strings: dict[str, tuple[int, int]] = field(default_factory=dict)
    counts: set[int] = field(default_factory=set)


class _LayoutParser:
    """Parser of one message, from its first byte."""

    def __init__(self, raw: bytes, definitions: Fielddefs, aligned: bool) -> None:
        self.raw, self.definitions, self.aligned = raw, definitions, aligned
        self.start = self.offset = 4 if aligned else 0
        order = ">" if aligned and raw[1] % 2 == 0 else "<"
        self.layout = CdrLayout(order)

    def parse(self, name: str) -> CdrLayout:
        """Return the offsets of the fields of the message."""
        self._message(name, "")
        if self.offset > len(self.raw):
            raise ValueError("the message is truncated")
        return self.layout

    def _message(self, name: str, path: str) -> None:
        for field_name, kind in self.definitions[name][1]:
            if field_name == _EMPTY_MESSAGE_FIELD:
                self.offset += 1
            else:
                self._field(kind, f"{path}.{field_name}" if path else field_name)

    def _field(self, kind: Any, path: str) -> None:
        node, detail = int(kind[0]), kind[1]
        if node not in (_BASE, _NAME):
            length = detail[1] if node == _ARRAY else self._count()
            self._array(detail[0], length, path)
        elif node == _NAME and detail not in _TIME_TYPES:
            self._message(detail, path)
        elif node == _NAME:
            self._align(4)
            self.layout.stamps[path] = self.offset
            self.offset += 8
        elif detail[0] == "string":
            length = self._count()
            self.layout.strings[path] = (self.offset, length - (1 if self.aligned else 0))
            self.offset += length
        else:
            number = np.dtype(self.layout.order + _NUMPY_TYPES[detail[0]])
            self._align(number.itemsize)
            self.layout.numbers[path] = (self.offset, number.str)
            self.offset += number.itemsize

    def _array(self, kind: Any, length: int, path: str) -> None:
        """Parse an array element by element; skip a long one."""
        if length <= MAX_ARRAY_LENGTH:
            for index in range(length):
                self._field(kind, f"{path}[{index}]")
            return
        if int(kind[0]) == _BASE and kind[1][0] != "string":
            size = np.dtype(_NUMPY_TYPES[kind[1][0]]).itemsize
            self._align(size)
            self.offset += size * length
            return
        # Long arrays of messages and strings contribute only their counts to the layout.
        outer, self.layout = self.layout, CdrLayout(self.layout.order)
        for _ in range(length):
            self._field(kind, "")
        outer.counts |= self.layout.counts
        self.layout = outer

    def _count(self) -> int:
        self._align(4)
        (count,) = struct.unpack_from(self.layout.order + "I", self.raw, self.offset)
        if count > len(self.raw):
            raise ValueError("the message is truncated")
        self.layout.counts.add(self.offset)
        self.offset += 4
        return int(count)

    def _align(self, size: int) -> None:
        if self.aligned:
            self.offset += (self.start - self.offset) % size


@dataclass
class Columns:
    """Fields of many messages of one type."""

    numbers: dict[str, FloatArray] = field(default_factory=dict)
    texts: dict[str, list[str]] = field(default_factory=dict)
    time_fields: set[str] = field(default_factory=set)
    truncated: list[int] = field(default_factory=list)


def deserialize_columns(
    messages: Sequence[bytes], name: str, definitions: Fielddefs, *, aligned: bool
) -> Columns:
    """Decode the fields of messages of one type."""
    columns, n = Columns(), len(messages)
    sizes = np.fromiter(map(len, messages), np.int64, n)
    for size in np.unique(sizes).tolist():
        rows = np.flatnonzero(sizes == size)
        block = np.frombuffer(b"".join(messages[row] for row in rows.tolist()), np.uint8)
        block = block.reshape(len(rows), size)
        while len(rows):
            try:
                layout = _LayoutParser(block[0].tobytes(), definitions, aligned).parse(name)
            except (ValueError, IndexError, struct.error):
                columns.truncated.append(int(rows[0]))
                rows, block = rows[1:], block[1:]
                continue
            same = _has_layout(block, layout, aligned)
            _fill_columns(columns, n, layout, rows[same], block[same])
            rows, block = rows[~same], block[~same]
    return columns


def _has_layout(block: Any, layout: CdrLayout, aligned: bool) -> Any:
    """Return which messages share counts, and byte order if they have one, with the first."""
    same = np.ones(len(block), dtype=bool)
    for offset in layout.counts:
        same &= (block[:, offset : offset + 4] == block[0, offset : offset + 4]).all(axis=1)
    return same & (block[:, 1] == block[0, 1]) if aligned else same


def _fill_columns(columns: Columns, n: int, layout: CdrLayout, rows: Any, block: Any) -> None:
    """Write the fields of messages of one layout into their columns."""
    columns.time_fields |= set(layout.stamps)
    for path, (offset, kind) in layout.numbers.items():
        column = columns.numbers.setdefault(path, np.full(n, np.nan))
        column[rows] = _view_field(block, offset, kind)
    for path, offset in layout.stamps.items():
        column = columns.numbers.setdefault(path, np.full(n, np.nan))
        seconds = _view_field(block, offset, layout.order + "i4").astype(np.float64)
        column[rows] = seconds + _view_field(block, offset + 4, layout.order + "u4") / 1e9
    for path, (offset, length) in layout.strings.items():
        texts = columns.texts.setdefault(path, [""] * n)
        is_empty = length <= 0
        words = [b""] * len(rows) if is_empty else _view_field(block, offset, f"V{length}").tolist()
        known = {word: word.decode("utf-8", errors="replace") for word in set(words)}
        for row, word in zip(rows.tolist(), words, strict=True):
            texts[row] = known[word]


def _view_field(block: Any, offset: int, kind: str) -> Any:
    width = np.dtype(kind).itemsize
    return np.ascontiguousarray(block[:, offset : offset + width]).view(kind)[:, 0]
