"""Which files make one recording, and what each is called in it: named together, or by patterns."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import takewhile
from pathlib import Path

from hydrodamp.data.record import name_of_source
from hydrodamp.errors import FileError

#: Joins files of one recording on the command line, as in ``pose.csv+pwm.csv``.
JOINT = "+"

_SEAM = re.compile(r"([_\-. ]+)")
_WHOLE = "log"  # what a file is called whose name is that of the run alone


def apart(path: str | Path) -> list[Path]:
    """Return the files that a path joins; itself where it is there, or joins none."""
    whole, text = Path(path), str(path)
    if JOINT not in text or whole.exists():
        return [whole]
    return [Path(one) for one in filter(None, text.split(JOINT))]


def patterns(files: Sequence[Path]) -> dict[str, str]:
    """Return for every topic of files of one run its file, a star where the run is named."""
    stems = [name_of_source(file.name) for file in files]
    tails = [file.name.removeprefix(stem) for file, stem in zip(files, stems, strict=True)]
    words = [_SEAM.split(stem) for stem in stems]
    for front in (True, False):
        places = zip(*(each if front else each[::-1] for each in words), strict=False)
        count = sum(1 for _ in takewhile(lambda place: len(set(place)) == 1, places))
        count -= 1 - count % 2  # the seam stays with what tells the files apart
        if count > 0:
            rests = ["".join(each[count:] if front else each[:-count]) for each in words]
            called = [_SEAM.sub(" ", rest).strip().replace(" ", "_") or _WHOLE for rest in rests]
            starred = (f"*{rest}" if front else f"{rest}*" for rest in rests)
            return {
                name: one + tail for name, one, tail in zip(called, starred, tails, strict=True)
            }
    return {stem: file.name for stem, file in zip(stems, files, strict=True)}


def called(files: Sequence[Path], named: Mapping[str, str]) -> dict[Path, str]:
    """Return the files of one recording, patterns' others too, and what its topic is called."""
    found = dict.fromkeys(files, "")
    runs: dict[str, Path] = {}
    for file in files:
        for topic in sorted(named, key=lambda topic: -len(named[topic])):
            pattern = re.escape(named[topic]).replace(r"\*", "(.*)", 1)
            if hit := re.fullmatch(pattern, file.name):
                found[file] = topic
                runs.setdefault("".join(hit.groups()), file)
                break
    for run, file in runs.items():
        for topic, pattern in named.items():
            other = file.with_name(pattern.replace("*", run))
            if topic in found.values() or other in found:
                continue
            if not other.is_file():
                raise FileError(
                    f"{other}: there is no such file, and `files` of the mapping says that"
                    f" `{topic}` of the recording of {file.name} is in it. Bring it there, or"
                    " change `files`"
                )
            found[other] = topic
    return found
