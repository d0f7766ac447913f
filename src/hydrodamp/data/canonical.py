"""The canonical form of a log: named columns in SI units, written as CSV or Parquet."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.channels import QUANTITIES, SEGMENT, unit_of
from hydrodamp.data.log import Log, columns_of
from hydrodamp.errors import FileError
from hydrodamp.files import open_atomic
from hydrodamp.progress import progress

_CHUNK_ROWS = 8192
_TEXT_SUFFIXES = ("", ".csv", ".txt", ".dat")
_PARQUET_SUFFIXES = (".parquet", ".pq")
_FRAMES = {"body": "forward-starboard-down", "world": "north-east-down"}


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
