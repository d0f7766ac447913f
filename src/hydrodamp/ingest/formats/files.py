"""Format detection by signature and suffix; a file, several files or a folder as one recording."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from importlib import import_module
from itertools import takewhile
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from hydrodamp.data.record import name_of_source
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import FileError, HydrodampError, LogError, first_few
from hydrodamp.files import load_yaml, missing_file_message, wrong_kind_message
from hydrodamp.ingest.formats.content import read_head
from hydrodamp.ingest.formats.time_columns import read_times

Item = TypeVar("Item")
Result = TypeVar("Result")

#: First words of the note on an unreadable file of a recording of several files.
SKIPPED = "skipped:"

#: Joins the files of one recording on the command line, as in ``pose.csv+pwm.csv``.
PATH_JOINER = "+"

_SEPARATOR = re.compile(r"([_\-. ]+)")
_DEFAULT_TOPIC = "log"  # topic of a file named by the recording only
_HEAD_BYTES = 4096
_PROJECT_SUFFIXES = (".yaml", ".yml", ".json")  # of vehicles, mappings and results
_MAX_PROJECT_FILE_BYTES = 1 << 18  # larger files are not parsed just to name their kind


@dataclass(frozen=True)
class Format:
    """A format as `formats.yaml` describes it."""

    module: str
    name: str
    suffixes: Sequence[str]
    signature: str = ""
    axes: str = ""
    repair_hint: str = "Write or copy it again"

    @property
    def reader(self) -> ModuleType:
        """The reader's module, imported on first use."""
        return import_module(f"hydrodamp.ingest.formats.{self.module}")


_TABLES: Any = load_yaml(Path(__file__).with_name("formats.yaml"))

#: All formats, those with a signature first; the last one reads any other text.
FORMATS = tuple(Format(**entry) for entry in _TABLES["formats"])

#: Suffixes of readable files.
SUFFIXES = frozenset(suffix for form in FORMATS for suffix in form.suffixes)


def _read_file(path: str | Path) -> Recording:
    """Read one file, or one ROS bag, of any format."""
    form = format_of(path)
    with _report_failures(form, path):
        recording: Recording = form.reader.read_file(path)
    return read_times(recording)


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
    except MemoryError as error:
        fault = "it needs more memory than is free. Close other programs, or split the file"
        raise LogError(fault, source=str(path)) from error
    except Exception as error:  # the exceptions of damaged files are undocumented
        reason = str(error).strip().split("\n")[0].rstrip(".") or type(error).__name__
        raise LogError(
            f"the file is truncated or damaged; read as {form.name}: {reason}. {form.repair_hint}",
            source=str(path),
        ) from error


def conventional_axes(formats: str) -> str:
    """Return the axis convention of a recording's formats, such as ``FLU over ENU``."""
    known = (form.axes for form in FORMATS if form.axes and form.name in formats)
    return next(known, "FLU over ENU" if "ROS messages" in formats else "")


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
        suffix = ".mcap" if any(path.glob("*.mcap*")) else ".db3"
        return next(form for form in FORMATS if suffix in form.suffixes)
    begin, suffix = read_head(path, _HEAD_BYTES), suffix_of(path)
    if not begin.strip(b"\0\r\n\t "):
        fault = "holds only zero bytes or blanks" if begin else "is empty"
        raise LogError(f"the file {fault}; copy it from the vehicle again", source=str(path))
    if suffix in _TABLES["unsupported"]:
        if suffix in _PROJECT_SUFFIXES and path.stat().st_size < _MAX_PROJECT_FILE_BYTES:
            with suppress(FileError):
                if message := wrong_kind_message(load_yaml(path), str(path), "log"):
                    raise LogError(message)
        raise LogError(f"this is {_TABLES['unsupported'][suffix]}", source=str(path))
    for form in FORMATS:
        if form.signature and re.match(form.signature.encode("latin-1"), begin, re.DOTALL):
            return form
    by_suffix = next((form for form in FORMATS if suffix in form.suffixes), None)
    if by_suffix is not None and not by_suffix.signature and not _is_binary(begin):
        return by_suffix
    if _is_binary(begin):
        expected = "" if by_suffix is None else f" of {by_suffix.name}, as its suffix says"
        known = (f"{form.name} ({' '.join(form.suffixes)})" for form in FORMATS if form.suffixes)
        supported = ", ".join(known)
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
    items = [paths] if isinstance(paths, (str, Path)) else paths
    expanded = [file for path in items for file in split_joined_paths(path)]
    if not expanded:
        raise FileError("no file was given; at least one is required")
    files = [file for path in expanded for file in _list_files(path)]
    if len({file.name for file in files}) == len(files) > 1:
        exact = {name_of_source(file.name): file.name for file in files if files == expanded}
        patterns = patterns or filename_patterns(files) or exact
    topics = topic_names(files, patterns or {})
    if len(topics) == 1 and topics == {expanded[0]: ""}:
        return _read_file(expanded[0])
    recording = replace(_read_together(topics, ", ".join(map(str, expanded))), files=patterns or {})
    folders = filter(Path.is_dir, expanded)
    nested = [str(path / inside) for path in folders for inside in _subfolders_with_logs(path)]
    if not nested or is_bag(expanded[0]):
        return recording
    note = f"{SKIPPED} logs in {', '.join(first_few(nested, 8, 'folders'))}; join their files"
    return replace(
        recording,
        notes=(*recording.notes, f"{note} to these by {PATH_JOINER} if they are of this run"),
    )


