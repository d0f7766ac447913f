"""ArduPilot DataFlash logs, binary (``.bin``) or text (``.log``): FMT messages define the others.

Each FMT message gives type, length, format letters and field names of one message type, so that
all messages of a type are decoded as one NumPy structured array.
"""

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
from hydrodamp.ingest.formats.cells import parse_column
from hydrodamp.ingest.formats.content import as_numbers, read_bytes

#: Fault of a log without messages.
NO_MESSAGE = "the log holds no message with a value; check that logging was enabled"

_HEADER = b"\xa3\x95"
_FMT_TYPE, _FMT_LENGTH = 128, 89  # FMT messages, which define the others
_METADATA_TYPES = frozenset({"FMT", "FMTU", "UNIT", "MULT", "FILE"})
_CLOCK_DIVISORS = {"TimeUS": 1e6, "TimeMS": 1e3}
_TEXT_LOG = re.compile(rb"\s*FMT\s*,")

# NumPy type of each format letter, and the divisor of scaled integers (ArduPilot, LogStructure.h).
_TYPES_BY_LETTER = "c:<h C:<H e:<i E:<I L:<i M:<B g:<f2 n:S4 N:S16 Z:S64 a:32<i2"
_NUMPY_TYPES = {letter: f"<{letter}" for letter in "bBhHiIqQfd"}
_NUMPY_TYPES |= dict(pair.split(":") for pair in _TYPES_BY_LETTER.split())
_DIVISORS = dict.fromkeys("cCeE", 100.0) | {"L": 1e7}

# Field with the instance number of a sensor, for logs without FMTU messages (LogStructure.h).
_INSTANCE_FIELDS = {"XKF": "C", "NKF": "C", "IMU": "I", "ACC": "I", "GYR": "I"}

_SI_PREFIXES = {1.0: "", 0.1: "d", 0.01: "c", 1e-3: "m", 1e-6: "µ", 1e-9: "n"}


def read_file(path: str | Path) -> Recording:
    """Read a DataFlash log."""
    data, source = read_bytes(path), str(path)
    notes: list[str] = []
    text = _TEXT_LOG.match(data)
    topics = [*(_text_topics(data, notes) if text else _binary_topics(data, source, notes))]
    if not topics:
        raise LogError([NO_MESSAGE, *notes], source=source)
    return Recording(tuple(topics), source, "ArduPilot log", tuple(notes))


@dataclass(frozen=True)
class _MessageFormat:
    """Layout of one message type, as its FMT message defines it."""

    type: int
    name: str
    length: int
    letters: str
    columns: tuple[str, ...]

    @property
    def dtype(self) -> np.dtype[Any] | None:
        """NumPy type of one message; None where letters, names and length disagree."""
        try:
            kinds = [_NUMPY_TYPES[letter] for letter in self.letters]
            row = np.dtype([("", "V3"), *zip(self.columns, kinds, strict=True)])
        except (KeyError, ValueError):
            return None
        return row if row.itemsize == self.length and all(self.columns) else None

    @classmethod
    def from_message(cls, message: bytes) -> _MessageFormat:
        name, letters, columns = map(_decode_string, (message[5:9], message[9:25], message[25:89]))
        names = tuple(name.strip() for name in columns.split(",")) if columns else ()
        return cls(message[3], name, message[4], letters, names)


def _decode_string(word: bytes) -> str:
    return word.partition(b"\0")[0].decode("utf-8", errors="replace")


def _binary_topics(data: bytes, source: str, notes: list[str]) -> Iterator[Topic]:
    formats, offsets_by_type = _scan_messages(data, source, notes)
    data_bytes = np.frombuffer(data, dtype=np.uint8)
    tables: dict[int, Any] = {}
    for kind, offsets in offsets_by_type.items():
        form = formats[kind]
        if form.dtype is None:
            notes.append(f"messages {form.name} do not match their FMT message; they were skipped")
            continue
        block = data_bytes[np.array(offsets)[:, np.newaxis] + np.arange(form.length)]
        tables[kind] = np.ascontiguousarray(block).view(form.dtype)[:, 0]
    units = _UnitMessages({formats[kind].name: table for kind, table in tables.items()})
    for kind, table in tables.items():
        if formats[kind].name not in _METADATA_TYPES:
            yield from _split_instances(formats[kind], _decode_fields(formats[kind], table), units)


def _scan_messages(
    data: bytes, source: str, notes: list[str]
) -> tuple[dict[int, _MessageFormat], dict[int, list[int]]]:
    """Return the formats, and the byte offset of each message by type."""
    formats = {_FMT_TYPE: _MessageFormat(_FMT_TYPE, "FMT", _FMT_LENGTH, "BBnNZ", tuple("TLNFC"))}
    lengths = [0] * 256
    lengths[_FMT_TYPE] = _FMT_LENGTH
    offsets: dict[int, list[int]] = defaultdict(list)
    offset, end, n_skipped, first_skipped = 0, len(data), 0, 0
    while offset + 3 <= end:
        kind = data[offset + 2]
        length = lengths[kind]
        if data[offset] == 0xA3 and data[offset + 1] == 0x95 and length:
            if offset + length > end:
                break
            offsets[kind].append(offset)
            if kind == _FMT_TYPE:
                form = _MessageFormat.from_message(data[offset : offset + _FMT_LENGTH])
                if form.length >= 3 and form.type not in formats:
                    formats[form.type], lengths[form.type] = form, form.length
            offset += length
            continue
        start = offset
        offset = data.find(_HEADER, start + 1) % (end + 1)  # the end if there is none
        first_skipped = first_skipped if n_skipped else start
        n_skipped += offset - start
    if not offsets:
        raise LogError(
            "expected the FMT messages of an ArduPilot log (0xA3 0x95 0x80), found none. If the"
            " file has another format, give it that format's suffix",
            source=source,
        )
    if n_skipped:
        notes.append(
            f"{n_skipped} bytes belong to no message, the first at byte {first_skipped}; skipped"
        )
    if end > offset:
        notes.append(
            f"the log is truncated: its last {end - offset} bytes are an incomplete message"
        )
    return formats, offsets


