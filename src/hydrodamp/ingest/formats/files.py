"""Format detection by signature and suffix; a file, several files or a folder as one recording."""

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
from hydrodamp.errors import FileError, HydrodampError, LogError, first_few
from hydrodamp.files import load_yaml, missing_file_message, wrong_kind_message
from hydrodamp.ingest.formats.content import read_head
from hydrodamp.ingest.formats.multi_file import (
    PATH_JOINER,
    filename_patterns,
    split_joined_paths,
    topic_names,
)

Item = TypeVar("Item")
Result = TypeVar("Result")

#: First words of the note on an unreadable file of a recording of several files.
SKIPPED = "skipped:"

_HEAD_BYTES = 4096
_PROJECT_SUFFIXES = (".yaml", ".yml", ".json")  # of vehicles, mappings and results
_MAX_PROJECT_FILE_BYTES = 1 << 18  # larger files are not parsed just to name their kind


@dataclass(frozen=True)
class Format:
    """Module of the reader, name, suffixes, signature (regular expression), axes, repair advice.

    A format without a signature is detected by its suffixes only.
    """

    module: str
    name: str
    suffixes: tuple[str, ...]
    signature: bytes = b""
    axes: str = ""
    repair_hint: str = ""

    @property
    def reader(self) -> ModuleType:
        """The reader's module, imported on first use."""
        return import_module(f"hydrodamp.ingest.formats.{self.module}")


_ROS_AXES, _AUTOPILOT_AXES = "FLU over ENU", "FRD over NED"
_MATLAB_4_SIGNATURE = (
    rb"[\0-\x34]\0\0\0.{8}[\0\1]\0\0\0.\0\0\0[A-Za-z]\w*\0"
    rb"|\0\0[\3\4]..{8}\0\0\0[\0\1]\0\0\0.[A-Za-z]\w*\0"
)
_COPY_AGAIN = "Write or copy it again"
_REINDEX = "Repair it with `rosbag reindex FILE`, then read it again"
_RECOVER = "Repair it with `mcap recover FILE -o REPAIRED.mcap`, then read that"
_REPAIR = (
    "Repair it with `sqlite3 FILE .recover | sqlite3 REPAIRED.db3`, or run `ros2 bag reindex` on"
    " its folder"
)

#: All formats, those with a signature first; the last one reads any other text.
FORMATS = (
    Format("rosbag", "ROS 1 bag", (".bag",), b"#ROSBAG", _ROS_AXES, _REINDEX),
    Format("rosbag", "ROS 2 bag (MCAP)", (".mcap",), rb"\x89MCAP", _ROS_AXES, _RECOVER),
    Format("rosbag", "ROS 2 bag (SQLite)", (".db3",), rb"SQLite format 3\0", _ROS_AXES, _REPAIR),
    Format("parquet", "Parquet", (".parquet", ".pq"), b"PAR1"),
    Format("arrays", "NumPy arrays", (".npz", ".npy"), rb"\x93NUMPY|PK[\3\5]"),
    Format("arrays", "MATLAB file", (".mat",), b"MATLAB |" + _MATLAB_4_SIGNATURE),
    Format("arrays", "MATLAB or HDF5 file", (".h5", ".hdf5"), rb"(.{512})?\x89HDF"),
    Format("ardupilot", "ArduPilot log", (".bin", ".log"), rb"\xa3\x95|\s*FMT ?,", _AUTOPILOT_AXES),
    Format("px4", "PX4 ULog", (".ulg",), rb"ULog\x01\x12\x35", _AUTOPILOT_AXES),
    Format("mavlink", "MAVLink log", (".tlog",), rb"\0[\4-\7].{6}[\xfd\xfe]", _AUTOPILOT_AXES),
    Format("moos", "MOOS log", (), b"%%.*LOGSTART"),
    Format("moos", "MOOS log", (".alog",)),
    Format("delimited", "text in columns", (".csv", ".tsv", ".txt", ".dat", ".asc")),
)

#: Suffixes of readable files.
SUFFIXES = frozenset(suffix for form in FORMATS for suffix in form.suffixes)

