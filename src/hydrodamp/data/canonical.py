"""The canonical form: columns by their names in SI units, as a record; and a log as such a file."""

from __future__ import annotations

import unicodedata
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import VELOCITIES
from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.data.channels import ACCELERATION, ATTITUDE, BLOCKS, EULER, SEGMENT
from hydrodamp.data.log import Log
from hydrodamp.data.record import Record, command_faults, side_by_side
from hydrodamp.errors import FileError, LogError, did_you_mean
from hydrodamp.files import replacing
from hydrodamp.progress import progress

_QUATERNION, _ACCELERATIONS = ATTITUDE.columns, ACCELERATION.columns
_TURN = 2 * np.pi
_CONVERT = "Convert, or give a mapping with unit: deg"
_CHUNK = 8192
_TEXT = ("", ".csv", ".txt", ".dat")
_PARQUET = (".parquet", ".pq")


def record_of_columns(
    numbers: Mapping[str, FloatArray],
    commands: Sequence[str] = (),
    labels: tuple[str, ...] | None = None,
    lines: Sequence[int] | None = None,
    source: str = "",
) -> tuple[Record | None, list[str]]:
    """Return the record of named columns in SI units and our axes, and all that is wrong."""
    turned = [*_attitude_faults(numbers)]
    faults = [
        *_missing_faults(numbers),
        *turned,
        *_acceleration_faults(numbers),
        *_whole_faults(numbers),
        *command_faults(commands),
        *_empty_faults(numbers),
    ]
    time = numbers.get("time")
    if time is None or len(time) == 0 or turned:
        return None, faults
    blocks = {}
    for block in BLOCKS:
        if block.name == "velocity" or any(name in numbers for name in block.columns):
            stacked = side_by_side(numbers, block.columns, len(time))
            blocks[block.name] = stacked if block.shape else stacked[:, 0]
    if "attitude" not in blocks and "yaw" in numbers:
        blocks["attitude"] = quaternion_from_euler(side_by_side(numbers, EULER, len(time)))
    return Record(
        blocks,
        tuple(name for name in VELOCITIES if name in numbers),
        {name: numbers[name] for name in commands},
        labels,
        lines,
        source,
    ), faults


