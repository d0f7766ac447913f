"""The canonical form: header names, SI units, forward-starboard-down; and writing it as CSV."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hydrodamp.advance import advance
from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES, VELOCITIES
from hydrodamp.data.channels import RESERVED as RESERVED
from hydrodamp.data.columns import (
    ACCELERATIONS,
    POSITION,
    QUATERNION,
    SPECIFIC_FORCE,
)
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError
from hydrodamp.files import replacing

_CHUNK = 8192


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
    LogError
        If a segment's name holds a line break or another control character.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> folder = TemporaryDirectory()
    >>> path = Path(folder.name) / "log.csv"
    >>> write_log(Log(time=[0.0, 0.1], velocity=np.ones((2, 6))), path)
    >>> path.read_text().splitlines()[1]
    '0.0,1.0,1.0,1.0,1.0,1.0,1.0,"1"'
    >>> folder.cleanup()
    """
    _check_names(log)
    with replacing(path) as file:
        file.write(",".join(_header(log)) + "\n")
        file.writelines(_lines(log))


def _check_names(log: Log) -> None:
    """Refuse names that do not come back from a text in columns."""
    faults = [
        f"the name of segment {part.name!r} cannot stand in a CSV: it must be one line without"
        " control characters. Rename it, or the file it was read from"
        for part in log.segments
        if any(unicodedata.category(letter) == "Cc" for letter in part.name)
    ]
    if faults:
        raise LogError(faults, source=log.source)


def _header(log: Log) -> list[str]:
    """Return the names, the segment last: a name in front might be taken for a comment."""
    return [*(name for names, _ in _blocks(log) for name in names), "segment"]


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


def _lines(log: Log) -> Iterator[str]:
    """Yield one line a sample, the segment quoted so that any name comes back."""
    blocks, by = _blocks(log), advance(log.n)
    for part in log.segments:
        name = '"' + part.name.replace('"', '""') + '"'
        for start in range(part.start, part.stop, _CHUNK):
            rows = slice(start, min(start + _CHUNK, part.stop))
            for row in np.column_stack([block[rows] for _, block in blocks]).tolist():
                yield f"{','.join(map(repr, row))},{name}\n"
            by(rows.stop - rows.start)
