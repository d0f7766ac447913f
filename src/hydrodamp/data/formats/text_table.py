"""A text file of columns, and the columns read from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from hydrodamp.data.formats.cells import Column
from hydrodamp.data.formats.dialect import Dialect
from hydrodamp.data.formats.encoding import encoding_throughout
from hydrodamp.data.recording import Recording, Topic

COMMENTS = ("#", "%", "//")
"""How a line begins that holds no row."""

_LISTED = 3


class OddTextError(Exception):
    """Text that the fast reader leaves to the careful one; never seen by a user."""


@dataclass(frozen=True)
class TextFile:
    """A file and how it is written.

    Attributes
    ----------
    path : str or Path
        The file.
    encoding : str
        As Python calls it.
    dialect : Dialect
        Delimiter, decimal sign and header.
    notes : tuple of str
        What was met so far.
    quoted : bool
        Whether there are quotation marks in its first lines.
    """

    path: str | Path
    encoding: str
    dialect: Dialect
    notes: tuple[str, ...] = ()
    quoted: bool = True


@dataclass(frozen=True, eq=False)
class TextColumns:
    """Columns of some rows of a file.

    Attributes
    ----------
    columns : tuple of Column
        In the order of the names.
    lines : sequence of int
        The line of the file of each row.
    skipped : int
        How many rows come before the first.
    notes : tuple of str
        What was met, a sentence each.
    """

    columns: tuple[Column, ...]
    lines: Sequence[int]
    skipped: int = 0
    notes: tuple[str, ...] = field(default=())

    @property
    def n(self) -> int:
        """The number of rows."""
        return len(self.lines)

    def recording(self, file: TextFile, form: str) -> Recording:
        """Return the columns as a recording of one topic.

        Parameters
        ----------
        file : TextFile
            Where they were read.
        form : str
            How messages call the format.

        Returns
        -------
        recording : Recording
            Of one topic without a name and without a clock.
        """
        dialect = file.dialect
        named = dict(zip(dialect.names, self.columns, strict=True))
        bad = {name: self._fault(name, column) for name, column in named.items() if column.bad}
        dated = {name: column.unit for name, column in named.items() if column.unit}
        notes = [*file.notes, *dialect.notes, *self.notes, *bad.values()]
        notes += [f"column `{name}` holds dates, read in seconds since 1970" for name in dated]
        clean = {name: col.numbers for name, col in named.items() if name not in bad}
        topic = Topic(
            "",
            None,
            {name: numbers for name, numbers in clean.items() if numbers is not None},
            {name: col.words for name, col in named.items() if col.numbers is None or col.words},
            {**dialect.units, **dated},
            {**bad, **dialect.faults},
            self.lines,
        )
        return Recording((topic,), str(file.path), form, tuple(notes))

    def _fault(self, name: str, column: Column) -> str:
        """Return a sentence on the cells of a column that are no numbers."""
        told = [
            f"{cell!r} in row {self.skipped + row + 1} (line {self.lines[row]})"
            for row, cell in column.bad[:_LISTED]
        ]
        more = len(column.bad) - _LISTED
        tail = f" and {more} more" if more > 0 else ""
        return f"column `{name}` must hold numbers; got {', '.join(told)}{tail}"


def throughout(file: TextFile) -> TextFile:
    """Return a file with the encoding that holds to its end.

    Parameters
    ----------
    file : TextFile
        As found at its start.

    Returns
    -------
    file : TextFile
        With another encoding, and a note, where that found fails further down.

    Raises
    ------
    FileError
        If the file cannot be opened.
    """
    encoding, notes = encoding_throughout(file.path, file.encoding)
    return replace(file, encoding=encoding, notes=(*file.notes, *notes))