def _decode_fields(form: _MessageFormat, table: Any) -> dict[str, Any]:
    """Return the columns of a table of messages: scaled numbers, or text."""
    fields: dict[str, Any] = {}
    for name, letter in zip(form.columns, form.letters, strict=True):
        column = table[name]
        if column.dtype.kind == "S":
            fields[name] = [_decode_string(word) for word in column.tolist()]
        elif column.ndim == 2:
            fields |= {f"{name}[{k}]": as_numbers(column[:, k]) for k in range(32)}
        else:
            fields[name] = as_numbers(column) / _DIVISORS.get(letter, 1.0)
    return fields


class _UnitMessages:
    """Units and instance fields from the messages UNIT, MULT and FMTU."""

    def __init__(self, tables: Mapping[str, Any]) -> None:
        def rows(name: str, *columns: str) -> Iterator[tuple[Any, ...]]:
            table = tables.get(name)
            if table is not None and set(columns) <= set(table.dtype.names):
                yield from zip(*(table[column].tolist() for column in columns), strict=True)

        labels, scales = rows("UNIT", "Id", "Label"), rows("MULT", "Id", "Mult")
        self.labels = {chr(key % 256): _decode_string(label) for key, label in labels}
        self.multipliers = {chr(key % 256): float(scale) for key, scale in scales}
        self.by_type = {
            int(kind): (_decode_string(units), _decode_string(multipliers))
            for kind, units, multipliers in rows("FMTU", "FmtType", "UnitIds", "MultIds")
        }

    def instance(self, form: _MessageFormat) -> str:
        """Return the field with the instance number of a sensor; empty for none."""
        if form.type not in self.by_type:
            return _INSTANCE_FIELDS.get(form.name.rstrip("0123456789"), "")
        index = self.by_type[form.type][0].find("#")
        return form.columns[index] if 0 <= index < len(form.columns) else ""

    def units(self, form: _MessageFormat) -> dict[str, str]:
        """Return the units of the fields that have one."""
        letters, scales = self.by_type.get(form.type, ("", ""))
        units = {}
        for index, (name, letter) in enumerate(zip(form.columns, letters, strict=False)):
            label = self.labels.get(letter, "")
            if not label or letter == "#":
                continue
            is_scaled = form.letters[index] in _DIVISORS or index >= len(scales)
            multiplier = (1.0 if is_scaled else self.multipliers.get(scales[index], 1.0)) or 1.0
            units[name] = _SI_PREFIXES.get(multiplier, f"{multiplier:.4g} ") + label
        return units


def _split_instances(
    form: _MessageFormat, fields: dict[str, Any], stated: _UnitMessages
) -> Iterator[Topic]:
    """Yield one topic, or one per sensor instance."""
    numbers = fields.get(stated.instance(form))
    groups: dict[str, Any] = {form.name: slice(None)}
    if isinstance(numbers, np.ndarray):
        instances = np.unique(numbers[np.isfinite(numbers)]).tolist()
        groups = {f"{form.name}[{int(k)}]": np.flatnonzero(numbers == k) for k in instances}
    for name, rows in groups.items():
        columns = {key: np.asarray(column)[rows] for key, column in fields.items()}
        texts = {
            key: tuple(column.tolist())
            for key, column in columns.items()
            if column.dtype.kind == "U"
        }
        values = {key: column for key, column in columns.items() if key not in texts}
        clock = next((key for key in _CLOCK_DIVISORS if key in values), None)
        time = None if clock is None else values[clock] / _CLOCK_DIVISORS[clock]
        units = {key: unit for key, unit in stated.units(form).items() if key in values}
        yield Topic(name, time, values, texts, units)


def _text_topics(data: bytes, notes: list[str]) -> Iterator[Topic]:
    """Yield the topics of a text log, whose values are already scaled."""
    formats: dict[str, _MessageFormat] = {}
    rows: dict[str, list[list[str]]] = defaultdict(list)
    invalid: list[int] = []
    lines = data.decode("utf-8", errors="replace").splitlines()
    for line, text in enumerate(lines, start=1):
        name, *cells = (cell.strip() for cell in text.split(","))
        if name == "FMT" and len(cells) >= 4 and cells[0].isdigit() and cells[1].isdigit():
            kind, length, key, letters, *columns = cells
            formats[key] = _MessageFormat(int(kind), key, int(length), letters, tuple(columns))
        elif name in formats and len(cells) == len(formats[name].columns):
            rows[name].append(cells)
        elif text.strip("\0 "):
            invalid.append(line)
    if invalid:
        more = f" and {len(invalid) - 1} more" if len(invalid) > 1 else ""
        notes.append(f"line {invalid[0]}{more} match no FMT message of the log; skipped")
    for name, cells_by_row in rows.items():
        if name in _METADATA_TYPES or not formats[name].columns:
            continue
        names = formats[name].columns
        cells_by_name = zip(names, zip(*cells_by_row, strict=True), strict=True)
        parsed = {key: parse_column(cells, name=key) for key, cells in cells_by_name}
        fields = {
            key: [*column.texts] if column.numbers is None else column.numbers
            for key, column in parsed.items()
        }
        yield from _split_instances(formats[name], fields, _UnitMessages({}))
