"""Text in columns: CSV, TSV and what else lies between spaces, whole or part by part."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from hydrodamp.data.recording import Recording
from hydrodamp.ingest.formats import fast_text, text_rows
from hydrodamp.ingest.formats.content import head
from hydrodamp.ingest.formats.dialect import find_dialect
from hydrodamp.ingest.formats.encoding import encoding_of
from hydrodamp.ingest.formats.text_table import OddTextError, TextFile, throughout

FORMAT = "text in columns"
"""How messages call the format."""

_SAMPLE = 1 << 18
_LINE = re.compile("\r\n|\n|\r")


def read(path: str | Path) -> Recording:
    """Read text in columns with any header, delimiter, encoding and decimal sign."""
    file = text_file(path)
    try:
        columns = fast_text.read(file)
    except OddTextError:
        file = throughout(file)
        columns = text_rows.read(file)
    return columns.recording(file, FORMAT)


def parts(path: str | Path, rows: int = 100_000) -> Iterator[Recording]:
    """Read text in columns part by part, for files larger than the memory."""
    file, done = text_file(path), 0
    try:
        for columns in fast_text.parts(file, rows):
            yield columns.recording(file, FORMAT)
            done += columns.n
    except OddTextError:
        file = throughout(file)
        for columns in text_rows.parts(file, rows, skip=done):
            yield columns.recording(file, FORMAT)


def text_file(path: str | Path) -> TextFile:
    """Find how a text file is written."""
    begin = head(path, _SAMPLE)
    encoding, notes = encoding_of(begin, str(path))
    lines = _LINE.split(begin.rstrip(b"\0").decode(encoding, errors="replace"))
    if len(begin) == _SAMPLE and len(lines) > 1:
        lines.pop()
    dialect = find_dialect(lines, str(path))
    return TextFile(path, encoding, dialect, tuple(notes), quoted='"' in "".join(lines))
