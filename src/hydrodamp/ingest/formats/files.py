"""One file, several, or a folder: one recording."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from hydrodamp.advance import shares, within
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import FileError, LogError
from hydrodamp.files import absent
from hydrodamp.ingest.formats import detect
from hydrodamp.ingest.formats.content import size_of
from hydrodamp.ingest.formats.detect import FORMATS
from hydrodamp.ingest.formats.joining import joined
from hydrodamp.ingest.formats.oddities import noted

_BAG = "metadata.yaml"
_SUFFIXES = frozenset(suffix for form in FORMATS for suffix in form.suffixes)


def read(paths: str | Path | Iterable[str | Path]) -> Recording:
    r"""Read a file, a folder or several of them as one recording."""
    given = [paths] if isinstance(paths, (str, Path)) else list(paths)
    if not given:
        raise FileError("no file was given; give at least one")
    files = [file for path in given for file in _expanded(Path(path))]
    if len(files) == 1 and not _holds_topics(given):
        return noted(detect.read(files[0]) if files[0].is_file() else _bag(files[0]))
    source = str(given[0]) if len(given) == 1 else ", ".join(map(str, given))
    return noted(_together(files, source))


def _holds_topics(given: Sequence[str | Path]) -> bool:
    """Tell a folder of topics, were it only one, from a file or a bag."""
    folder = Path(given[0])
    return folder.is_dir() and not _is_bag(folder)


def _is_bag(folder: Path) -> bool:
    return (folder / _BAG).exists()


def _bag(folder: Path) -> Recording:
    from hydrodamp.ingest.formats import rosbag

    return rosbag.read(folder)


def _expanded(path: Path) -> list[Path]:
    """Return the files of a folder that can be read, or the path itself."""
    if not path.is_dir() or _is_bag(path):
        if not path.exists():
            raise FileError(absent(path))
        return [path]
    inside = [file for file in sorted(path.iterdir()) if _readable(file)]
    if not inside:
        raise FileError(
            f"{path}: the folder holds no log; logs end in {' '.join(sorted(_SUFFIXES))}"
        )
    kinds = Counter(_suffix(file) for file in inside).most_common()
    if len(kinds) > 1 and kinds[0][1] == kinds[1][1]:
        told = ", ".join(f"{count} {suffix}" for suffix, count in kinds)
        raise FileError(f"{path}: the folder holds logs of several kinds ({told}); name the files")
    return [file for file in inside if _suffix(file) == kinds[0][0]]


def _readable(file: Path) -> bool:
    return file.is_file() and not file.name.startswith(".") and _suffix(file) in _SUFFIXES


def _suffix(file: Path) -> str:
    return Path(file.name.lower().removesuffix(".gz")).suffix


def _together(files: Sequence[Path], source: str) -> Recording:
    """Read several files; raise the faults of all of them at once."""
    read, errors = [], []
    for file, share in zip(files, shares([*map(size_of, files)]), strict=True):
        try:
            with within(*share):
                read.append(detect.read(file) if file.is_file() else _bag(file))
        except LogError as error:
            errors.append(error)
    if len(errors) == 1:
        raise errors[0]
    if errors:
        raise LogError([str(error) for error in errors])
    topics = [topic for one, file in zip(read, files, strict=True) for topic in _called(one, file)]
    notes = [
        f"{file.name}: {note}" for one, file in zip(read, files, strict=True) for note in one.notes
    ]
    forms = " and ".join(dict.fromkeys(one.format for one in read))
    return Recording(joined(topics, source), source, forms, tuple(notes))


def _called(recording: Recording, file: Path) -> list[Topic]:
    stem = file.name.removesuffix(".gz").rpartition(".")[0] or file.name
    return [topic if topic.name else replace(topic, name=stem) for topic in recording.topics]
