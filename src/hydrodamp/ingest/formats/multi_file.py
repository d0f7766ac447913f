"""Recordings of several files: joined paths, and file name patterns that give their topics."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import takewhile
from pathlib import Path

from hydrodamp.data.record import name_of_source
from hydrodamp.errors import FileError

#: Joins the files of one recording on the command line, as in ``pose.csv+pwm.csv``.
PATH_JOINER = "+"

_SEPARATOR = re.compile(r"([_\-. ]+)")
_DEFAULT_TOPIC = "log"  # topic of a file named by the recording only


def split_joined_paths(path: str | Path) -> list[Path]:
    """Return the files that a path joins; the path itself if it exists or joins none."""
    joined, text = Path(path), str(path)
    if PATH_JOINER not in text or joined.exists():
        return [joined]
    return [Path(name) for name in filter(None, text.split(PATH_JOINER))]


def filename_patterns(files: Sequence[Path]) -> dict[str, str]:
    """Return the file name pattern of each topic; ``*`` stands for the recording's name."""
    stems = [name_of_source(file.name) for file in files]
    suffixes = [file.name.removeprefix(stem) for file, stem in zip(files, stems, strict=True)]
    tokens = [_SEPARATOR.split(stem) for stem in stems]
    for is_prefix in (True, False):
        columns = zip(*(split if is_prefix else split[::-1] for split in tokens), strict=False)
        count = sum(1 for _ in takewhile(lambda place: len(set(place)) == 1, columns))
        count -= 1 - count % 2  # the separator stays with the topic
        if count > 0:
            remainders = [
                "".join(split[count:] if is_prefix else split[:-count]) for split in tokens
            ]
            labels = [
                _SEPARATOR.sub(" ", remainder).strip().replace(" ", "_") or _DEFAULT_TOPIC
                for remainder in remainders
            ]
            globs = (f"*{remainder}" if is_prefix else f"{remainder}*" for remainder in remainders)
            return {
                topic: glob + suffix
                for topic, glob, suffix in zip(labels, globs, suffixes, strict=True)
            }
    return {stem: file.name for stem, file in zip(stems, files, strict=True)}


def topic_names(files: Sequence[Path], patterns: Mapping[str, str]) -> dict[Path, str]:
    """Return the topic of each file of a recording, with further files that match the patterns."""
    topics = dict.fromkeys(files, "")
    runs: dict[str, Path] = {}
    for file in files:
        for topic in sorted(patterns, key=lambda topic: -len(patterns[topic])):
            pattern = re.escape(patterns[topic]).replace(r"\*", "(.*)", 1)
            if match := re.fullmatch(pattern, file.name):
                topics[file] = topic
                runs.setdefault("".join(match.groups()), file)
                break
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
