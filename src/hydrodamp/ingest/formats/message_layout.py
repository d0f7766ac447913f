"""Where the numbers of a serialised ROS message lie, so that many are read at once."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray

#: Arrays longer than this are no measurements of one moment; they are left out.
LONGEST = 64

_TYPES = {
    "bool": "?",
    "float32": "f4",
    "float64": "f8",
    **dict.fromkeys(("byte", "char", "octet"), "u1"),
    **{f"int{8 * size}": f"i{size}" for size in (1, 2, 4, 8)},
    **{f"uint{8 * size}": f"u{size}" for size in (1, 2, 4, 8)},
}
_STAMPS = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
_FILLER = "structure_needs_at_least_one_member"
_BASE, _NAME, _ARRAY = 1, 2, 3  # as rosbags numbers the kinds of field

Fielddefs = Mapping[str, tuple[Any, Sequence[tuple[str, Any]]]]


@dataclass
class Layout:
    """Places of the fields in one shape of a message."""

    order: str
    numbers: dict[str, tuple[int, str]] = field(default_factory=dict)
    stamps: dict[str, int] = field(default_factory=dict)
    words: dict[str, tuple[int, int]] = field(default_factory=dict)
    counts: set[int] = field(default_factory=set)


class _Walk:
    """One message, read from the front."""

    def __init__(self, raw: bytes, definitions: Fielddefs, aligned: bool) -> None:
        self.raw, self.definitions, self.aligned = raw, definitions, aligned
        self.start = self.place = 4 if aligned else 0
        order = ">" if aligned and raw[1] % 2 == 0 else "<"
        self.layout = Layout(order)

    def whole(self, name: str) -> Layout:
        """Return where the fields of the message lie."""
        self._message(name, "")
        if self.place > len(self.raw):
            raise ValueError("the message ends early")
        return self.layout

    def _message(self, name: str, path: str) -> None:
        for part, kind in self.definitions[name][1]:
            if part == _FILLER:
                self.place += 1
            else:
                self._field(kind, f"{path}.{part}" if path else part)

    def _field(self, kind: Any, path: str) -> None:
        node, detail = int(kind[0]), kind[1]
        if node not in (_BASE, _NAME):
            length = detail[1] if node == _ARRAY else self._count()
            self._items(detail[0], length, path)
        elif node == _NAME and detail not in _STAMPS:
            self._message(detail, path)
        elif node == _NAME:
            self._align(4)
            self.layout.stamps[path] = self.place
            self.place += 8
        elif detail[0] == "string":
            length = self._count()
            self.layout.words[path] = (self.place, length - (1 if self.aligned else 0))
            self.place += length
        else:
            number = np.dtype(self.layout.order + _TYPES[detail[0]])
            self._align(number.itemsize)
            self.layout.numbers[path] = (self.place, number.str)
            self.place += number.itemsize

    def _items(self, kind: Any, length: int, path: str) -> None:
        """Step through an array; a long one of numbers is stepped over at once."""
        if length <= LONGEST:
            for index in range(length):
                self._field(kind, f"{path}[{index}]")
            return
        if int(kind[0]) == _BASE and kind[1][0] != "string":
            size = np.dtype(_TYPES[kind[1][0]]).itemsize
            self._align(size)
            self.place += size * length
            return
        # Of messages and strings only the lengths in them are kept.
        whole, self.layout = self.layout, Layout(self.layout.order)
        for _ in range(length):
            self._field(kind, "")
        whole.counts |= self.layout.counts
        self.layout = whole

    def _count(self) -> int:
        self._align(4)
        if self.place + 4 > len(self.raw):
            raise ValueError("the message ends early")
        (count,) = struct.unpack_from(self.layout.order + "I", self.raw, self.place)
        if count > len(self.raw):
            raise ValueError("the message ends early")
        self.layout.counts.add(self.place)
        self.place += 4
        return int(count)

    def _align(self, size: int) -> None:
        if self.aligned:
            self.place += (self.start - self.place) % size


@dataclass
class Columns:
    """Fields of many messages."""

    numbers: dict[str, FloatArray] = field(default_factory=dict)
    texts: dict[str, list[str]] = field(default_factory=dict)
    seconds: set[str] = field(default_factory=set)
    broken: list[int] = field(default_factory=list)


def columns_of(
    messages: Sequence[bytes], name: str, definitions: Fielddefs, *, aligned: bool
) -> Columns:
    """Return the fields of messages of one type."""
    columns, n = Columns(), len(messages)
    sizes = np.fromiter(map(len, messages), np.int64, n)
    for size in np.unique(sizes).tolist():
        rows = np.flatnonzero(sizes == size)
        block = np.frombuffer(b"".join(messages[row] for row in rows.tolist()), np.uint8)
        block = block.reshape(len(rows), size)
        while len(rows):
            try:
                layout = _Walk(block[0].tobytes(), definitions, aligned).whole(name)
            except (ValueError, IndexError):
                columns.broken.append(int(rows[0]))
                rows, block = rows[1:], block[1:]
                continue
            same = _of_shape(block, layout)
            _fill(columns, n, layout, rows[same], block[same])
            rows, block = rows[~same], block[~same]
    return columns


def _of_shape(block: Any, layout: Layout) -> Any:
    """Tell which messages have the lengths, and the byte order, of the first."""
    same = np.ones(len(block), dtype=bool)
    for offset in layout.counts:
        same &= (block[:, offset : offset + 4] == block[0, offset : offset + 4]).all(axis=1)
    return same & (block[:, 1] == block[0, 1]) if layout.order == ">" else same


def _fill(columns: Columns, n: int, layout: Layout, rows: Any, block: Any) -> None:
    """Put the fields of messages of one shape into their columns."""
    columns.seconds |= set(layout.stamps)
    for path, (offset, kind) in layout.numbers.items():
        column = columns.numbers.setdefault(path, np.full(n, np.nan))
        column[rows] = _cut(block, offset, kind)
    for path, offset in layout.stamps.items():
        column = columns.numbers.setdefault(path, np.full(n, np.nan))
        seconds = _cut(block, offset, layout.order + "i4").astype(np.float64)
        column[rows] = seconds + _cut(block, offset + 4, layout.order + "u4") / 1e9
    for path, (offset, length) in layout.words.items():
        texts = columns.texts.setdefault(path, [""] * n)
        words = _cut(block, offset, f"V{length}").tolist() if length > 0 else [b""] * len(rows)
        known = {word: word.decode("utf-8", errors="replace") for word in set(words)}
        for row, word in zip(rows.tolist(), words, strict=True):
            texts[row] = known[word]


def _cut(block: Any, offset: int, kind: str) -> Any:
    width = np.dtype(kind).itemsize
    return np.ascontiguousarray(block[:, offset : offset + width]).view(kind)[:, 0]