_UNSUPPORTED = {
    **dict.fromkeys((".xls", ".xlsx", ".ods"), "a spreadsheet; save the sheet as CSV"),
    **dict.fromkeys((".zip", ".7z", ".tar"), "an archive; unpack it and read the log in it"),
    **dict.fromkeys((".json", ".jsonl"), "JSON; save the numbers as CSV or Parquet"),
    **dict.fromkeys(
        (".yaml", ".yml"), "YAML, as of a vehicle or a mapping; save the numbers as CSV or Parquet"
    ),
    ".pkl": "a pickle, which can execute code and is never loaded; save the numbers as Parquet",
    ".lsf": "an LSTS log, for which no maintained reader exists in Python. Open it in Neptus"
    " (Mission Review and Analysis), choose `Export to CSV` or `MatLab format .MAT`, and read what"
    " it writes: a folder of CSV files, one a message, is read as topics",
}


def _read_file(path: str | Path) -> Recording:
    """Read one file, or one ROS bag, of any format."""
    form = format_of(path)
    with _report_failures(form, path):
        recording: Recording = form.reader.read_file(path)
    return recording


@contextmanager
def _report_failures(form: Format, path: str | Path) -> Iterator[None]:
    """Turn a reader's exceptions into errors that name a missing package or a damaged file."""
    try:
        yield
    except HydrodampError:
        raise
    except ModuleNotFoundError as error:
        name = str(error.name).partition(".")[0]
        raise FileError(
            f"{path}: the package {name}, which reads this format, is not installed. Install it:"
            ' pip install "hydrodamp[logs]"'
        ) from error
    except Exception as error:  # the exceptions of damaged files are undocumented
        reason = str(error).strip().split("\n")[0].rstrip(".") or type(error).__name__
        raise LogError(
            f"the file is truncated or damaged; read as {form.name}: {reason}."
            f" {form.repair_hint or _COPY_AGAIN}",
            source=str(path),
        ) from error


def conventional_axes(formats: str) -> str:
    """Return the axis convention of a recording's formats, such as ``FLU over ENU``."""
    known = (form.axes for form in FORMATS if form.axes and form.name in formats)
    return next(known, _ROS_AXES if "ROS messages" in formats else "")


def is_bag(path: Path) -> bool:
    """Return whether a folder is a ROS 2 bag."""
    return (path / "metadata.yaml").exists()


def suffix_of(path: str | Path) -> str:
    """Return the suffix of a file in lower case, without ``.gz``."""
    return Path(Path(path).name.lower().removesuffix(".gz")).suffix


def format_of(path: str | Path) -> Format:
    """Return the format of a file, or of a ROS 2 bag folder."""
    path = Path(path)
    if is_bag(path):
        return next(form for form in FORMATS if ".db3" in form.suffixes)
    begin, suffix = read_head(path, _HEAD_BYTES), suffix_of(path)
    if not begin.strip(b"\0\r\n\t "):
        fault = "holds only zero bytes or blanks" if begin else "is empty"
        raise LogError(f"the file {fault}; copy it from the vehicle again", source=str(path))
    if suffix in _UNSUPPORTED:
        if suffix in _PROJECT_SUFFIXES and path.stat().st_size < _MAX_PROJECT_FILE_BYTES:
            with suppress(FileError):
                if message := wrong_kind_message(load_yaml(path), str(path), "log"):
                    raise LogError(message)
        raise LogError(f"this is {_UNSUPPORTED[suffix]}", source=str(path))
    for form in FORMATS:
        if form.signature and re.match(form.signature, begin, re.DOTALL):
            return form
    by_suffix = next((form for form in FORMATS if suffix in form.suffixes), None)
    if by_suffix is not None and not by_suffix.signature and not _is_binary(begin):
        return by_suffix
    if _is_binary(begin):
        expected = "" if by_suffix is None else f" of {by_suffix.name}, as its suffix says"
        supported = ", ".join(
            f"{form.name} ({' '.join(form.suffixes)})" for form in FORMATS if form.suffixes
        )
        raise LogError(
            f"expected a known signature{expected}; the file begins with {begin[:8]!r}. It is"
            f" damaged, or its format is not supported. Supported are: {supported}",
            source=str(path),
        )
    return FORMATS[-1]


def _is_binary(begin: bytes) -> bool:
    """Return whether control characters exceed 1 %; zero bytes do not count (UTF-16)."""
    return sum(0 < byte < 9 or 13 < byte < 27 for byte in begin) > 0.01 * len(begin)


