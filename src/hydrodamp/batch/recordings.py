"""Which files make one recording, and the digest of all of them."""

from __future__ import annotations

import hashlib
import json
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from hydrodamp.data.record import name_of_source
from hydrodamp.ingest.formats.multi_file import PATH_JOINER, split_joined_paths, topic_names
from hydrodamp.ingest.mapping.log_mapping import (
    LogMapping,
    load_content,
    read_mapping,
    resolve_extends,
)


@dataclass(frozen=True)
class ResolvedMapping:
    """A mapping with everything that it extends, as text that workers can be sent."""

    name: str
    text: str

    @classmethod
    def of(cls, mapping: str | None) -> ResolvedMapping | None:
        """Resolve a mapping file or a preset; refuse a wrong one."""
        if mapping is None:
            return None
        read_mapping(mapping)
        content, _ = load_content(mapping)
        assert isinstance(content, dict)
        return cls(mapping, json.dumps(resolve_extends(content, Path(mapping)), default=str))

    @property
    def mapping(self) -> LogMapping:
        """The mapping itself."""
        return _parse_mapping(self.name, self.text)


@lru_cache
def _parse_mapping(name: str, text: str) -> LogMapping:
    return LogMapping.from_dict(json.loads(text), name)


def group_files(files: Iterable[str], mapping: ResolvedMapping | None) -> list[str]:
    """Return one address for each recording of the files that addresses match."""
    if mapping is None:
        return [*files]
    topics, patterns = _topics(mapping), mapping.mapping.files
    places = {file: _split(file) for file in files}
    n_topics = Counter(
        folder for file, (folder, _) in places.items() if name_of_source(file) in topics
    )
    recordings: dict[tuple[str, str], list[str]] = {}
    for file, (folder, name) in places.items():
        run = _run_of(name, patterns)
        is_folder = run is None and n_topics[folder] > 1  # a folder with a file for each topic
        key = "" if is_folder else name if run is None else f"run {run}"
        recordings.setdefault((folder, key), []).append(file)
    return [_address(folder, key, parts) for (folder, key), parts in recordings.items()]


def _split(file: str) -> tuple[str, str]:
    if "://" in file:
        folder, _, name = file.rpartition("/")
        return folder, name
    return str(Path(file).parent), Path(file).name


def _address(folder: str, key: str, parts: list[str]) -> str:
    if "://" in parts[0]:
        return PATH_JOINER.join(parts)
    return parts[0] if key else folder  # the reader finds the other files of `files` itself


def _topics(mapping: ResolvedMapping) -> set[str]:
    """Return the names that files of one topic each may have: a folder of them is a recording."""
    given = mapping.mapping
    topics = {name for names in given.topics.values() for name in names} | set(given.topics)
    columns = [choice.column for entry in given.entries for choice in entry.choices]
    return topics | {column.rpartition(".")[0] for column in columns if "." in column}


def _run_of(name: str, patterns: Mapping[str, str]) -> str | None:
    for pattern in sorted(patterns.values(), key=len, reverse=True):
        expression = re.escape(pattern).replace(r"\*", "(.*)", 1)
        if match := re.fullmatch(expression, name):
            return "".join(match.groups())
    return None


def digest_files(address: str, mapping: ResolvedMapping | None) -> str:
    """Return the digest of all files of a local recording, with their names where several."""
    files: list[Path] = []
    for path in split_joined_paths(address):
        files += sorted(path.rglob("*")) if path.is_dir() else [path]
    if mapping is not None and mapping.mapping.files:
        files = [*topic_names(files, mapping.mapping.files)]
    files = [file for file in files if file.is_file()]
    digest = hashlib.sha256()
    for file in files:
        if len(files) > 1:
            digest.update(f"{file.name}\0".encode())
        with file.open("rb") as stream:
            digest.update(hashlib.file_digest(stream, "sha256").digest())
    return digest.hexdigest()
