"""Which reader a file needs: by what it begins with, then by its suffix."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from hydrodamp.data.recording import Recording
from hydrodamp.errors import FileError, LogError
from hydrodamp.files import absent, mistaken, parse_yaml
from hydrodamp.ingest.formats import avl
from hydrodamp.ingest.formats.content import content, head, size_of

_HERE = "hydrodamp.ingest.formats"
_HEAD = 4096
_LARGEST_OF_OURS = 1 << 18  # bytes; parsing a file takes a while, and only to refuse it


@dataclass(frozen=True)
class Format:
    """A format that can be read."""

    module: str
    name: str
    suffixes: tuple[str, ...]
    magic: tuple[bytes, ...] = ()

    @property
    def read(self) -> Callable[[str | Path], Recording]:
        """Its reader, imported now."""
        reader: Callable[[str | Path], Recording]
        reader = import_module(f"{_HERE}.{self.module}").read
        return reader


FORMATS = (
    Format("rosbag", "ROS 1 bag", (".bag",), (b"#ROSBAG",)),
    Format("rosbag", "ROS 2 bag (MCAP)", (".mcap",), (b"\x89MCAP",)),
    Format("rosbag", "ROS 2 bag (SQLite)", (".db3",), (b"SQLite format 3\0",)),
    Format("parquet", "Parquet", (".parquet", ".pq"), (b"PAR1",)),
    Format("npz", "NumPy arrays", (".npz", ".npy"), (b"\x93NUMPY",)),
    Format("matlab", "MATLAB or HDF5", (".mat", ".h5", ".hdf5"), (b"MATLAB ", b"\x89HDF")),
    Format("ardupilot", "ArduPilot log", (".bin", ".log"), (b"\xa3\x95",)),
    Format("px4", "PX4 ULog", (".ulg",), (b"ULog\x01\x12\x35",)),
    Format("moos", "MOOS log", (".alog",)),
    Format("lsts", "LSTS log", (".lsf",), (b"\x54\xfe", b"\xfe\x54")),
    Format("avl", "VT/AVL topic", ()),
    Format("delimited", "text in columns", (".csv", ".tsv", ".txt", ".dat", ".asc")),
)
"""All formats, those with a mark first."""

_OURS = (".yaml", ".yml", ".json")
_BY_MODULE = {form.module: form for form in reversed(FORMATS)}
_FOREIGN = {
    ".xls": "a spreadsheet; save the sheet as CSV",
    ".xlsx": "a spreadsheet; save the sheet as CSV",
    ".ods": "a spreadsheet; save the sheet as CSV",
    ".tlog": "a MAVLink telemetry log; convert it with `mavlogdump.py --format csv`, or take the"
    " .bin log of the vehicle itself",
    ".zip": "an archive; unpack it and give the log in it",
    ".7z": "an archive; unpack it and give the log in it",
    ".tar": "an archive; unpack it and give the log in it",
    ".pkl": "a pickle, which may run any program and is never loaded; save the numbers as Parquet",
    ".json": "JSON; save the numbers as CSV or Parquet",
    ".jsonl": "JSON; save the numbers as CSV or Parquet",
    ".yaml": "YAML, as of a vehicle or a mapping; save the numbers as CSV or Parquet",
    ".yml": "YAML, as of a vehicle or a mapping; save the numbers as CSV or Parquet",
}


def format_of(path: str | Path) -> Format:
    r"""Return the format of a file."""
    path = Path(path)
    if not path.exists():
        raise FileError(absent(path))
    if path.is_dir():
        raise FileError(f"{path}: is a folder; give the files in it")
    begin = head(path, _HEAD)
    suffix = _suffix(path)
    if not begin.strip(b"\0\r\n\t "):
        raise LogError(_nothing(begin), source=str(path))
    for form in FORMATS:
        if begin.startswith(form.magic) and form.magic:
            return form
    if begin.startswith((b"PK\x03\x04", b"PK\x05\x06")):
        return _zipped(path, suffix)
    if begin[512:].startswith(b"\x89HDF"):
        return _BY_MODULE["matlab"]
    return _text_format(path, begin, suffix)


def read(path: str | Path) -> Recording:
    """Read one file of any format."""
    return format_of(path).read(path)


def parts(path: str | Path, rows: int = 100_000) -> Iterator[Recording]:
    """Read one file part by part where its format allows it, else whole."""
    form = format_of(path)
    module = import_module(f"{_HERE}.{form.module}")
    if hasattr(module, "parts"):
        yield from module.parts(path, rows)
    else:
        yield form.read(path)


def _suffix(path: Path) -> str:
    name = path.name.lower().removesuffix(".gz")
    return Path(name).suffix


def _nothing(begin: bytes) -> str:
    if begin:
        return "the file holds only zero bytes or blanks; copy it from the vehicle again"
    return "the file is empty; it must begin with a line of column names, or be a log"


def _zipped(path: Path, suffix: str) -> Format:
    if suffix == ".npz":
        return _BY_MODULE["npz"]
    try:
        names = zipfile.ZipFile(path).namelist()
    except zipfile.BadZipFile:
        names = []
    if names and all(name.endswith(".npy") for name in names):
        return _BY_MODULE["npz"]
    raise LogError(f"this is {_FOREIGN.get(suffix, _FOREIGN['.zip'])}", source=str(path))


def _text_format(path: Path, begin: bytes, suffix: str) -> Format:
    """Tell formats of text apart, and binary noise from text."""
    if begin.lstrip().startswith(b"FMT,") or begin.lstrip().startswith(b"FMT ,"):
        return _BY_MODULE["ardupilot"]
    if suffix == ".alog" or (begin.startswith(b"%%") and b"LOGSTART" in begin):
        return _BY_MODULE["moos"]
    if avl.recognised(begin):
        return _BY_MODULE["avl"]
    marked = [form for form in FORMATS if suffix in form.suffixes and form.magic]
    if marked and _is_binary(begin):
        known = " or ".join(repr(mark) for form in marked for mark in form.magic)
        raise LogError(
            f"its name says {marked[0].name}, but it begins with {begin[:8]!r}, not {known}: it is"
            " damaged, or another format under this name",
            source=str(path),
        )
    if suffix in _OURS and (other := _of_ours(path)):
        raise LogError(other)
    if suffix in _FOREIGN:
        raise LogError(f"this is {_FOREIGN[suffix]}", source=str(path))
    if _is_binary(begin) and suffix not in _BY_MODULE["delimited"].suffixes:
        known = ", ".join(
            f"{form.name} ({' '.join(form.suffixes)})" for form in FORMATS if form.suffixes
        )
        raise LogError(
            f"no format known here begins with {begin[:8]!r}. Can be read: {known}",
            source=str(path),
        )
    return _BY_MODULE["delimited"]


def _of_ours(path: Path) -> str:
    """Return what to say of a vehicle, a mapping or a result that is given as a log."""
    if size_of(path) > _LARGEST_OF_OURS:
        return ""
    try:
        text = content(path).decode()
        held = json.loads(text) if path.suffix.lower() == ".json" else parse_yaml(text, str(path))
    except (ValueError, FileError, RecursionError):
        return ""
    return mistaken(held, str(path), "log")


def _is_binary(begin: bytes) -> bool:
    """Tell noise from text by control characters; text in UTF-16 has its mark."""
    if begin.startswith((b"\xff\xfe", b"\xfe\xff")):
        return False
    control = sum(byte < 9 or 13 < byte < 27 for byte in begin.rstrip(b"\0"))
    return control > 0.01 * len(begin)
