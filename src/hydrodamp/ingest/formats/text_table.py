"""A text file of columns, and the columns read from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.ingest.formats.cells import Column
from hydrodamp.ingest.formats.dialect import Dialect
from hydrodamp.ingest.formats.encoding import encoding_throughout

COMMENTS = ("#", "%", "//")
"""How a line begins that holds no row."""

_LISTED = 3


class OddTextError(Exception):
    """Text that the fast reader leaves to the careful one; never seen by a user."""


@dataclass(frozen=True)
class TextFile:
    """A file and how it is written."""

    path: str | Path
    encoding: str
    dialect: Dialect
    notes: tuple[str, ...] = ()
    quoted: bool = True


@dataclass(frozen=True, eq=False)
class TextColumns:
    """Columns of some rows of a file."""

    columns: tuple[Column, ...]
    lines: Sequence[int]
    skipped: int = 0
    notes: tuple[str, ...] = field(default=())

    @property
    def n(self) -> int:
        """The number of rows."""
        return len(self.lines)

    def recording(self, file: TextFile, form: str) -> Recording:
        """Return the columns as a recording of one topic."""
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
    """Return a file with the encoding that holds to its end."""
    encoding, notes = encoding_throughout(file.path, file.encoding)
    return replace(file, encoding=encoding, notes=(*file.notes, *notes))
