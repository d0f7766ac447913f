"""ArduPilot's DataFlash logs: ``.bin``, and ``.log`` where they are text."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.cells import column_of
from hydrodamp.ingest.formats.content import content

_MARK = b"\xa3\x95"
_FMT_TYPE, _FMT_LENGTH = 128, 89  # of the messages that describe the others
_ABOUT = frozenset({"FMT", "FMTU", "UNIT", "MULT", "FILE"})
_CLOCKS = {"TimeUS": 1e6, "TimeMS": 1e3}
_TEXT = re.compile(rb"\s*FMT\s*,")

#: NumPy type of every letter of a format, and the divisor of those that are scaled (ArduPilot,
#: LogStructure.h).
_KINDS = {letter: f"<{letter}" for letter in "bBhHiIqQfd"} | {
    "c": "<h",
    "C": "<H",
    "e": "<i",
    "E": "<I",
    "L": "<i",
    "M": "<B",
    "g": "<f2",
    "n": "S4",
    "N": "S16",
    "Z": "S64",
    "a": "32<i2",
}
_DIVISORS = dict.fromkeys("cCeE", 100.0) | {"L": 1e7}

# The field that numbers the sensors of one kind, where a log does not state it (LogStructure.h).
_INSTANCES = {"XKF": "C", "NKF": "C", "IMU": "I", "ACC": "I", "GYR": "I"}

_PREFIXES = {1.0: "", 0.1: "d", 0.01: "c", 1e-3: "m", 1e-6: "µ", 1e-9: "n"}


def read(path: str | Path) -> Recording:
    """Read a DataFlash log."""
    data, source = content(path), str(path)
    notes: list[str] = []
    text = _TEXT.match(data)
    topics = [*(_text_topics(data, notes) if text else _binary_topics(data, source, notes))]
    if not topics:
        raise LogError(["the log holds no message with a value", *notes], source=source)
    return Recording(tuple(topics), source, "ArduPilot log", tuple(notes))


@dataclass(frozen=True)
class _Format:
    """How messages of one type are laid out."""

    type: int
    name: str
    length: int
    letters: str
    columns: tuple[str, ...]

    @property
    def row(self) -> np.dtype[Any] | None:
        """The NumPy type of one message; None where letters, names and length disagree."""
        try:
            kinds = [_KINDS[letter] for letter in self.letters]
            row = np.dtype([("", "V3"), *zip(self.columns, kinds, strict=True)])
        except (KeyError, ValueError):
            return None
        return row if row.itemsize == self.length and all(self.columns) else None

    @classmethod
    def described_by(cls, message: bytes) -> _Format:
        name, letters, columns = map(_decoded, (message[5:9], message[9:25], message[25:89]))
        names = tuple(name.strip() for name in columns.split(",")) if columns else ()
        return cls(message[3], name, message[4], letters, names)


def _decoded(word: bytes) -> str:
    return word.partition(b"\0")[0].decode("utf-8", errors="replace")


def _binary_topics(data: bytes, source: str, notes: list[str]) -> Iterator[Topic]:
    formats, places = _scan(data, source, notes)
    letters = np.frombuffer(data, dtype=np.uint8)
    tables: dict[int, Any] = {}
    for kind, found in places.items():
        form = formats[kind]
        if form.row is None:
            notes.append(f"messages {form.name} do not fit their own format; left out")
            continue
        block = letters[np.array(found)[:, np.newaxis] + np.arange(form.length)]
        tables[kind] = np.ascontiguousarray(block).view(form.row)[:, 0]
    stated = _Stated({formats[kind].name: table for kind, table in tables.items()})
    for kind, table in tables.items():
        if formats[kind].name not in _ABOUT:
            yield from _instances(formats[kind], _fields(formats[kind], table), stated)


def _scan(
    data: bytes, source: str, notes: list[str]
) -> tuple[dict[int, _Format], dict[int, list[int]]]:
    """Return the formats, and the place of every message by its type."""
    formats = {_FMT_TYPE: _Format(_FMT_TYPE, "FMT", _FMT_LENGTH, "BBnNZ", tuple("TLNFC"))}
    lengths = [0] * 256
    lengths[_FMT_TYPE] = _FMT_LENGTH
    places: dict[int, list[int]] = defaultdict(list)
    place, end, lost, first_lost = 0, len(data), 0, 0
    while place + 3 <= end:
        kind = data[place + 2]
        length = lengths[kind]
        if data[place] == 0xA3 and data[place + 1] == 0x95 and length:
            if place + length > end:
                break
            places[kind].append(place)
            if kind == _FMT_TYPE:
                form = _Format.described_by(data[place : place + _FMT_LENGTH])
                if form.length >= 3 and form.type not in formats:
                    formats[form.type], lengths[form.type] = form, form.length
            place += length
            continue
        following = data.find(_MARK, place + 1)
        following = end if following < 0 else following
        first_lost = first_lost if lost else place
        lost += following - place
        place = following
    if not places:
        raise LogError(
            "it does not begin with the format messages of an ArduPilot log (0xA3 0x95 0x80)."
            " Give it the name of the format it has",
            source=source,
        )
    if lost:
        notes.append(
            f"{lost} bytes belong to no message, the first at byte {first_lost}; passed over"
        )
    if end > place:
        notes.append(
            f"the log is cut off: its last {end - place} bytes are half a message; left out"
        )
    return formats, places


def _fields(form: _Format, table: Any) -> dict[str, Any]:
    """Return the columns of a table of messages: scaled numbers, or words."""
    fields: dict[str, Any] = {}
    for name, letter in zip(form.columns, form.letters, strict=True):
        column = table[name]
        if column.dtype.kind == "S":
            fields[name] = [_decoded(word) for word in column.tolist()]
        elif column.ndim == 2:
            fields |= {f"{name}[{k}]": column[:, k].astype(np.float64) for k in range(32)}
        else:
            fields[name] = column.astype(np.float64) / _DIVISORS.get(letter, 1.0)
    return fields


class _Stated:
    """Units and instance fields, as the messages UNIT, MULT and FMTU state them."""

    def __init__(self, tables: Mapping[str, Any]) -> None:
        def rows(name: str, *columns: str) -> Iterator[tuple[Any, ...]]:
            table = tables.get(name)
            if table is not None and set(columns) <= set(table.dtype.names):
                yield from zip(*(table[column].tolist() for column in columns), strict=True)

        self.labels = {chr(key % 256): _decoded(one) for key, one in rows("UNIT", "Id", "Label")}
        self.multipliers = {chr(key % 256): float(by) for key, by in rows("MULT", "Id", "Mult")}
        about = rows("FMTU", "FmtType", "UnitIds", "MultIds")
        self.by_type = {int(kind): (_decoded(units), _decoded(by)) for kind, units, by in about}

    def instance(self, form: _Format) -> str:
        """Return the field that numbers the sensors of one kind; empty for none."""
        if form.type not in self.by_type:
            return _INSTANCES.get(form.name.rstrip("0123456789"), "")
        place = self.by_type[form.type][0].find("#")
        return form.columns[place] if 0 <= place < len(form.columns) else ""

    def units(self, form: _Format) -> dict[str, str]:
        """Return the units of the fields that have one."""
        letters, scales = self.by_type.get(form.type, ("", ""))
        units = {}
        for place, (name, letter) in enumerate(zip(form.columns, letters, strict=False)):
            label = self.labels.get(letter, "")
            if not label or letter == "#":
                continue
            scaled = form.letters[place] in _DIVISORS or place >= len(scales)
            by = (1.0 if scaled else self.multipliers.get(scales[place], 1.0)) or 1.0
            units[name] = _PREFIXES.get(by, f"{by:.4g} ") + label
        return units


def _instances(form: _Format, fields: dict[str, Any], stated: _Stated) -> Iterator[Topic]:
    """Yield a topic, or one for every sensor of the kind."""
    units = stated.units(form)
    numbers = fields.get(stated.instance(form))
    if not isinstance(numbers, np.ndarray):
        yield _topic(form.name, fields, units)
        return
    for number in np.unique(numbers[np.isfinite(numbers)]).tolist():
        rows = np.flatnonzero(numbers == number)
        yield _topic(f"{form.name}[{int(number)}]", fields, units, rows)


def _topic(
    name: str, fields: Mapping[str, Any], units: Mapping[str, str], rows: Any = None
) -> Topic:
    """Return a topic of all messages, or of some rows of them."""
    chosen = slice(None) if rows is None else rows
    taken = {key: np.asarray(column)[chosen] for key, column in fields.items()}
    words = {key: tuple(it.tolist()) for key, it in taken.items() if it.dtype.kind == "U"}
    numbers = {key: column for key, column in taken.items() if key not in words}
    clock = next((key for key in _CLOCKS if key in numbers), None)
    time = None if clock is None else numbers[clock] / _CLOCKS[clock]
    stated = {key: unit for key, unit in units.items() if key in numbers}
    return Topic(name, time, numbers, words, stated)


def _text_topics(data: bytes, notes: list[str]) -> Iterator[Topic]:
    """Yield the topics of a log in text, whose values are scaled already."""
    formats: dict[str, _Format] = {}
    rows: dict[str, list[list[str]]] = defaultdict(list)
    odd: list[int] = []
    lines = data.decode("utf-8", errors="replace").splitlines()
    for line, text in enumerate(lines, start=1):
        name, *cells = (cell.strip() for cell in text.split(","))
        if name == "FMT" and len(cells) >= 4 and cells[0].isdigit() and cells[1].isdigit():
            kind, length, called, letters, *columns = cells
            formats[called] = _Format(int(kind), called, int(length), letters, tuple(columns))
        elif name in formats and len(cells) == len(formats[name].columns):
            rows[name].append(cells)
        elif text.strip("\0 "):
            odd.append(line)
    if odd:
        more = f" and {len(odd) - 1} more" if len(odd) > 1 else ""
        notes.append(f"line {odd[0]}{more} fit no format of the log; passed over")
    for name, found in rows.items():
        if name in _ABOUT or not formats[name].columns:
            continue
        values = map(column_of, zip(*found, strict=True))
        fields = {
            key: [*column.words] if column.numbers is None else column.numbers
            for key, column in zip(formats[name].columns, values, strict=True)
        }
        yield from _instances(formats[name], fields, _Stated({}))
