"""The canonical form of a log: named columns in SI units, written as CSV or Parquet."""

from __future__ import annotations

import csv
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.term import AXES, VELOCITIES
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
from hydrodamp.data.plausibility import FULL_TURN, find_absurd, mask_absurd
from hydrodamp.data.record import Record, command_faults, stack_columns
from hydrodamp.errors import FileError, did_you_mean
from hydrodamp.files import open_atomic
from hydrodamp.progress import progress

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
    """Return the record of named columns in SI units and canonical axes, and its faults."""
    numbers = mask_absurd(numbers, numbers.get("time", np.empty(0)), source)
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
        present = [name in numbers for name in block.columns]
        if block.name == "velocity" or (all(present) if block.is_whole else any(present)):
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
        The file, written atomically. A name that ends in ``.parquet`` gives Parquet, any other
        CSV.

    Raises
    ------
    FileError
        If the file cannot be written, or its suffix is not known.

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
        # The segment is last: a name in front could be read as a comment.
        file.write(",".join((*columns, SEGMENT)) + "\n")
        write = csv.writer(file, quoting=csv.QUOTE_NONNUMERIC, lineterminator="\n").writerows
        for segment in log.segments:
            for start in range(segment.start, segment.stop, _CHUNK_ROWS):
                rows = slice(start, min(start + _CHUNK_ROWS, segment.stop))
                table = np.column_stack([values[rows] for values in columns.values()])
                write([*row, segment.name] for row in table.tolist())
                step(len(table))


def check_log_file(path: str | Path) -> None:
    """Refuse a file name whose suffix is not a format of logs."""
    if (suffix := Path(path).suffix.lower()) not in (*_TEXT_SUFFIXES, *_PARQUET_SUFFIXES):
        fault = f"{path}: a log is written as CSV or Parquet, not as '{suffix}'"
        raise FileError(f"{fault}. Give a name that ends in .csv or .parquet")


def _write_parquet(log: Log, columns: Mapping[str, FloatArray], path: str | Path) -> None:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError as error:
        advice = 'Install it by `pip install "hydrodamp[logs]"`, or write a .csv file'
        raise FileError(f"{path}: Parquet needs pyarrow. {advice}") from error
    labels = [segment.name for segment in log.segments for _ in range(len(segment))]
    metadata = {name: {"unit": unit_of(name)} for name in columns if QUANTITIES.get(name)}
    number = pyarrow.float64()
    fields = [pyarrow.field(name, number, metadata=metadata.get(name)) for name in columns]
    schema = pyarrow.schema([*fields, (SEGMENT, pyarrow.string())], metadata=_FRAMES)
    table = pyarrow.table([*columns.values(), labels], schema=schema)
    with open_atomic(path, binary=True) as file:
        parquet.write_table(table, file)


def columns_of(log: Log) -> dict[str, FloatArray]:
    """Return the columns of a log by name, without velocities not recorded."""
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
    by_lower = {column.lower(): column for column in numbers}
    matches = [column for low, column in by_lower.items() if low in ("t", name) or name in low]
    return f" Did you mean '{matches[0]}'?" if matches else did_you_mean(name, numbers)


def _attitude_faults(numbers: Mapping[str, FloatArray]) -> Iterator[str]:
    angles = [name for name in EULER if name in numbers]
    quaternion = [name for name in ATTITUDE.columns if name in numbers]
    if angles and quaternion:
        both = f"`{' '.join(angles)}` and `{' '.join(quaternion)}`"
        yield f"attitude must be given once; got both {both}. Drop one set"
    if any(is_in_degrees(name, numbers[name]) for name in angles):
        yield f"`{' '.join(angles)}` must be in rad; its range indicates degrees. {_CONVERT_ADVICE}"


def _incomplete_group_faults(numbers: Mapping[str, FloatArray]) -> Iterator[str]:
    planar = not any(name in numbers for name in (*EULER[:2], "w", "p", "q"))
    wrench = ("X", "Y", "N") if planar else AXES
    for group in (EULER, wrench, *(block.columns for block in BLOCKS if block.is_whole)):
        present = [name for name in group if name in numbers]
        absent = [name for name in group if name not in numbers]
        if present and absent and not (group == EULER and planar):
            hints = "".join(_suggest_name(name, set(numbers) - set(group)) for name in absent)
            remark = " Only a planar log, of u v r alone, may have yaw by itself"
            yield (
                f"`{' '.join(group)}` belong together; `{' '.join(absent)}` is missing next to "
                f"`{' '.join(present)}`.{hints} Add it, drop the others, or rename a command of"
                f" this name.{remark if present == ['yaw'] else ''}"
            )


def is_in_degrees(name: str, angle: FloatArray) -> bool:
    """Return whether an angle is in degrees: a pitch beyond a full turn, or a wrap by 360."""
    angle = angle[~find_absurd(angle, FULL_TURN)] if name == "pitch" else angle
    wrap = np.abs(np.diff(angle))
    exceeds = np.abs(angle) > FULL_TURN if name == "pitch" else (wrap > 340) & (wrap < 380)
    return bool(exceeds.any())


def _column_faults(numbers: Mapping[str, FloatArray]) -> Iterator[str]:
    moving = {f"d{name}" for name in VELOCITIES if name in numbers}
    if surplus := [name for name in ACCELERATION.columns if name in numbers and name not in moving]:
        yield f"accelerations `{' '.join(surplus)}` have no velocity column; add it or drop them"
    for name, column in numbers.items():
        if name != "time" and len(column) and np.isnan(column).all():
            yield f"column `{name}` holds no number; drop it"
