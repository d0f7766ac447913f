"""Text in columns: CSV, TSV and what else lies between spaces, whole or part by part."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from hydrodamp.data.formats import fast_text, text_rows
from hydrodamp.data.formats.content import head
from hydrodamp.data.formats.dialect import find_dialect
from hydrodamp.data.formats.encoding import encoding_of
from hydrodamp.data.formats.text_table import OddTextError, TextFile, throughout
from hydrodamp.data.recording import Recording

FORMAT = "text in columns"
"""How messages call the format."""

_SAMPLE = 1 << 18
_LINE = re.compile("\r\n|\n|\r")


def read(path: str | Path) -> Recording:
    """Read text in columns with any header, delimiter, encoding and decimal sign.

    Parameters
    ----------
    path : str or Path
        A file with a line of names, perhaps lines of titles above and a line of
        units below it; compressed by gzip or not.

    Returns
    -------
    recording : Recording
        One topic without a name, its clock among the fields. What was odd but
        harmless is in the notes; what is wrong with one column only, in the
        faults of the topic.

    Raises
    ------
    FileError
        If the file cannot be opened.
    LogError
        With every fault of the file: rows of another length, no text at all.
    """
    file = text_file(path)
    try:
        columns = fast_text.read(file)
    except OddTextError:
        file = throughout(file)
        columns = text_rows.read(file)
    return columns.recording(file, FORMAT)


def parts(path: str | Path, rows: int = 100_000) -> Iterator[Recording]:
    """Read text in columns part by part, for files larger than the memory.

    Parameters
    ----------
    path : str or Path
        As for :func:`read`.
    rows : int, optional
        How many rows a part has at most.

    Yields
    ------
    recording : Recording
        The next rows.

    Raises
    ------
    FileError
        If the file cannot be opened.
    LogError
        With every fault of a part.
    """
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
    """Find how a text file is written.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    file : TextFile
        Its encoding and dialect.

    Raises
    ------
    FileError
        If the file cannot be opened.
    LogError
        If it is empty or no text.
    """
    begin = head(path, _SAMPLE)
    encoding, notes = encoding_of(begin, str(path))
    lines = _LINE.split(begin.rstrip(b"\0").decode(encoding, errors="replace"))
    if len(begin) == _SAMPLE and len(lines) > 1:
        lines.pop()
    dialect = find_dialect(lines, str(path))
    return TextFile(path, encoding, dialect, tuple(notes), quoted='"' in "".join(lines))
