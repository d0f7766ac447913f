"""Logs by their addresses: files, folders, patterns, URLs."""

from __future__ import annotations

import glob
import os
import re
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import Any

from hydrodamp.batch.recordings import ResolvedMapping, digest_files, group_files
from hydrodamp.errors import FileError, HydrodampError
from hydrodamp.ingest.formats.files import SUFFIXES, is_bag, suffix_of
from hydrodamp.ingest.formats.multi_file import PATH_JOINER, split_joined_paths

_JOINT_URL = re.compile(re.escape(PATH_JOINER) + r"(?=\w+://)")


def expand_addresses(
    addresses: Iterable[str],
    mapping: ResolvedMapping | None = None,
    exclude: str | os.PathLike[str] | None = None,
) -> list[str]:
    """Return the recordings that addresses match, in their order, each once.

    Files in the folder ``exclude`` are no logs.
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
            faults.append(f"{address}: no log matches it; logs end in {' '.join(sorted(SUFFIXES))}")
    if faults:
        raise FileError("\n".join(faults))
    if not files:
        raise FileError(f"there is no log but in {exclude}, the folder of results")
    return group_files(files.values(), mapping)


def _match(address: str) -> Iterator[str]:
    if "://" in address:
        yield from _match_remote(address)
        return
    pattern = _spell_out(address)
    is_pattern = "*" in address and not Path(address).exists()
    for path in map(Path, sorted(glob.glob(pattern, recursive=True)) if is_pattern else [address]):
        if path.is_dir() and not is_bag(path):
            yield from _walk(path)
        elif path.exists() or (
            len(parts := split_joined_paths(path)) > 1 and all(p.exists() for p in parts)
        ):
            yield str(path)


def _match_remote(address: str) -> Iterator[str]:
    if _JOINT_URL.search(address):
        yield address
        return
    with remote_errors(address):
        system, path = _open_store(address)
        paths = system.glob(_spell_out(path)) if "*" in path else [path]
        files = [file for each in paths for file in (system.find(each) or [each])]
        yield from [system.unstrip_protocol(file) for file in files if suffix_of(file) in SUFFIXES]


def _spell_out(pattern: str) -> str:
    """Return a pattern whose ``**`` are folders: ``**.parquet`` means ``**/*.parquet``."""
    parts = (
        f"**/*{part.lstrip('*')}" if part.startswith("**") and part.strip("*") else part
        for part in pattern.split("/")
    )
    return "/".join(part if part == "**" else re.sub(r"\*\*+(?!/)", "*", part) for part in parts)


def _walk(folder: Path) -> list[str]:
    """Return the logs beneath a folder, behind links too; a bag is one."""
    logs: list[str] = []
    visited: set[str] = set()
    for place, folders, names in os.walk(folder, followlinks=True):
        real = os.path.realpath(place)
        if real in visited:
            folders.clear()
            continue
        visited.add(real)
        if is_bag(Path(place)):
            folders.clear()
            logs.append(str(Path(place)))
            continue
        paths = (Path(place, name) for name in names if suffix_of(name) in SUFFIXES)
        logs += [str(path) for path in paths if path.is_file()]
    return sorted(logs)


@contextmanager
def remote_errors(address: str) -> Iterator[None]:
    """Raise whatever a store or its client fails with as an error that names the address."""
    try:
        yield
    except HydrodampError:
        raise
    except Exception as error:  # each store has errors of its own
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
    """Provide a recording as files of this machine."""
    if "://" not in address:
        yield address
        return
    with tempfile.TemporaryDirectory() as folder:
        paths = []
        for part in _JOINT_URL.split(address):
            with remote_errors(part):
                system, path = _open_store(part)
                local = Path(folder, PurePosixPath(path).name)
                system.get(path, str(local))
            paths.append(str(local))
        yield paths[0] if len(paths) == 1 else folder


def digest_of_recording(address: str, mapping: ResolvedMapping | None) -> str:
    """Return what changes with a recording: a digest of its files, or what its store says."""
    if "://" not in address:
        return digest_files(address, mapping)
    checksums = []
    for part in _JOINT_URL.split(address):
        with remote_errors(part):
            system, path = _open_store(part)
            checksums.append(str(system.checksum(path)))
    return " ".join(checksums)
