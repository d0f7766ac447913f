"""One file, several, or a folder: one recording, with notes on what is odd in it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import FileError, LogError
from hydrodamp.files import absent
from hydrodamp.ingest.formats import detect
from hydrodamp.ingest.formats.detect import SUFFIXES, is_bag, suffix_of

Item = TypeVar("Item")
Made = TypeVar("Made")

_HUGE = 1e300


def read(paths: str | Path | Iterable[str | Path]) -> Recording:
    """Read a file, a folder or several of them as one recording."""
    given = [Path(path) for path in ([paths] if isinstance(paths, (str, Path)) else paths)]
    if not given:
        raise FileError("no file was given; give at least one")
    files = [file for path in given for file in _expanded(path)]
    if files == given and len(files) == 1:
        recording = detect.read(files[0])
    else:
        recording = _together(files, ", ".join(map(str, given)))
    odd = [note for topic in recording.topics for note in _oddities(topic)]
    return replace(recording, notes=(*recording.notes, *odd))


def _expanded(path: Path) -> list[Path]:
    """Return the files of a folder that can be read, or the path itself."""
    if not path.exists():
        raise FileError(absent(path))
    if not path.is_dir() or is_bag(path):
        return [path]
    inside = [
        file
        for file in sorted(path.iterdir())
        if file.is_file() and not file.name.startswith(".") and suffix_of(file) in SUFFIXES
    ]
    if not inside:
        raise FileError(
            f"{path}: the folder holds no log; logs end in {' '.join(sorted(SUFFIXES))}"
        )
    kinds = Counter(map(suffix_of, inside)).most_common()
    if len(kinds) > 1 and kinds[0][1] == kinds[1][1]:
        told = ", ".join(f"{count} {suffix}" for suffix, count in kinds)
        raise FileError(f"{path}: the folder holds logs of several kinds ({told}); name the files")
    return [file for file in inside if suffix_of(file) == kinds[0][0]]


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
        raise LogError([str(error) for error in errors])
    return made


def _together(files: Sequence[Path], source: str) -> Recording:
    read = each(files, detect.read)
    pairs = [*zip(read, files, strict=True)]
    topics = tuple(
        topic if topic.name else replace(topic, name=_stem(file))
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
    notes = tuple(f"{file.name}: {note}" for one, file in pairs for note in one.notes)
    forms = " and ".join(dict.fromkeys(one.format for one in read))
    return Recording(topics, source, forms, notes)


def _stem(file: Path) -> str:
    return file.name.removesuffix(".gz").rpartition(".")[0] or file.name


def _oddities(topic: Topic) -> Iterator[str]:
    head = f"topic `{topic.name}`: " if topic.name else ""
    for name, values in topic.fields.items():
        # One pass finds most columns clean; only the odd ones are looked at again.
        if len(values) and not (values.min() > -_HUGE and values.max() < _HUGE):
            for row in np.flatnonzero(np.abs(values) >= _HUGE)[:1].tolist():
                line = f" (line {topic.lines[row]})" if len(topic.lines) else ""
                what = f"{head}`{name}` is infinite or beyond {_HUGE:g}"
                yield f"{what}, first in row {row + 1}{line}"
