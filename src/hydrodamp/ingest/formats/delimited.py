"""Text in columns: CSV, TSV and what else lies between spaces, whole or part by part."""

from __future__ import annotations

import codecs
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from hydrodamp.data.recording import Recording
from hydrodamp.ingest.formats import fast_text, text_rows
from hydrodamp.ingest.formats.cells import Part, topic_of
from hydrodamp.ingest.formats.content import opened
from hydrodamp.ingest.formats.dialect import WESTERN, Dialect, find_dialect

_CHUNK = 1 << 20


def read(path: str | Path) -> Recording:
    """Read text in columns with any header, delimiter, encoding and decimal sign."""
    dialect = find_dialect(path)
    try:
        return _recording(fast_text.read(path, dialect), path, dialect)
    except fast_text.OddTextError:
        dialect = _throughout(path, dialect)
        return _recording(next(text_rows.parts(path, dialect, None)), path, dialect)


def parts(path: str | Path, rows: int = 100_000) -> Iterator[Recording]:
    """Read text in columns part by part, for files larger than the memory."""
    dialect, done = find_dialect(path), 0
    try:
        for part in fast_text.parts(path, dialect, rows):
            yield _recording(part, path, dialect)
            done += len(part.lines)
    except fast_text.OddTextError:
        dialect = _throughout(path, dialect)
        for part in text_rows.parts(path, dialect, rows, skip=done):
            yield _recording(part, path, dialect)


def _throughout(path: str | Path, dialect: Dialect) -> Dialect:
    """Return the dialect with an encoding that holds to the end of the file."""
    if dialect.encoding != "utf-8":
        return dialect
    decoder = codecs.getincrementaldecoder("utf-8")()
    with opened(path, counted=False) as file:
        try:
            while chunk := file.read(_CHUNK):
                decoder.decode(chunk)
        except UnicodeDecodeError:
            return replace(dialect, encoding=WESTERN)
    return dialect


def _recording(part: Part, path: str | Path, dialect: Dialect) -> Recording:
    """Return columns as a recording of one topic."""
    named = dict(zip(dialect.names, part.columns, strict=True))
    dated = {name: column.unit for name, column in named.items() if column.unit}
    units = {**dialect.units, **dated}
    topic = topic_of("", named, part.lines, units=units, skipped=part.skipped)
    notes = [*dialect.notes, *part.notes, *topic.faults.values()]
    if dialect.encoding == WESTERN:
        notes.insert(0, "the text is not UTF-8; its letters were read as Windows-1252")
    notes += [f"column `{name}` holds dates, read in seconds since 1970" for name in dated]
    topic = replace(topic, faults={**topic.faults, **dialect.faults})
    return Recording((topic,), str(path), "text in columns", tuple(notes))
