"""The one table of formats; one file, several, or a folder read as one recording.

Which format a file has is told by its first bytes, then by its suffix.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TypeVar

from hydrodamp.data.record import name_of_source
from hydrodamp.data.recording import Recording
from hydrodamp.errors import FileError, HydrodampError, LogError
from hydrodamp.files import load_yaml, missing_file_message, wrong_kind_message
from hydrodamp.ingest.formats.content import head
from hydrodamp.ingest.formats.multi_file import JOINT, apart, called, patterns
from hydrodamp.text import first_few

Item = TypeVar("Item")
Made = TypeVar("Made")

#: How the note begins on a file, beside others, that cannot be read.
LEFT_OUT = "left out:"

_HEAD = 4096
_OURS = (".yaml", ".yml", ".json")  # of a vehicle, a mapping or a result given as a log
_LARGEST_OF_OURS = 1 << 18  # bytes; parsing a file takes a while, and only to refuse it


@dataclass(frozen=True)
class Format:
    """A format: module of its reader, name, suffixes, how its files begin, axes by custom.

    A format without a mark is known by its suffixes alone; some have a cure of their own for files
    that cannot be read.
    """

    module: str
    name: str
    suffixes: tuple[str, ...]
    mark: bytes = b""
    axes: str = ""
    cure: str = ""

    @property
    def reader(self) -> ModuleType:
        """The module, loaded when it is first asked for."""
        return import_module(f"hydrodamp.ingest.formats.{self.module}")


_ROS, _AUTOPILOT = "FLU over ENU", "FRD over NED"
_MATLAB_4 = (
    rb"[\0-\x34]\0\0\0.{8}[\0\1]\0\0\0.\0\0\0[A-Za-z]\w*\0"
    rb"|\0\0[\3\4]..{8}\0\0\0[\0\1]\0\0\0.[A-Za-z]\w*\0"
)
_AGAIN = "Write or copy it again"
_REINDEX = "Repair it with `rosbag reindex FILE`, then read it again"
_RECOVER = "Repair it with `mcap recover FILE -o WHOLE.mcap`, then read that"
_REPAIR = (
    "Repair it with `sqlite3 FILE .recover | sqlite3 WHOLE.db3`, or run `ros2 bag reindex` on its"
    " folder"
)

#: All formats, those with a mark first; the last takes any text that no other does.
FORMATS = (
    Format("rosbag", "ROS 1 bag", (".bag",), b"#ROSBAG", _ROS, _REINDEX),
    Format("rosbag", "ROS 2 bag (MCAP)", (".mcap",), rb"\x89MCAP", _ROS, _RECOVER),
    Format("rosbag", "ROS 2 bag (SQLite)", (".db3",), rb"SQLite format 3\0", _ROS, _REPAIR),
    Format("parquet", "Parquet", (".parquet", ".pq"), b"PAR1"),
    Format("arrays", "NumPy arrays", (".npz", ".npy"), rb"\x93NUMPY|PK[\3\5]"),
    Format("arrays", "MATLAB file", (".mat",), b"MATLAB |" + _MATLAB_4),
    Format("arrays", "MATLAB or HDF5 file", (".h5", ".hdf5"), rb"(.{512})?\x89HDF"),
    Format("ardupilot", "ArduPilot log", (".bin", ".log"), rb"\xa3\x95|\s*FMT ?,", _AUTOPILOT),
    Format("px4", "PX4 ULog", (".ulg",), rb"ULog\x01\x12\x35", _AUTOPILOT),
    Format("mavlink", "MAVLink log", (".tlog",), rb"\0[\4-\7].{6}[\xfd\xfe]", _AUTOPILOT),
    Format("moos", "MOOS log", (), b"%%.*LOGSTART"),
    Format("moos", "MOOS log", (".alog",)),
    Format("delimited", "text in columns", (".csv", ".tsv", ".txt", ".dat", ".asc")),
)

#: How the names of files that can be read end.
SUFFIXES = frozenset(suffix for form in FORMATS for suffix in form.suffixes)

_FOREIGN = {
    **dict.fromkeys((".xls", ".xlsx", ".ods"), "a spreadsheet; save the sheet as CSV"),
    **dict.fromkeys((".zip", ".7z", ".tar"), "an archive; unpack it and give the log in it"),
    **dict.fromkeys((".json", ".jsonl"), "JSON; save the numbers as CSV or Parquet"),
    **dict.fromkeys(
        (".yaml", ".yml"), "YAML, as of a vehicle or a mapping; save the numbers as CSV or Parquet"
    ),
    ".pkl": "a pickle, which may run any program and is never loaded; save the numbers as Parquet",
    ".lsf": "an LSTS log, for which no maintained reader exists in Python. Open it in Neptus"
    " (Mission Review and Analysis), choose `Export to CSV` or `MatLab format .MAT`, and read what"
    " it writes: a folder of CSV files, one a message, is read as topics",
}


def _single(path: str | Path) -> Recording:
    """Read one file, or one bag, of any format."""
    form = format_of(path)
    with _failures_named(form, path):
        recording: Recording = form.reader.read(path)
    return recording


@contextmanager
def _failures_named(form: Format, path: str | Path) -> Iterator[None]:
    """Say what a reader fails at: a package that is absent, or damage in the file."""
    try:
        yield
    except HydrodampError:
        raise
    except ModuleNotFoundError as error:
        name = str(error.name).partition(".")[0]
        raise FileError(
            f"{path}: its reader, the package {name}, is not installed. Install it:"
            ' pip install "hydrodamp[logs]"'
        ) from error
    except Exception as error:  # a damaged file fails in ways that no library lists
        why = str(error).strip().split("\n")[0].rstrip(".") or type(error).__name__
        raise LogError(
            f"the file is cut off or damaged; read as {form.name}: {why}. {form.cure or _AGAIN}",
            source=str(path),
        ) from error


def usual_axes(form: str) -> str:
    """Return the axes that a recording's formats have by custom: ``FLU over ENU`` or the like."""
    known = (one.axes for one in FORMATS if one.axes and one.name in form)
    return next(known, _ROS if "ROS messages" in form else "")


