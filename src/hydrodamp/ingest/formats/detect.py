"""The one table of formats, and which of them a file has: by its first bytes, then its suffix."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType

from hydrodamp.data.recording import Recording
from hydrodamp.errors import FileError, LogError
from hydrodamp.files import absent, load_json, load_yaml, mistaken
from hydrodamp.ingest.formats.content import head

_HEAD = 4096
_LARGEST_OF_OURS = 1 << 18  # bytes; parsing a file takes a while, and only to refuse it


@dataclass(frozen=True)
class Format:
    """A format: module and function of its reader, its name, suffixes, and how its files begin.

    A format without a mark is known by its suffixes alone.
    """

    module: str
    name: str
    suffixes: tuple[str, ...] = ()
    mark: bytes = b""
    axes: str = ""
    refusal: str = ""
    function: str = "read"

    def reader(self, path: str | Path) -> ModuleType:
        """Return the module that reads the format."""
        if self.refusal:
            raise LogError(self.refusal, source=str(path))
        return import_module(f"hydrodamp.ingest.formats.{self.module}")


_ROS, _AUTOPILOT = "FLU over ENU", "FRD over NED"
_AVL = (
    rb"[^\r\n]*\r?\n[ \t]*time,([^\r\n]*,)?[ \t]*\r?\n"
    rb"[ \t]*([mun]?s(ec)?|(milli|micro|nano)?seconds?),([^\r\n]*,)?[ \t]*(\r?\n|$)"
)
_MATLAB_4 = (
    rb"[\0-\x34]\0\0\0.{8}[\0\1]\0\0\0.\0\0\0[A-Za-z]\w*\0"
    rb"|\0\0[\3\4]..{8}\0\0\0[\0\1]\0\0\0.[A-Za-z]\w*\0"
)
_LSTS = (
    "LSTS logs (.lsf) cannot be read here: no maintained reader exists for Python. Open the log"
    " in Neptus (Mission Review and Analysis), choose `Export to CSV` or `MatLab format .MAT`,"
    " and read what it writes: a folder of CSV files, one a message, is read as topics"
)

#: All formats, those with a mark first.
FORMATS = (
    Format("rosbag", "ROS 1 bag", (".bag",), b"#ROSBAG", _ROS),
    Format("rosbag", "ROS 2 bag (MCAP)", (".mcap",), rb"\x89MCAP", _ROS),
    Format("rosbag", "ROS 2 bag (SQLite)", (".db3",), rb"SQLite format 3\0", _ROS),
    Format("parquet", "Parquet", (".parquet", ".pq"), b"PAR1"),
    Format("arrays", "NumPy arrays", (".npz", ".npy"), rb"\x93NUMPY"),
    Format("arrays", "MATLAB file", (".mat",), b"MATLAB |" + _MATLAB_4),
    Format("arrays", "MATLAB or HDF5 file", (".h5", ".hdf5"), rb"(.{512})?\x89HDF"),
    Format("ardupilot", "ArduPilot log", (".bin", ".log"), rb"\xa3\x95|\s*FMT ?,", _AUTOPILOT),
    Format("px4", "PX4 ULog", (".ulg",), rb"ULog\x01\x12\x35", _AUTOPILOT),
    Format("", "LSTS log", (".lsf",), rb"\x54\xfe|\xfe\x54", refusal=_LSTS),
    Format("moos", "MOOS log", (), b"%%.*LOGSTART"),
    Format("delimited", "VT/AVL topic", (), _AVL, function="read_avl"),
    Format("moos", "MOOS log", (".alog",)),
    Format("delimited", "text in columns", (".csv", ".tsv", ".txt", ".dat", ".asc")),
)

#: How the names of files that can be read end.
SUFFIXES = frozenset(suffix for form in FORMATS for suffix in form.suffixes)

_IN_PARTS = ("text in columns", "Parquet")
_BAG = "metadata.yaml"
_FOREIGN = {
    **dict.fromkeys((".xls", ".xlsx", ".ods"), "a spreadsheet; save the sheet as CSV"),
    **dict.fromkeys((".zip", ".7z", ".tar"), "an archive; unpack it and give the log in it"),
    **dict.fromkeys((".json", ".jsonl"), "JSON; save the numbers as CSV or Parquet"),
    **dict.fromkeys(
        (".yaml", ".yml"), "YAML, as of a vehicle or a mapping; save the numbers as CSV or Parquet"
    ),
    ".tlog": "a MAVLink telemetry log; convert it with `mavlogdump.py --format csv`, or take the"
    " .bin log of the vehicle itself",
    ".pkl": "a pickle, which may run any program and is never loaded; save the numbers as Parquet",
}


def read(path: str | Path) -> Recording:
    """Read one file, or one bag, of any format."""
    form = format_of(path)
    reader = getattr(form.reader(path), form.function)
    with _naming_absent_packages(path):
        recording: Recording = reader(path)
    return recording


def parts(path: str | Path, rows: int) -> Iterator[Recording]:
    """Read one file part by part, for files larger than the memory."""
    form = format_of(path)
    reader = form.reader(path)
    if form.name not in _IN_PARTS:
        raise FileError(
            f"{path}: {form.name} cannot be read in parts; only {' and '.join(_IN_PARTS)} can."
            " Save the table as Parquet"
        )
    with _naming_absent_packages(path):
        yield from reader.parts(path, rows)


@contextmanager
def _naming_absent_packages(path: str | Path) -> Iterator[None]:
    try:
        yield
    except ModuleNotFoundError as error:
        name = str(error.name).partition(".")[0]
        raise FileError(
            f"{path}: its reader, the package {name}, is not installed. Install it:"
            ' pip install "hydrodamp[logs]"'
        ) from error


def usual_axes(form: str) -> str:
    """Return the axes that a recording's formats have by custom: ``FLU over ENU`` or the like."""
    return next((one.axes for one in FORMATS if one.axes and one.name in form), "")


