"""One file, several, or a folder: one recording."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import FileError, LogError
from hydrodamp.files import absent
from hydrodamp.ingest.formats import detect
from hydrodamp.ingest.formats.detect import SUFFIXES, is_bag, suffix_of
from hydrodamp.ingest.formats.oddities import noted


def read(paths: str | Path | Iterable[str | Path]) -> Recording:
    """Read a file, a folder or several of them as one recording."""
    given = [Path(path) for path in ([paths] if isinstance(paths, (str, Path)) else paths)]
    if not given:
        raise FileError("no file was given; give at least one")
    files = [file for path in given for file in _expanded(path)]
    if files == given and len(files) == 1:
        return noted(detect.read(files[0]))
    return noted(_together(files, ", ".join(map(str, given))))


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


def _together(files: Sequence[Path], source: str) -> Recording:
    """Read several files; raise the faults of all of them at once."""
    read, errors = [], []
    for file in files:
        try:
            read.append(detect.read(file))
        except LogError as error:
            errors.append(error)
    if len(errors) == 1:
        raise errors[0]
    if errors:
        raise LogError([str(error) for error in errors])
    pairs = [*zip(read, files, strict=True)]
    topics = [
        topic if topic.name else replace(topic, name=_stem(file))
        for one, file in pairs
        for topic in one.topics
    ]
    notes = tuple(f"{file.name}: {note}" for one, file in pairs for note in one.notes)
    forms = " and ".join(dict.fromkeys(one.format for one in read))
    return Recording(joined(topics, source), source, forms, notes)


def _stem(file: Path) -> str:
    return file.name.removesuffix(".gz").rpartition(".")[0] or file.name


def joined(topics: Iterable[Topic], source: str) -> tuple[Topic, ...]:
    """Join topics of one name, such as those of a split bag, in the order of their clocks."""
    groups: dict[str, list[Topic]] = {}
    for topic in topics:
        groups.setdefault(topic.name, []).append(topic)
    faults = [fault for name, group in groups.items() if (fault := _fault(name, group))]
    if faults:
        raise LogError(faults, source=source)
    return tuple(_whole(sorted(group, key=_begin)) for group in groups.values())


def _fault(name: str, group: Sequence[Topic]) -> str:
    """Say why topics of one name are not parts of one."""
    if len(group) == 1:
        return ""
    head = f"{len(group)} files hold a topic `{name}`"
    if any(topic.time is None for topic in group):
        return f"{head} without a clock of its own. Read each file by itself"
    clocks = [topic.time for topic in sorted(group, key=_begin)]
    for before, after in pairwise(clock for clock in clocks if clock is not None and len(clock)):
        if after[0] <= before[-1]:
            return (
                f"{head}, and their times overlap ({after[0]:.10g} s to {before[-1]:.10g} s): these"
                " are different vehicles or dives. Read each file by itself"
            )
    return ""


def _begin(topic: Topic) -> float:
    return np.inf if topic.time is None or not len(topic.time) else float(topic.time[0])


def _whole(parts: Sequence[Topic]) -> Topic:
    if len(parts) == 1:
        return parts[0]
    faults = {name: fault for part in parts for name, fault in part.faults.items()}
    fields = dict.fromkeys(name for part in parts for name in part.fields if name not in faults)
    texts = dict.fromkeys(name for part in parts for name in part.texts if name not in fields)
    return Topic(
        parts[0].name,
        np.concatenate([part.time for part in parts if part.time is not None]),
        {
            name: np.concatenate([part.fields.get(name, np.full(part.n, np.nan)) for part in parts])
            for name in fields
        },
        {
            name: tuple(word for part in parts for word in part.texts.get(name, ("",) * part.n))
            for name in texts
        },
        {name: unit for part in parts for name, unit in part.units.items()},
        faults,
    )