def _list_files(path: Path) -> list[Path]:
    """Return the readable files of a folder, or the path itself."""
    if not path.exists() and not path.is_symlink():
        raise FileError(missing_file_message(path))
    if not path.is_dir() or is_bag(path):
        return [path]
    visible = (file for file in sorted(path.glob("[!.]*")) if not file.is_dir())
    inside = [file for file in visible if suffix_of(file) in SUFFIXES]
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
    return sorted({str(file.parent.relative_to(path)) for file in find_logs(path)} - {"."})


def find_logs(folder: Path) -> list[Path]:
    """Return the files in a folder and its subfolders that have the suffix of a log."""
    files = (file for file in folder.rglob("*") if file.is_file())
    return [file for file in files if suffix_of(file) in SUFFIXES]


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
    topics: list[Topic] = []
    for recording, file in pairs:  # a table is named by its file, or by its folder if files agree
        default = file.parent.name if counts[file.name] > 1 else name_of_source(file.name)
        name = files[file] or default
        topics += [topic if topic.name else replace(topic, name=name) for topic in recording.topics]
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
    return Recording(tuple(topics), source, forms, tuple(notes))


def split_joined_paths(path: str | Path) -> list[Path]:
    """Return the files that a path joins; the path itself if it exists or joins none."""
    joined, text = Path(path), str(path)
    if PATH_JOINER not in text or joined.exists():
        return [joined]
    return [Path(name) for name in filter(None, text.split(PATH_JOINER))]


def filename_patterns(files: Sequence[Path]) -> dict[str, str]:
    """Return the file name pattern of each topic; ``*`` matches the recording's name.

    What the names share is the recording's if it has a number, such as `run1` or a date; a word
    that all topics share, as in `share_depth`, is of the topics.
    """
    stems = [name_of_source(file.name) for file in files]
    suffixes = [file.name.removeprefix(stem) for file, stem in zip(files, stems, strict=True)]
    tokens = [_SEPARATOR.split(stem) for stem in stems]
    for is_prefix in (True, False):
        columns = zip(*(split if is_prefix else split[::-1] for split in tokens), strict=False)
        count = sum(1 for _ in takewhile(lambda place: len(set(place)) == 1, columns))
        count -= 1 - count % 2  # the separator stays with the topic
        shared = "".join(tokens[0][:count] if is_prefix else tokens[0][len(tokens[0]) - count :])
        if count > 0 and any(map(str.isdigit, shared)):
            patterns: dict[str, str] = {}
            for split, suffix in zip(tokens, suffixes, strict=True):
                name = "".join(split[count:] if is_prefix else split[:-count])
                topic = _SEPARATOR.sub(" ", name).strip().replace(" ", "_") or _DEFAULT_TOPIC
                patterns[topic] = (f"*{name}" if is_prefix else f"{name}*") + suffix
            return patterns
    return {}


def match_pattern(name: str, patterns: Mapping[str, str]) -> tuple[str, str] | None:
    """Return the topic of the longest pattern that a file name matches, and its recording."""
    for topic in sorted(patterns, key=lambda topic: -len(patterns[topic])):
        pattern = re.escape(patterns[topic]).replace(r"\*", "(.*)", 1)
        if match := re.fullmatch(pattern, name):
            return topic, "".join(match.groups())
    return None


def topic_names(files: Sequence[Path], patterns: Mapping[str, str]) -> dict[Path, str]:
    """Return the topic of each file of a recording, with further files that match the patterns."""
    topics = dict.fromkeys(files, "")
    runs: dict[str, Path] = {}
    for file in files:
        if match := match_pattern(file.name, patterns):
            topics[file], run = match
            runs.setdefault(run, file)
    for run, file in runs.items():
        for topic, pattern in patterns.items():
            sibling = file.with_name(pattern.replace("*", run))
            if topic in topics.values() or sibling in topics:
                continue
            if not sibling.is_file():
                raise FileError(
                    f"{sibling}: no such file. `files` of the mapping expects the topic"
                    f" `{topic}` of the recording of {file.name} there. Add the file, or"
                    " change `files`"
                )
            topics[sibling] = topic
    return topics
