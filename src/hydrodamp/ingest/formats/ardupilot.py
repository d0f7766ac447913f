"""ArduPilot's DataFlash logs: ``.bin``, and ``.log`` where they are text."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.advance import advance, counted, within
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.cells import column_of
from hydrodamp.ingest.formats.content import content
from hydrodamp.ingest.formats.dataflash_format import (
    FMT_LENGTH,
    FMT_TYPE,
    MessageFormat,
    Units,
    format_of,
    text_format,
)

FORMAT = "ArduPilot log"
"""How messages call the format."""

_MARK = b"\xa3\x95"
_SCANNED = 0.6  # what share of the time it takes to find the messages
_TOLD = 1 << 18  # after how many bytes it is told
_LINES = 10_000  # after how many lines of a log in text
_ABOUT = frozenset({"FMT", "FMTU", "UNIT", "MULT", "FILE"})
_CLOCKS = {"TimeUS": 1e6, "TimeMS": 1e3}
_TEXT = re.compile(rb"\s*FMT\s*,")


def read(path: str | Path) -> Recording:
    """Read a DataFlash log."""
    data, source = content(path), str(path)
    notes: list[str] = []
    if _TEXT.match(data):
        topics = [*_text_topics(data, notes)]
    else:
        with within(0.0, _SCANNED):
            formats, places = _scan(data, source, notes)
        with within(_SCANNED, 1.0):
            topics = [*_binary_topics(data, formats, places, notes)]
    if not topics:
        raise LogError(["the log holds no message with a value", *notes], source=source)
    return Recording(tuple(topics), source, FORMAT, tuple(notes))


def _binary_topics(
    data: bytes,
    formats: dict[int, MessageFormat],
    places: dict[int, list[int]],
    notes: list[str],
) -> Iterator[Topic]:
    bytes_ = np.frombuffer(data, dtype=np.uint8)
    tables: dict[int, Any] = {}
    for kind, found in places.items():
        form = formats[kind]
        if form.row is None:
            notes.append(f"messages {form.name} do not fit their own format; left out")
            continue
        starts = np.array(found, dtype=np.int64)
        block = bytes_[starts[:, np.newaxis] + np.arange(form.length)]
        tables[kind] = np.ascontiguousarray(block).view(form.row)[:, 0]
    units = _units({formats[kind].name: table for kind, table in tables.items()})
    for kind, table in counted(tables.items(), len(tables)):
        form = formats[kind]
        if form.name not in _ABOUT:
            yield from _instances(form, _fields(form, table), units)


def _scan(
    data: bytes, source: str, notes: list[str]
) -> tuple[dict[int, MessageFormat], dict[int, list[int]]]:
    """Return the formats, and the place of every message by its type."""
    formats = {FMT_TYPE: MessageFormat(FMT_TYPE, "FMT", FMT_LENGTH, "BBnNZ", tuple("TLNFC"))}
    lengths = [0] * 256
    lengths[FMT_TYPE] = FMT_LENGTH
    places: dict[int, list[int]] = defaultdict(list)
    place, end, lost, first_lost = 0, len(data), 0, 0
    told, by = 0, advance(end)
    while place + 3 <= end:
        if place >= told + _TOLD:
            by(place - told)
            told = place
        kind = data[place + 2]
        length = lengths[kind]
        if data[place] == 0xA3 and data[place + 1] == 0x95 and length:
            if place + length > end:
                break
            places[kind].append(place)
            if kind == FMT_TYPE:
                form = format_of(data[place : place + FMT_LENGTH])
                if form.length >= 3 and form.type != FMT_TYPE:
                    notes += _adopt(form, formats, lengths, places)
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
    _note_damage(notes, lost, first_lost, end - place)
    return formats, places


def _adopt(
    form: MessageFormat,
    formats: dict[int, MessageFormat],
    lengths: list[int],
    places: dict[int, list[int]],
) -> list[str]:
    """Take a format; where it contradicts an earlier one, the messages of that are dropped."""
    before = formats.get(form.type, form)
    formats[form.type] = form
    lengths[form.type] = form.length
    dropped = places.pop(form.type, []) if before != form else []
    if not dropped:
        return []
    return [f"messages {form.name} are described anew; {len(dropped)} before were left out"]


def _note_damage(notes: list[str], lost: int, first: int, left: int) -> None:
    if lost:
        notes.append(f"{lost} bytes belong to no message, the first at byte {first}; passed over")
    if left > 0:
        notes.append(f"the log is cut off: its last {left} bytes are half a message; left out")


def _fields(form: MessageFormat, table: Any) -> dict[str, Any]:
    """Return the columns of a table of messages: scaled numbers, or words."""
    fields: dict[str, Any] = {}
    for name in form.columns:
        column = table[name]
        if column.dtype.kind == "S":
            fields[name] = [_decoded(word) for word in column.tolist()]
        elif column.ndim == 2:
            fields |= {f"{name}[{k}]": column[:, k].astype(np.float64) for k in range(32)}
        else:
            fields[name] = column.astype(np.float64) / form.divisor(name)
    return fields


def _decoded(word: bytes) -> str:
    return word.partition(b"\0")[0].decode("utf-8", errors="replace")


def _units(tables: dict[str, Any]) -> Units:
    """Return what the messages UNIT, MULT and FMTU say; empty where they are missing."""
    by_type: dict[int, tuple[str, str]] = {}
    labels: dict[str, str] = {}
    multipliers: dict[str, float] = {}
    for row in _rows(tables.get("UNIT"), ("Id", "Label")):
        labels[chr(row[0] % 256)] = _decoded(row[1])
    for row in _rows(tables.get("MULT"), ("Id", "Mult")):
        multipliers[chr(row[0] % 256)] = float(row[1])
    for row in _rows(tables.get("FMTU"), ("FmtType", "UnitIds", "MultIds")):
        by_type[int(row[0])] = (_decoded(row[1]), _decoded(row[2]))
    return Units(by_type, labels, multipliers)


def _rows(table: Any, names: tuple[str, ...]) -> Iterable[tuple[Any, ...]]:
    if table is None or any(name not in table.dtype.names for name in names):
        return ()
    return zip(*(table[name].tolist() for name in names), strict=True)


def _instances(form: MessageFormat, fields: dict[str, Any], units: Units) -> Iterator[Topic]:
    """Yield a topic, or one for every sensor of the kind."""
    instance, stated = units.instance(form), units.of(form)
    numbers = fields.get(instance)
    if numbers is None or isinstance(numbers, list):
        yield _topic(form.name, fields, stated, slice(None))
        return
    for number in np.unique(numbers).tolist():
        rows = np.flatnonzero(numbers == number)
        yield _topic(f"{form.name}[{int(number)}]", fields, stated, rows)


def _topic(name: str, fields: dict[str, Any], units: dict[str, str], rows: Any) -> Topic:
    numbers = {key: column[rows] for key, column in fields.items() if not isinstance(column, list)}
    texts = {key: column for key, column in fields.items() if isinstance(column, list)}
    if isinstance(rows, np.ndarray):
        texts = {key: [column[row] for row in rows.tolist()] for key, column in texts.items()}
    clock = next((key for key in _CLOCKS if key in numbers), None)
    time = None if clock is None else numbers[clock] / _CLOCKS[clock]
    words = {key: tuple(column) for key, column in texts.items()}
    stated = {key: unit for key, unit in units.items() if key in numbers}
    return Topic(name, time, numbers, words, stated)


def _text_topics(data: bytes, notes: list[str]) -> Iterator[Topic]:
    """Yield the topics of a log in text, whose values are scaled already."""
    formats: dict[str, MessageFormat] = {}
    rows: dict[str, list[list[str]]] = defaultdict(list)
    odd: list[int] = []
    lines = data.decode("utf-8", errors="replace").splitlines()
    for line, text in enumerate(counted(lines, len(lines), _LINES), start=1):
        cells = [cell.strip() for cell in text.split(",")]
        form = text_format(cells) if cells[0] == "FMT" else None
        if form is not None:
            formats[form.name] = form
        elif cells[0] in formats and len(cells) - 1 == len(formats[cells[0]].columns):
            rows[cells[0]].append(cells[1:])
        elif text.strip("\0 "):
            odd.append(line)
    if odd:
        more = f" and {len(odd) - 1} more" if len(odd) > 1 else ""
        notes.append(f"line {odd[0]}{more} fit no format of the log; passed over")
    for name, found in rows.items():
        if name in _ABOUT or not formats[name].columns:
            continue
        columns = {
            key: column_of(cells)
            for key, cells in zip(formats[name].columns, zip(*found, strict=True), strict=True)
        }
        fields = {
            key: list(column.words) if column.numbers is None else column.numbers
            for key, column in columns.items()
        }
        yield from _instances(formats[name], fields, Units({}, {}, {}))