def write_log(log: Log, path: str | Path) -> None:
    """Write a log in the canonical form; reading it again gives the same numbers.

    Parameters
    ----------
    log : Log
        The log.
    path : str or Path
        The file; it appears whole or not at all. A name that ends in ``.parquet`` gives Parquet,
        any other text in columns.

    Raises
    ------
    FileError
        If the file cannot be written, or its name ends in what is neither.
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
    check_log_file(path)
    _check_names(log)
    columns = columns_of(log)
    if Path(path).suffix.lower() in _PARQUET:
        _write_parquet(log, columns, path)
        return
    with replacing(path) as file:
        # The segment is last: a name in front might be taken for a comment.
        file.write(",".join((*columns, SEGMENT)) + "\n")
        file.writelines(_lines(columns, log))


def check_log_file(path: str | Path) -> None:
    """Refuse a file name that says another format than a log is written in."""
    suffix = Path(path).suffix.lower()
    if suffix not in (*_TEXT, *_PARQUET):
        raise FileError(
            f"{path}: a log is written as CSV or Parquet, not as '{suffix}'. Give a name that ends"
            " in .csv or .parquet"
        )


def _write_parquet(log: Log, columns: Mapping[str, FloatArray], path: str | Path) -> None:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError as error:
        raise FileError(
            f"{path}: Parquet needs pyarrow. Install it by `pip install 'hydrodamp[logs]'`, or"
            " write a .csv file"
        ) from error
    labels = np.repeat([part.name for part in log.segments], [len(part) for part in log.segments])
    table = pyarrow.table({**columns, SEGMENT: labels})
    with replacing(path, binary=True) as file:
        parquet.write_table(table, file)


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


def columns_of(log: Log) -> dict[str, FloatArray]:
    """Return what a log holds by the names of columns, without velocities not recorded."""
    columns: dict[str, FloatArray] = {}
    for block in BLOCKS:
        values = getattr(log, block.name)
        if values is not None:
            columns |= dict(zip(block.columns, values.reshape(log.n, -1).T, strict=True))
    for name in VELOCITIES:
        if name not in log.velocity_names:
            del columns[name]
            columns.pop(f"d{name}", None)
    return columns | dict(zip(log.command_names, log.commands.T, strict=True))


def _lines(columns: Mapping[str, FloatArray], log: Log) -> Iterator[str]:
    """Yield one line a sample, the segment quoted so that any name comes back."""
    with progress("writing the log", log.n) as step:
        for part in log.segments:
            name = '"' + part.name.replace('"', '""') + '"'
            for start in range(part.start, part.stop, _CHUNK):
                rows = slice(start, min(start + _CHUNK, part.stop))
                for row in np.column_stack([values[rows] for values in columns.values()]).tolist():
                    yield f"{','.join(map(repr, row))},{name}\n"
                step(rows.stop - rows.start)


def _missing_faults(numbers: Mapping[str, FloatArray]) -> Iterator[str]:
    if "time" not in numbers:
        yield (
            f"column `time` is missing.{_nearest('time', numbers)} Rename it, or give a mapping: "
            "`hydrodamp probe LOG --draft mapping.yaml` writes one"
        )
    if not any(name in numbers for name in VELOCITIES):
        listed = " ".join(numbers)
        yield f"there is no velocity column: none of u v w p q r among {listed or 'no columns'}"


def _nearest(name: str, numbers: Collection[str]) -> str:
    by_lower = {other.lower(): other for other in numbers}
    starts = [other for low, other in by_lower.items() if low in ("t", name) or name in low]
    return f" Did you mean '{starts[0]}'?" if starts else did_you_mean(name, numbers)


def _attitude_faults(numbers: Mapping[str, FloatArray]) -> Iterator[str]:
    found = [[name for name in group if name in numbers] for group in (EULER, _QUATERNION)]
    if all(found):
        both = " ".join(found[0]), " ".join(found[1])
        yield f"attitude must be given once; got both `{both[0]}` and `{both[1]}`. Drop one set"
        return
    # A planar log: of the angles yaw alone, of the velocities none but u v r.
    tilted = (*EULER[:2], *_QUATERNION, "w", "p", "q")
    if "yaw" in numbers and not any(name in numbers for name in tilted):
        if runs_in_degrees("yaw", numbers["yaw"]):
            yield "`yaw` must be in rad; it runs as an angle in degrees does. " + _CONVERT
        return
    for group, there in zip((EULER, _QUATERNION), found, strict=True):
        if there and len(there) < len(group):
            absent = [name for name in group if name not in there]
            hints = "".join(_nearest(name, set(numbers) - set(group)) for name in absent)
            all_of, lacking = " ".join(group), " ".join(absent)
            planar = " Only a planar log, of u v r alone, may have yaw by itself"
            yield f"attitude needs all of `{all_of}`; `{lacking}` is missing.{hints}" + (
                planar if there == ["yaw"] and not hints else ""
            )
    if len(found[0]) == len(EULER) and any(runs_in_degrees(name, numbers[name]) for name in EULER):
        yield ("`roll pitch yaw` must be in rad; they run as angles in degrees do. " + _CONVERT)


def runs_in_degrees(name: str, angle: FloatArray) -> bool:
    """Return whether an angle is in degrees: a pitch beyond any turn, or a wrap by 360."""
    if name == "pitch":
        return bool((np.abs(angle) > _TURN).any())
    wrap = np.abs(np.diff(angle))
    return bool(((wrap > 340) & (wrap < 380)).any())


def _acceleration_faults(numbers: Mapping[str, FloatArray]) -> Iterator[str]:
    there = [name for name in _ACCELERATIONS if name in numbers]
    needed = [f"d{name}" for name in VELOCITIES if name in numbers]
    if there and (absent := [name for name in needed if name not in there]):
        listed, velocities = " ".join(there), " ".join(name.removeprefix("d") for name in absent)
        yield (
            f"accelerations must be given for every velocity recorded; `{' '.join(absent)}` is"
            f" missing beside `{listed}`. Add it, or drop `{listed}` (velocities are then"
            f" differentiated) or the velocities `{velocities}`"
        )
    if surplus := [name for name in there if name not in needed]:
        yield f"accelerations `{' '.join(surplus)}` have no velocity column; add it or drop them"


def _whole_faults(numbers: Mapping[str, FloatArray]) -> Iterator[str]:
    for group in (block.columns for block in BLOCKS if block.is_whole):
        there = [name for name in group if name in numbers]
        if there and len(there) < len(group):
            absent = " ".join(name for name in group if name not in there)
            yield (
                f"`{' '.join(group)}` belong together; `{absent}` is missing beside "
                f"`{' '.join(there)}`. Add it, drop the others, or rename a command of that name"
            )


def _empty_faults(numbers: Mapping[str, FloatArray]) -> Iterator[str]:
    for name, column in numbers.items():
        if name != "time" and len(column) and np.isnan(column).all():
            yield f"column `{name}` holds no number at all; drop it"
