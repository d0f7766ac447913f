"""How the columns of another log become those of the canonical form.

A mapping is a YAML file. Every entry on the right is the name of a column, or a
table ``{column, unit, sign, hold}``::

    frame: FLU                     # axes of body and world: FRD (default) or FLU
    time: {column: t_ms, unit: ms}
    attitude:                      # roll pitch yaw, or qw qx qy qz; yaw alone with u v r
      roll: roll_rad
      pitch: {column: pitch_deg, unit: deg, sign: -1}
      yaw: yaw_rad
    velocity: {u: u, v: v, w: w, p: p, q: q, r: r}
    commands: {rudder: {column: delta_deg, unit: deg, hold: true}}
    acceleration: {du: ax}         # optional, as are wrench {X ... N}, eta, segment

``sign`` is applied before the frame is turned. ``hold`` fills empty cells with
the last value. Columns that are not mapped are ignored.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES, VELOCITIES
from hydrodamp.data.canonical import log_of
from hydrodamp.data.columns import ACCELERATIONS, Columns
from hydrodamp.data.entries import FRAMES, Entry, entries_of
from hydrodamp.data.log import Log
from hydrodamp.data.table import Table, read_table
from hydrodamp.errors import LogError, did_you_mean
from hydrodamp.loading import load_yaml

_FLIPPED = frozenset(
    [
        *("pitch", "yaw", "qy", "qz"),
        *(group[index] for group in (VELOCITIES, ACCELERATIONS, AXES) for index in (1, 2, 4, 5)),
    ]
)
"""What changes sign between FLU and FRD: both frames turn by pi about x."""


@dataclass(frozen=True)
class LogMapping:
    """Which column of a log becomes which of the canonical form, and how.

    Attributes
    ----------
    entries : tuple of Entry
        One for every canonical column.
    frame : str
        Axes of the log: ``FRD`` (body forward-starboard-down, world z down) or
        ``FLU`` (body forward-port-up, world z up; heading counted from x towards y).
    segment : str or None
        The column that names the segments.
    source : str
        The mapping's file.
    """

    entries: tuple[Entry, ...]
    frame: str = "FRD"
    segment: str | None = None
    source: str = ""

    @classmethod
    def from_dict(cls, content: object, source: str = "mapping") -> LogMapping:
        """Return the mapping that the content of a YAML file describes.

        Parameters
        ----------
        content : dict
            As in the module's docstring.
        source : str, optional
            How messages call it.

        Returns
        -------
        mapping : LogMapping
            Checked.

        Raises
        ------
        LogError
            With every unknown key, unit, sign and frame.

        Examples
        --------
        >>> mapping = LogMapping.from_dict({"time": "t", "velocity": {"u": "speed"}})
        >>> [entry.column for entry in mapping.entries]
        ['t', 'speed']
        """
        entries, faults = entries_of(content)
        if faults or not isinstance(content, dict):
            raise LogError(faults, source=source)
        return cls(entries, content.get("frame", FRAMES[0]), content.get("segment"), source)

    def read(self, path: str | Path) -> Log:
        """Read a log in comma-separated text through this mapping.

        Parameters
        ----------
        path : str or Path
            The file.

        Returns
        -------
        log : Log
            In SI units, forward-starboard-down and north-east-down.

        Raises
        ------
        FileError
            If the file cannot be opened.
        LogError
            With every fault of the file, columns that are absent included.

        Warns
        -----
        GapWarning
            Once, if a gap or missing values split the log.
        """
        wanted = {entry.column for entry in self.entries} - {self.segment}
        table = read_table(path, wanted, () if self.segment is None else (self.segment,))
        if absent := [*self._absent(table)]:
            raise LogError([*table.faults, *absent], source=table.source)
        columns = Columns(
            {entry.name: self._column(entry, table) for entry in self._readable(table)},
            tuple(entry.name for entry in self._readable(table) if entry.is_command),
            None if self.segment is None else table.texts.get(self.segment),
            table.lines,
            table.source,
        )
        return log_of(table, columns, [])

    def _readable(self, table: Table) -> list[Entry]:
        return [entry for entry in self.entries if entry.column in table.numbers]

    def _absent(self, table: Table) -> Iterator[str]:
        """Name the columns that the mapping asks for and the header lacks."""
        if not table.names:
            return
        asked = [(entry.name, entry.column) for entry in self.entries]
        asked += [] if self.segment is None else [("segment", self.segment)]
        for name, column in asked:
            if column not in table.names:
                yield (
                    f"there is no column `{column}`, which {self.source} takes for `{name}`."
                    f"{did_you_mean(column, table.names)}"
                )

    def _column(self, entry: Entry, table: Table) -> FloatArray:
        """Return a column in SI units and our axes."""
        flip = (
            -1.0 if self.frame == "FLU" and entry.name in _FLIPPED and not entry.is_command else 1.0
        )
        values = table.numbers[entry.column] * (flip * entry.factor)
        return _held(values) if entry.hold else values


def read_mapping(path: str | Path) -> LogMapping:
    """Read a mapping from its YAML file.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    mapping : LogMapping
        Checked.

    Raises
    ------
    FileError
        If the file cannot be read, or is no YAML: with the line.
    LogError
        With everything wrong in it.
    """
    return LogMapping.from_dict(load_yaml(path), str(path))


def _held(values: FloatArray) -> FloatArray:
    """Fill NaN with the last value before it."""
    last = np.maximum.accumulate(np.where(np.isnan(values), 0, np.arange(len(values))))
    return values[last]
