"""The package's own CSV, both ways: header names, SI units, forward-starboard-down.

::

    time [s]
    roll pitch yaw [rad], or qw qx qy qz      attitude, body to north-east-down;
                                              yaw alone where only u v r are recorded
    u v w [m/s]  p q r [rad/s]                body velocity
    du dv dw dp dq dr                         optional: its derivative
    X Y Z [N]  K M N [N m]                    optional: actuator wrench
    eta                                       optional: propulsion ratio
    north east down [m]                       optional: position
    fx fy fz [m/s^2]                          optional: specific force, body axes
    segment                                   optional: an id, a change is a join
    any other name                            a command, held until the next row
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES, VELOCITIES
from hydrodamp.data.checks import faults_of
from hydrodamp.data.columns import (
    ACCELERATIONS,
    EULER,
    POSITION,
    QUATERNION,
    SPECIFIC_FORCE,
    Columns,
)
from hydrodamp.data.log import Log
from hydrodamp.data.table import Table, read_table
from hydrodamp.errors import LogError
from hydrodamp.saving import replacing

RESERVED = (
    "time",
    *EULER,
    *QUATERNION,
    *VELOCITIES,
    *ACCELERATIONS,
    "eta",
    "segment",
    *AXES,
    *POSITION,
    *SPECIFIC_FORCE,
)
"""Column names with a meaning of their own; any other is a command."""

_CHUNK = 65536


def read_canonical(path: str | Path) -> Log:
    """Read a log in canonical CSV.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    log : Log
        Split where ``segment`` changes, at gaps and at missing values.

    Raises
    ------
    FileError
        If the file cannot be opened.
    LogError
        With every fault of the file.

    Warns
    -----
    GapWarning
        Once, if a gap or missing values split the log.
    """
    table = read_table(path, texts=("segment",))
    commands = tuple(name for name in table.numbers if name and name not in RESERVED)
    columns = Columns(
        table.numbers, commands, table.texts.get("segment"), table.lines, table.source
    )
    return log_of(table, columns, [*_name_faults(table.names)])


def log_of(table: Table, columns: Columns, faults: list[str]) -> Log:
    """Return the log of columns read from a table, or raise all faults of both.

    Parameters
    ----------
    table : Table
        What was read.
    columns : Columns
        The columns by their reserved names.
    faults : list of str
        Faults found so far, besides those of the table.

    Returns
    -------
    log : Log
        If there is no fault.

    Raises
    ------
    LogError
        With every fault.
    """
    faults = [*table.faults, *faults]
    if table.numbers:
        faults += columns.faults()
    record = columns.record()
    if record is not None and not faults:
        return Log.from_record(record)
    if record is not None and not table.unreadable:
        faults += faults_of(record)
    raise LogError(faults or ["there are no samples; at least two are needed"], source=table.source)


def write_log(log: Log, path: str | Path) -> None:
    """Write a log as canonical CSV; reading it again gives the same numbers.

    Parameters
    ----------
    log : Log
        The log.
    path : str or Path
        The file; it appears whole or not at all.

    Raises
    ------
    FileError
        If the file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> folder = TemporaryDirectory()
    >>> path = Path(folder.name) / "log.csv"
    >>> write_log(Log(time=[0.0, 0.1], velocity=np.ones((2, 6))), path)
    >>> path.read_text().splitlines()[1]
    '"1",0.0,1.0,1.0,1.0,1.0,1.0,1.0'
    >>> folder.cleanup()
    """
    with replacing(path) as file:
        file.write(",".join(_header(log)) + "\n")
        # Quoted, so that a segment of any name comes back.
        quoted = csv.writer(file, lineterminator="\n", quoting=csv.QUOTE_NONNUMERIC)
        quoted.writerows(_rows(log))


def _header(log: Log) -> list[str]:
    return ["segment", *(name for names, _ in _blocks(log) for name in names)]


def _blocks(log: Log) -> list[tuple[tuple[str, ...], FloatArray]]:
    """Return the names and numbers of what the log holds, side by side."""
    recorded = [VELOCITIES.index(name) for name in log.velocity_names]
    blocks: list[tuple[tuple[str, ...], FloatArray]] = [(("time",), log.time[:, np.newaxis])]
    if log.attitude is not None:
        blocks.append((QUATERNION, log.attitude))
    blocks.append((log.velocity_names, log.velocity[:, recorded]))
    if log.acceleration is not None:
        names = tuple(ACCELERATIONS[index] for index in recorded)
        blocks.append((names, log.acceleration[:, recorded]))
    if log.propulsion_ratio is not None:
        blocks.append((("eta",), log.propulsion_ratio[:, np.newaxis]))
    if log.wrench is not None:
        blocks.append((AXES, log.wrench))
    if log.position is not None:
        blocks.append((POSITION, log.position))
    if log.specific_force is not None:
        blocks.append((SPECIFIC_FORCE, log.specific_force))
    blocks.append((log.command_names, log.commands))
    return blocks


def _rows(log: Log) -> Iterator[list[object]]:
    """Yield one row a sample."""
    blocks = _blocks(log)
    for part in log.segments:
        for start in range(part.start, part.stop, _CHUNK):
            rows = slice(start, min(start + _CHUNK, part.stop))
            for row in np.column_stack([block[rows] for _, block in blocks]).tolist():
                yield [part.name, *row]


def _name_faults(names: tuple[str, ...]) -> Iterator[str]:
    """Say which names are empty, or a reserved one (but `time`, missed anyway) in other case."""
    for place, name in enumerate(names, start=1):
        if not name:
            yield f"column {place} has no name; drop it (pandas: `to_csv(..., index=False)`)"
        lower = name.lower()
        if len(name) > 1 and name != lower and lower in RESERVED[1:] and lower not in names:
            yield f"column `{name}` must be spelt `{lower}`; names keep their case"
