"""Public logs by name: what is there is checked, what is not is downloaded once."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

from hydrodamp.errors import FileError, list_faults, no_such
from hydrodamp.files import load_yaml, save_all
from hydrodamp.progress import progress

_BLOCK = 1 << 16  # bytes
MAX_DOWNLOAD = 1 << 28  # bytes; the files of the registry have up to 5 MB
_TIMEOUT = 60.0  # s


@dataclass(frozen=True)
class DataFile:
    """A file of a public log; without a checksum where nobody has hashed it."""

    name: str
    url: str = ""
    sha256: str = ""


@dataclass(frozen=True)
class Dataset:
    """A public log.

    Attributes
    ----------
    name, title, note : str
        What it is.
    page : str
        Where its authors show it.
    licence, citation : str
        What one may do with it, and whom to name.
    mapping : str
        The preset that reads it.
    files : tuple of DataFile
        All of it, by name.

    Examples
    --------
    >>> find_dataset("vt690-field").mapping
    'avl690'
    """

    name: str
    title: str
    note: str
    page: str
    licence: str
    citation: str
    mapping: str
    files: tuple[DataFile, ...]


@dataclass(frozen=True)
class Fetched:
    """A public log in a folder: its files with the right checksum, without one, and missing."""

    folder: Path
    verified: tuple[str, ...]
    unchecked: tuple[str, ...]
    lacking: tuple[str, ...]


@lru_cache(maxsize=1)
def datasets() -> Mapping[str, Dataset]:
    """Return all public logs that are known."""
    content: Any = load_yaml(Path(__file__).with_name("datasets.yaml"))
    return MappingProxyType({name: _dataset(name, entry) for name, entry in content.items()})


def _dataset(name: str, entry: Mapping[str, Any]) -> Dataset:
    words = dict(entry)
    found = [
        DataFile(file, f"{source['base']}{file}" if source["base"] else "", checksum or "")
        for source in words.pop("sources")
        for file, checksum in source["files"].items()
    ]
    return Dataset(name, **words, files=tuple(sorted(found, key=lambda file: file.name)))


def find_dataset(name: str) -> Dataset:
    """Return a public log.

    Parameters
    ----------
    name : str
        Such as ``"kvlcc2-hsva"``.

    Returns
    -------
    dataset : Dataset
        What is known of it; nothing is downloaded.

    Raises
    ------
    FileError
        If there is none of this name, with the nearest.

    Examples
    --------
    >>> len(find_dataset("kvlcc2-hsva").files)
    13
    """
    known = datasets()
    if name not in known:
        raise FileError(no_such("dataset", name, known))
    return known[name]


def look(dataset: Dataset, folder: Path) -> Fetched:
    """Check what a folder holds of a public log; nothing is downloaded."""
    there = [file for file in dataset.files if (folder / file.name).exists()]
    faults = [
        f"`{file.name}` is not the file that the registry knows; remove it to fetch it anew"
        for file in there
        if file.sha256 and _sha256(folder / file.name) != file.sha256
    ]
    if faults:
        raise FileError(list_faults(str(folder), faults))
    return Fetched(
        folder,
        verified=tuple(file.name for file in there if file.sha256),
        unchecked=tuple(file.name for file in there if not file.sha256),
        lacking=tuple(file.name for file in dataset.files if file not in there),
    )


def _sha256(path: Path) -> str:
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror or error}.") from error


def fetch(dataset: Dataset, folder: Path) -> Fetched:
    """Bring a public log into a folder, and check it.

    Parameters
    ----------
    dataset : Dataset
        From :func:`find_dataset`; mind its licence.
    folder : Path
        Where its files shall lie; made if need be. What is there is not downloaded again.

    Returns
    -------
    fetched : Fetched
        The names of the files by what they were compared with.

    Raises
    ------
    FileError
        If a file differs from its checksum or cannot be downloaded; files that came before stay.
    """
    lacking = look(dataset, folder).lacking
    for file in dataset.files:
        if file.name in lacking and file.url:
            save_all({folder / file.name: _downloaded(file, folder)})
    return look(dataset, folder)


def _downloaded(file: DataFile, folder: Path) -> bytes:
    """Return the content of a file, with the checksum that the registry knows."""
    from http.client import HTTPException
    from urllib.request import urlopen

    content = bytearray()
    try:
        with urlopen(file.url, timeout=_TIMEOUT) as answer:
            stated = answer.headers.get("Content-Length") or "0"
            size = int(stated) if stated.isascii() and stated.isdigit() else 0
            with progress(f"downloading {file.name}", size or None) as step:
                while part := answer.read(_BLOCK):
                    content += part
                    step(len(part))
                    if max(size, len(content)) > MAX_DOWNLOAD:
                        raise OSError(f"it is larger than {MAX_DOWNLOAD >> 20} MiB")
        if len(content) < size:
            raise OSError(f"its last {size - len(content)} bytes did not come")
    except (OSError, HTTPException) as error:
        raise FileError(
            f"{file.url}: cannot be downloaded: {error}. Fetch it by other means into {folder},"
            " and call again"
        ) from error
    if file.sha256 and hashlib.sha256(content).hexdigest() != file.sha256:
        raise FileError(
            f"{file.url}: what came is not the file that the registry knows, and was not kept."
            " It changed, or something stands between."
        )
    return bytes(content)