def is_bag(path: Path) -> bool:
    """Return whether a folder is a bag of ROS 2."""
    return (path / "metadata.yaml").exists()


def suffix_of(path: str | Path) -> str:
    """Return the suffix of a file in small letters, that of gzip aside."""
    return Path(Path(path).name.lower().removesuffix(".gz")).suffix


def format_of(path: str | Path) -> Format:
    """Return the format of a file, or of a bag in a folder."""
    path = Path(path)
    if is_bag(path):
        return next(form for form in FORMATS if ".db3" in form.suffixes)
    begin, suffix = head(path, _HEAD), suffix_of(path)
    if not begin.strip(b"\0\r\n\t "):
        what = "holds only zero bytes or blanks" if begin else "is empty"
        raise LogError(f"the file {what}; copy it from the vehicle again", source=str(path))
    if suffix in _FOREIGN:
        if suffix in _OURS and path.stat().st_size < _LARGEST_OF_OURS:
            with suppress(FileError):
                if other := wrong_kind_message(load_yaml(path), str(path), "log"):
                    raise LogError(other)
        raise LogError(f"this is {_FOREIGN[suffix]}", source=str(path))
    for form in FORMATS:
        if form.mark and re.match(form.mark, begin, re.DOTALL):
            return form
    named = next((form for form in FORMATS if suffix in form.suffixes), None)
    if named is not None and not named.mark and not _is_binary(begin):
        return named
    if _is_binary(begin):
        says = "it" if named is None else f"its name says {named.name}, but it"
        known = ", ".join(
            f"{form.name} ({' '.join(form.suffixes)})" for form in FORMATS if form.suffixes
        )
        raise LogError(
            f"{says} begins with {begin[:8]!r}, as no such file does: it is damaged, or of another"
            f" format. Can be read: {known}",
            source=str(path),
        )
    return FORMATS[-1]


def _is_binary(begin: bytes) -> bool:
    """Tell noise from text by control characters; UTF-16 has zero bytes."""
    return sum(0 < byte < 9 or 13 < byte < 27 for byte in begin) > 0.01 * len(begin)