def read_files(
    paths: str | Path | Iterable[str | Path], patterns: Mapping[str, str] | None = None
) -> Recording:
    """Read a file, a folder or several as one recording; patterns give the topics."""
    listed = [paths] if isinstance(paths, (str, Path)) else paths
    expanded = [file for path in listed for file in split_joined_paths(path)]
    if not expanded:
        raise FileError("no file was given; at least one is required")
    files = [file for path in expanded for file in _list_files(path)]
    if len(expanded) > 1 and files == expanded and len({file.name for file in files}) == len(files):
        patterns = patterns or filename_patterns(expanded)
    topics = topic_names(files, patterns or {})
    if len(topics) == 1 and topics == {expanded[0]: ""}:
        return _read_file(expanded[0])
    recording = replace(_read_together(topics, ", ".join(map(str, expanded))), files=patterns or {})
    nested = [
        str(path / folder)
        for path in expanded
        if path.is_dir()
        for folder in _subfolders_with_logs(path)
    ]
    if not nested or is_bag(expanded[0]):
        return recording
    note = f"{SKIPPED} logs in {', '.join(first_few(nested, 8, 'folders'))}; join their files"
    return replace(
        recording,
        notes=(*recording.notes, f"{note} to these by {PATH_JOINER} if they are of this run"),
    )


def _list_files(path: Path) -> list[Path]:
    """Return the readable files of a folder, or the path itself."""
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
        fault = f"the folder holds no log; the suffixes of logs are {' '.join(sorted(SUFFIXES))}"
        if nested := _subfolders_with_logs(path):
            fault = (
                "the folder holds logs only in its subfolders"
                f" {', '.join(first_few(nested, 8, 'folders'))}. Give the subfolders one by one, or"
                f" the files of one recording joined by {PATH_JOINER}"
            )
        raise FileError(f"{path}: {fault}")
    suffixes = Counter(map(suffix_of, inside)).most_common()
    if len(suffixes) > 1 and suffixes[0][1] == suffixes[1][1]:
        counts = ", ".join(f"{count} {suffix}" for suffix, count in suffixes)
        raise FileError(
            f"{path}: the folder holds logs of several formats ({counts}); name the files"
        )
    return [file for file in inside if suffix_of(file) == suffixes[0][0]]


def _subfolders_with_logs(path: Path) -> list[str]:
    """Return the subfolders that hold logs."""
    logs = (file for file in path.rglob("*") if file.is_file() and suffix_of(file) in SUFFIXES)
    return sorted({str(file.parent.relative_to(path)) for file in logs} - {"."})


def map_reporting_all_faults(
    items: Iterable[Item], function: Callable[[Item], Result]
) -> list[Result]:
    """Return the result of a function for each item; raise the faults of all items at once."""
    results, errors = [], []
    for item in items:
        try:
            results.append(function(item))
        except LogError as error:
            errors.append(error)
    if len(errors) == 1:
        raise errors[0]
    if errors:
        raise LogError([str(error).replace("\n", "\n  ") for error in errors])
    return results


def _default_topic(file: Path, counts: Mapping[str, int]) -> str:
    """Return the file name as topic, or the folder name if several files share the name."""
    return file.parent.name if counts[file.name] > 1 else name_of_source(file.name)


def _read_together(files: Mapping[Path, str], source: str) -> Recording:
    """Read the files of one recording; unreadable files are skipped with a note."""
    pairs: list[tuple[Recording, Path]] = []
    errors: list[LogError] = []
    for file in files:
        try:
            pairs.append((_read_file(file), file))
        except LogError as error:
            errors.append(error)
    if not pairs:
        raise LogError([fault for error in errors for fault in error.faults], source=source)
    counts = Counter(file.name for file in files)
    topics = tuple(
        topic if topic.name else replace(topic, name=files[file] or _default_topic(file, counts))
        for recording, file in pairs
        for topic in recording.topics
    )
    if faults := [
        f"{count} files hold a topic `{name}`; a recording needs distinct topics. Read the files"
        " one after another by `read_logs`"
        for name, count in Counter(topic.name for topic in topics).items()
        if count > 1
    ]:
        raise LogError(faults, source=source)
    notes = [f"{SKIPPED} {error}" for error in errors]
    notes += [f"{file.name}: {note}" for recording, file in pairs for note in recording.notes]
    forms = " and ".join(dict.fromkeys(recording.format for recording, _ in pairs))
    return Recording(topics, source, forms, tuple(notes))
