"""The canonical form: columns by their names in SI units, as a record; and a log as such a file."""

from __future__ import annotations

import csv
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.atoms import AXES, VELOCITIES
from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.data.channels import (
    ACCELERATION,
    ATTITUDE,
    BLOCKS,
    EULER,
    QUANTITIES,
    SEGMENT,
    unit_of,
)
from hydrodamp.data.log import Log
from hydrodamp.data.record import Record, command_faults, stack_columns
from hydrodamp.errors import FileError, did_you_mean
from hydrodamp.files import open_atomic
from hydrodamp.progress import progress

_FULL_TURN_RAD = 2 * np.pi
_CONVERT_ADVICE = "Convert, or give a mapping with unit: deg"
_CHUNK_ROWS = 8192
_TEXT_SUFFIXES = ("", ".csv", ".txt", ".dat")
_PARQUET_SUFFIXES = (".parquet", ".pq")
_FRAMES = {"body": "forward-starboard-down", "world": "north-east-down"}


def record_of_columns(
    numbers: Mapping[str, FloatArray],
    commands: Sequence[str] = (),
    labels: tuple[str, ...] | None = None,
    lines: Sequence[int] | None = None,
    source: str = "",
    run: IntArray | None = None,
) -> tuple[Record | None, list[str]]:
    """Return the record of named columns in SI units and our axes, and all that is wrong."""
    faults = [
        *_attitude_faults(numbers),
        *_incomplete_group_faults(numbers),
        *_column_faults(numbers),
        *command_faults(commands),
    ]
    if (time := numbers.get("time")) is None:
        missing = f"column `time` is missing.{_suggest_name('time', numbers)} Rename it, or give a"
        draft = "mapping: `hydrodamp probe LOG --draft mapping.yaml` writes one"
        return None, [f"{missing} {draft}", *faults]
    if len(time) == 0:
        return None, faults
    blocks = {}
    absent = {f"d{name}": np.full(len(time), np.nan) for name in VELOCITIES if name in numbers}
    for block in BLOCKS:
        there = [name in numbers for name in block.columns]
        if block.name == "velocity" or (all(there) if block.is_whole else any(there)):
            stacked = stack_columns({**absent, **numbers}, block.columns, len(time))
            blocks[block.name] = stacked if block.shape else stacked[:, 0]
    if "attitude" not in blocks and "yaw" in numbers:
        blocks["attitude"] = quaternion_from_euler(stack_columns(numbers, EULER, len(time)))
    blocks["commands"] = stack_columns(numbers, commands, len(time))
    names = tuple(name for name in VELOCITIES if name in numbers)
    return Record(blocks, names, tuple(commands), labels, run, lines, source), faults


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
    columns = columns_of(log)
    if Path(path).suffix.lower() in _PARQUET_SUFFIXES:
        _write_parquet(log, columns, path)
        return
    with open_atomic(path) as file, progress("writing the log", log.n) as step:
        # The segment is last: a name in front might be taken for a comment.
        file.write(",".join((*columns, SEGMENT)) + "\n")
        write = csv.writer(file, quoting=csv.QUOTE_NONNUMERIC, lineterminator="\n").writerows
        for part in log.segments:
            for start in range(part.start, part.stop, _CHUNK_ROWS):
                rows = slice(start, min(start + _CHUNK_ROWS, part.stop))
                table = np.column_stack([values[rows] for values in columns.values()])
                write([*row, part.name] for row in table.tolist())
                step(len(table))


def check_log_file(path: str | Path) -> None:
    """Refuse a file name that says another format than a log is written in."""
    if (suffix := Path(path).suffix.lower()) not in (*_TEXT_SUFFIXES, *_PARQUET_SUFFIXES):
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
            f'{path}: Parquet needs pyarrow. Install it by `pip install "hydrodamp[logs]"`, or'
            " write a .csv file"
        ) from error
    labels = np.repeat([part.name for part in log.segments], [len(part) for part in log.segments])
    said = {name: {"unit": unit_of(name)} for name in columns if QUANTITIES.get(name)}
    number = pyarrow.float64()
    fields = [pyarrow.field(name, number, metadata=said.get(name)) for name in columns]
    schema = pyarrow.schema([*fields, (SEGMENT, pyarrow.string())], metadata=_FRAMES)
    table = pyarrow.table([*columns.values(), labels], schema=schema)
    with open_atomic(path, binary=True) as file:
        parquet.write_table(table, file)


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
        elif np.isnan(columns.get(f"d{name}", 0.0)).all():
            columns.pop(f"d{name}", None)
    return columns | dict(zip(log.command_names, log.commands.T, strict=True))


def _suggest_name(name: str, numbers: Collection[str]) -> str:
    by_lower = {other.lower(): other for other in numbers}
    starts = [other for low, other in by_lower.items() if low in ("t", name) or name in low]
    return f" Did you mean '{starts[0]}'?" if starts else did_you_mean(name, numbers)


def _attitude_faults(numbers: Mapping[str, FloatArray]) -> Iterator[str]:
    angles, parts = (
        [name for name in group if name in numbers] for group in (EULER, ATTITUDE.columns)
    )
    if angles and parts:
        yield (
            f"attitude must be given once; got both `{' '.join(angles)}` and `{' '.join(parts)}`."
            " Drop one set"
        )
    if any(is_in_degrees(name, numbers[name]) for name in angles):
        yield f"`{' '.join(angles)}` must be in rad; angles in degrees run so. {_CONVERT_ADVICE}"


def _incomplete_group_faults(numbers: Mapping[str, FloatArray]) -> Iterator[str]:
    planar = not any(name in numbers for name in (*EULER[:2], "w", "p", "q"))
    wrench = ("X", "Y", "N") if planar else AXES
    for group in (EULER, wrench, *(block.columns for block in BLOCKS if block.is_whole)):
        there = [name for name in group if name in numbers]
        absent = [name for name in group if name not in numbers]
        if there and absent and not (group == EULER and planar):
            hints = "".join(_suggest_name(name, set(numbers) - set(group)) for name in absent)
            alone = " Only a planar log, of u v r alone, may have yaw by itself"
            yield (
                f"`{' '.join(group)}` belong together; `{' '.join(absent)}` is missing beside "
                f"`{' '.join(there)}`.{hints} Add it, drop the others, or rename a command of that"
                f" name.{alone if there == ['yaw'] else ''}"
            )


def is_in_degrees(name: str, angle: FloatArray) -> bool:
    """Return whether an angle is in degrees: a pitch beyond any turn, or a wrap by 360."""
    wrap = np.abs(np.diff(angle))
    beyond = np.abs(angle) > _FULL_TURN_RAD if name == "pitch" else (wrap > 340) & (wrap < 380)
    return bool(beyond.any())


def _column_faults(numbers: Mapping[str, FloatArray]) -> Iterator[str]:
    moving = {f"d{name}" for name in VELOCITIES if name in numbers}
    if surplus := [name for name in ACCELERATION.columns if name in numbers and name not in moving]:
        yield f"accelerations `{' '.join(surplus)}` have no velocity column; add it or drop them"
    for name, column in numbers.items():
        if name != "time" and len(column) and np.isnan(column).all():
            yield f"column `{name}` holds no number at all; drop it"
