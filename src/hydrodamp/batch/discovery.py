"""Discovery of recordings: addresses (files, folders, patterns, URLs), multi-file logs, digests."""

from __future__ import annotations

import glob
import hashlib
import json
import os
import re
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path, PurePosixPath
from typing import Any

from hydrodamp.data.record import name_of_source
from hydrodamp.errors import FileError, HydrodampError
from hydrodamp.ingest.formats.files import (
    PATH_JOINER,
    SUFFIXES,
    is_bag,
    match_pattern,
    split_joined_paths,
    suffix_of,
    topic_names,
)
from hydrodamp.ingest.mapping.log_mapping import (
    LogMapping,
    load_content,
    read_mapping,
    resolve_extends,
)

_JOINT_URL = re.compile(re.escape(PATH_JOINER) + r"(?=\w+://)")


@dataclass(frozen=True)
class ResolvedMapping:
    """A mapping with all mappings it extends, as text that can be sent to workers."""

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
        """The parsed mapping."""
        return _parse_mapping(self.name, self.text)


@lru_cache
def _parse_mapping(name: str, text: str) -> LogMapping:
    return LogMapping.from_dict(json.loads(text), name)


def group_files(files: Iterable[str], mapping: ResolvedMapping | None) -> list[str]:
    """Return one address for each recording among files."""
    if mapping is None:
        return [*files]
    topics, patterns = _topic_names(mapping), mapping.mapping.files
    locations = {file: _split_path(file) for file in files}
    n_topics = Counter(
        folder for file, (folder, _) in locations.items() if name_of_source(file) in topics
    )
    recordings: dict[tuple[str, str], list[str]] = {}
    for file, (folder, name) in locations.items():
        match = match_pattern(name, patterns)
        is_folder = match is None and n_topics[folder] > 1  # a folder with a file for each topic
        key = "" if is_folder else name if match is None else f"run {match[1]}"
        recordings.setdefault((folder, key), []).append(file)
    return [_join_files(folder, key, names) for (folder, key), names in recordings.items()]


def _split_path(file: str) -> tuple[str, str]:
    if "://" in file:
        folder, _, name = file.rpartition("/")
        return folder, name
    return str(Path(file).parent), Path(file).name


def _join_files(folder: str, key: str, files: list[str]) -> str:
    if "://" in files[0]:
        return PATH_JOINER.join(files)
    return files[0] if key else folder  # the reader finds the other files of `files` itself


def _topic_names(mapping: ResolvedMapping) -> set[str]:
    """Return the names of single-topic files; a folder with several of them is one recording."""
    content = mapping.mapping
    topics = {name for names in content.topics.values() for name in names} | set(content.topics)
    columns = [choice.column for entry in content.entries for choice in entry.choices]
    return topics | {column.rpartition(".")[0] for column in columns if "." in column}


def digest_files(address: str, mapping: ResolvedMapping | None) -> str:
    """Return the digest of the files of a local recording, with their names if several."""
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


def expand_addresses(
    addresses: Iterable[str],
    mapping: ResolvedMapping | None = None,
    exclude: str | os.PathLike[str] | None = None,
) -> list[str]:
    """Return the recordings that addresses match, in their order, each once.

    Files in the folder ``exclude`` are not logs.
    """
    files, faults = dict[str, str](), []
    skip = None if exclude is None else Path(exclude).resolve()
    for address in addresses:
        matches = [*_match(address)]
        for file in matches:
            path = None if "://" in file else Path(file).resolve()
            if path is None or skip is None or not path.is_relative_to(skip):
                files.setdefault(file if path is None else str(path), file)
        if not matches:
            faults.append(f"{address}: no log matches; logs end in {' '.join(sorted(SUFFIXES))}")
    if faults:
        raise FileError("\n".join(faults))
    if not files:
        raise FileError(f"there is no log but in {exclude}, the folder of results")
    return group_files(files.values(), mapping)


def _match(address: str) -> Iterator[str]:
    if "://" in address:
        yield from _match_remote(address)
        return
    pattern = _expand_stars(address)
    is_pattern = "*" in address and not Path(address).exists()
    for path in map(Path, sorted(glob.glob(pattern, recursive=True)) if is_pattern else [address]):
        if path.is_dir() and not is_bag(path):
            yield from _walk(path)
        elif os.path.lexists(path) or (
            len(files := split_joined_paths(path)) > 1 and all(p.exists() for p in files)
        ):
            yield str(path)


def _match_remote(address: str) -> Iterator[str]:
    if _JOINT_URL.search(address):
        yield address
        return
    with remote_errors(address):
        system, path = _open_store(address)
        paths = system.glob(_expand_stars(path)) if "*" in path else [path]
        files = [file for each in paths for file in (system.find(each) or [each])]
        yield from [system.unstrip_protocol(file) for file in files if suffix_of(file) in SUFFIXES]


def _expand_stars(pattern: str) -> str:
    """Return a pattern whose ``**`` are folders: ``**.parquet`` means ``**/*.parquet``."""
    names = (
        f"**/*{name.lstrip('*')}" if name.startswith("**") and name.strip("*") else name
        for name in pattern.split("/")
    )
    return "/".join(name if name == "**" else re.sub(r"\*\*+(?!/)", "*", name) for name in names)


def _walk(folder: Path) -> list[str]:
    """Return the logs of a folder and its subfolders, through links too; a bag is one log."""
    logs: list[str] = []
    visited: set[str] = set()
    for path, folders, names in os.walk(folder, followlinks=True):
        real = os.path.realpath(path)
        if real in visited:
            folders.clear()
            continue
        visited.add(real)
        if is_bag(Path(path)):
            folders.clear()
            logs.append(str(Path(path)))
            continue
        logs += [str(Path(path, name)) for name in names if suffix_of(name) in SUFFIXES]
    return sorted(logs)


@contextmanager
def remote_errors(address: str) -> Iterator[None]:
    """Raise any error of a store or its client as a ``FileError`` with the address."""
    try:
        yield
    except HydrodampError:
        raise
    except Exception as error:  # each store has its own errors
        reason = " ".join(str(error).split()).rstrip(".") or type(error).__name__
        raise FileError(
            f"{address}: cannot be read from its store: {type(error).__name__}: {reason}. Check "
            "the address, the endpoint and the credentials."
        ) from error


def _open_store(address: str) -> tuple[Any, str]:
    try:
        from fsspec.core import url_to_fs
    except ImportError as error:
        raise FileError(
            f'{address}: addresses need the package fsspec: pip install "hydrodamp[batch]"'
        ) from error
    try:
        system, path = url_to_fs(address)
    except ImportError as error:
        raise FileError(f"{address}: its store needs another package: {error}.") from error
    return system, str(path)


@contextmanager
def local_copy(address: str) -> Iterator[str]:
    """Provide a recording as local files."""
    if "://" not in address:
        yield address
        return
    with tempfile.TemporaryDirectory() as folder:
        paths = []
        for url in _JOINT_URL.split(address):
            with remote_errors(url):
                system, path = _open_store(url)
                local = Path(folder, PurePosixPath(path).name)
                system.get(path, str(local))
            paths.append(str(local))
        yield paths[0] if len(paths) == 1 else folder


def digest_of_recording(address: str, mapping: ResolvedMapping | None) -> str:
    """Return the digest of the files of a recording, or the checksum of its store."""
    if "://" not in address:
        return digest_files(address, mapping)
    checksums = []
    for url in _JOINT_URL.split(address):
        with remote_errors(url):
            system, path = _open_store(url)
            checksums.append(str(system.checksum(path)))
    return " ".join(checksums)