def read(
    paths: str | Path | Iterable[str | Path], named: Mapping[str, str] | None = None
) -> Recording:
    """Read a file, a folder or several of them as one recording; patterns name their topics."""
    listed = [paths] if isinstance(paths, (str, Path)) else paths
    given = [one for path in listed for one in apart(path)]
    if not given:
        raise FileError("no file was given; give at least one")
    files = [file for path in given for file in _expanded(path)]
    if len(given) > 1 and files == given and len({file.name for file in files}) == len(files):
        named = named or patterns(given)
    topics = called(files, named or {})
    if len(topics) == 1 and topics == {given[0]: ""}:
        return _single(given[0])
    made = replace(_together(topics, ", ".join(map(str, given))), files=named or {})
    nested = [str(path / one) for path in given if path.is_dir() for one in _nested(path)]
    if not nested or is_bag(given[0]):
        return made
    told = f"{LEFT_OUT} logs in {', '.join(first_few(nested, 8, 'folders'))}; join their files"
    return replace(made, notes=(*made.notes, f"{told} to these by {JOINT} if they are of this run"))


def _expanded(path: Path) -> list[Path]:
    """Return the files of a folder that can be read, or the path itself."""
    if not path.exists():
        raise FileError(missing_file_message(path))
    if not path.is_dir() or is_bag(path):
        return [path]
    inside = [
        file
        for file in sorted(path.iterdir())
        if file.is_file() and not file.name.startswith(".") and suffix_of(file) in SUFFIXES
    ]
    if not inside:
        told = f"the folder holds no log; logs end in {' '.join(sorted(SUFFIXES))}"
        if nested := _nested(path):
            told = (
                f"the folder holds logs in its folders {', '.join(first_few(nested, 8, 'folders'))}"
                " alone. Give those that are runs one after another, or the files of one recording"
                f" joined by {JOINT}"
            )
        raise FileError(f"{path}: {told}")
    kinds = Counter(map(suffix_of, inside)).most_common()
    if len(kinds) > 1 and kinds[0][1] == kinds[1][1]:
        told = ", ".join(f"{count} {suffix}" for suffix, count in kinds)
        raise FileError(f"{path}: the folder holds logs of several kinds ({told}); name the files")
    return [file for file in inside if suffix_of(file) == kinds[0][0]]


def _nested(path: Path) -> list[str]:
    """Return the folders within a folder that hold logs."""
    logs = (file for file in path.rglob("*") if file.is_file() and suffix_of(file) in SUFFIXES)
    return sorted({str(file.parent.relative_to(path)) for file in logs} - {"."})


def each(items: Iterable[Item], made_of: Callable[[Item], Made]) -> list[Made]:
    """Return what is made of each item; raise the faults of all of them at once."""
    made, errors = [], []
    for item in items:
        try:
            made.append(made_of(item))
        except LogError as error:
            errors.append(error)
    if len(errors) == 1:
        raise errors[0]
    if errors:
        raise LogError([str(error).replace("\n", "\n  ") for error in errors])
    return made


def _topic_of(file: Path, times: Mapping[str, int]) -> str:
    """Return what the topic of a file is called: its name, or where others share it its folder."""
    return file.parent.name if times[file.name] > 1 else name_of_source(file.name)


def _together(files: Mapping[Path, str], source: str) -> Recording:
    """Read the files of one recording; those that cannot be read are left out, with a note."""
    pairs: list[tuple[Recording, Path]] = []
    errors: list[LogError] = []
    for file in files:
        try:
            pairs.append((_single(file), file))
        except LogError as error:
            errors.append(error)
    if not pairs:
        raise LogError([fault for error in errors for fault in error.faults], source=source)
    times = Counter(file.name for file in files)
    topics = tuple(
        topic if topic.name else replace(topic, name=files[file] or _topic_of(file, times))
        for one, file in pairs
        for topic in one.topics
    )
    if faults := [
        f"{count} files hold a topic `{name}`: they are parts of a recording, or different ones."
        " Read them one after another by `read_logs`"
        for name, count in Counter(topic.name for topic in topics).items()
        if count > 1
    ]:
        raise LogError(faults, source=source)
    notes = [f"{LEFT_OUT} {error}" for error in errors]
    notes += [f"{file.name}: {note}" for one, file in pairs for note in one.notes]
    forms = " and ".join(dict.fromkeys(one.format for one, _ in pairs))
    return Recording(topics, source, forms, tuple(notes))