def is_bag(path: str | Path) -> bool:
    """Return whether a folder is a bag of ROS 2."""
    return (Path(path) / _BAG).exists()


def suffix_of(path: str | Path) -> str:
    """Return the suffix of a file in small letters, that of gzip aside."""
    return Path(Path(path).name.lower().removesuffix(".gz")).suffix


def format_of(path: str | Path) -> Format:
    """Return the format of a file, or of a bag in a folder."""
    path = Path(path)
    if not path.exists():
        raise FileError(absent(path))
    if is_bag(path):
        return next(form for form in FORMATS if form.module == "rosbag")
    if path.is_dir():
        raise FileError(f"{path}: is a folder; give the files in it")
    begin, suffix = head(path, _HEAD), suffix_of(path)
    if not begin.strip(b"\0\r\n\t "):
        what = "holds only zero bytes or blanks" if begin else "is empty"
        raise LogError(f"the file {what}; copy it from the vehicle again", source=str(path))
    if begin.startswith((b"PK\x03\x04", b"PK\x05\x06")):
        return _zipped(path, suffix)
    for form in FORMATS:
        if form.mark and re.match(form.mark, begin, re.DOTALL):
            return form
    return _known_by_suffix(path, begin, suffix)


def _zipped(path: Path, suffix: str) -> Format:
    try:
        names = [] if suffix == ".npz" else zipfile.ZipFile(path).namelist()
    except zipfile.BadZipFile:
        names = [""]
    if all(name.endswith(".npy") for name in names):
        return next(form for form in FORMATS if ".npz" in form.suffixes)
    raise LogError(f"this is {_FOREIGN.get(suffix, _FOREIGN['.zip'])}", source=str(path))


def _known_by_suffix(path: Path, begin: bytes, suffix: str) -> Format:
    """Return the format that the name says, or text in columns; refuse noise and foreign files."""
    named = next((form for form in FORMATS if suffix in form.suffixes), None)
    if named is not None and not named.mark:
        return named
    binary = _is_binary(begin)
    if named is not None and binary:
        raise LogError(
            f"its name says {named.name}, but it begins with {begin[:8]!r}, as none does: it is"
            " damaged, or another format under this name",
            source=str(path),
        )
    if suffix in (".yaml", ".yml", ".json") and (other := _of_ours(path, suffix)):
        raise LogError(other)
    if suffix in _FOREIGN:
        raise LogError(f"this is {_FOREIGN[suffix]}", source=str(path))
    if binary:
        known = ", ".join(
            f"{form.name} ({' '.join(form.suffixes)})" for form in FORMATS if form.suffixes
        )
        raise LogError(
            f"no format known here begins with {begin[:8]!r}. Can be read: {known}",
            source=str(path),
        )
    return FORMATS[-1]


def _of_ours(path: Path, suffix: str) -> str:
    """Return what to say of a vehicle, a mapping or a result that is given as a log."""
    if path.stat().st_size > _LARGEST_OF_OURS:
        return ""
    try:
        held = load_json(path) if suffix == ".json" else load_yaml(path)
    except FileError:
        return ""
    return mistaken(held, str(path), "log")


def _is_binary(begin: bytes) -> bool:
    """Tell noise from text by control characters; text in UTF-16 has its mark."""
    if begin.startswith((b"\xff\xfe", b"\xfe\xff")):
        return False
    control = sum(byte < 9 or 13 < byte < 27 for byte in begin.rstrip(b"\0"))
    return control > 0.01 * len(begin)
