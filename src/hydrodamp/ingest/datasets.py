"""Registry of public logs: download of missing files, check of SHA-256 sums."""

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

_BLOCK_BYTES = 1 << 16  # bytes
MAX_DOWNLOAD_BYTES = 1 << 28  # the files of the registry have up to 5 MB
_TIMEOUT_SECONDS = 60.0  # s


@dataclass(frozen=True)
class DataFile:
    """A file of a public log; the checksum is empty if unknown."""

    name: str
    url: str = ""
    sha256: str = ""


@dataclass(frozen=True)
class Dataset:
    """A public log.

    Attributes
    ----------
    name, title, note : str
        Identifier, title and description.
    page : str
        Web page of the authors.
    licence, citation : str
        Terms of use, and the reference to cite.
    mapping : str
        Preset that reads it.
    files : tuple of DataFile
        All files, sorted by name.

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
class DatasetFiles:
    """Files of a public log in a folder: verified, without a known checksum, and missing."""

    folder: Path
    verified: tuple[str, ...]
    unchecked: tuple[str, ...]
    lacking: tuple[str, ...]


@lru_cache(maxsize=1)
def datasets() -> Mapping[str, Dataset]:
    """Return the registry of public logs by name."""
    content: Any = load_yaml(Path(__file__).with_name("datasets.yaml"))
    return MappingProxyType({name: _make_dataset(name, entry) for name, entry in content.items()})


def _make_dataset(name: str, entry: Mapping[str, Any]) -> Dataset:
    fields = dict(entry)
    files = [
        DataFile(file, f"{source['base']}{file}" if source["base"] else "", checksum or "")
        for source in fields.pop("sources")
        for file, checksum in source["files"].items()
    ]
    return Dataset(name, **fields, files=tuple(sorted(files, key=lambda file: file.name)))


def find_dataset(name: str) -> Dataset:
    """Return the registry entry of a public log.

    Parameters
    ----------
    name : str
        Identifier such as ``"kvlcc2-hsva"``.

    Returns
    -------
    dataset : Dataset
        Its entry; nothing is downloaded.

    Raises
    ------
    FileError
        If the name is unknown; the message suggests the nearest name.

    Examples
    --------
    >>> len(find_dataset("kvlcc2-hsva").files)
    13
    """
    if name not in datasets():
        raise FileError(no_such("dataset", name, datasets()))
    return datasets()[name]


def check_folder(dataset: Dataset, folder: Path) -> DatasetFiles:
    """Check the files of a public log in a folder; nothing is downloaded."""
    present = [file for file in dataset.files if (folder / file.name).exists()]
    if faults := [
        f"`{file.name}` does not match the SHA-256 checksum of the registry; delete it to download"
        " it again"
        for file in present
        if file.sha256 and _sha256(folder / file.name) != file.sha256
    ]:
        raise FileError(list_faults(str(folder), faults))
    return DatasetFiles(
        folder,
        verified=tuple(file.name for file in present if file.sha256),
        unchecked=tuple(file.name for file in present if not file.sha256),
        lacking=tuple(file.name for file in dataset.files if file not in present),
    )


def _sha256(path: Path) -> str:
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror or error}.") from error


def fetch(dataset: Dataset, folder: Path) -> DatasetFiles:
    """Download the missing files of a public log into a folder and verify all files.

    Parameters
    ----------
    dataset : Dataset
        From :func:`find_dataset`; observe its licence.
    folder : Path
        Target folder, created if missing. Existing files are not downloaded again.

    Returns
    -------
    fetched : Fetched
        Names of the verified, unchecked and missing files.

    Raises
    ------
    FileError
        If a file differs from its checksum or cannot be downloaded; files downloaded before
        remain.
    """
    missing = check_folder(dataset, folder).lacking
    for file in dataset.files:
        if file.name in missing and file.url:
            save_all({folder / file.name: _download(file, folder)})
    return check_folder(dataset, folder)


def _download(file: DataFile, folder: Path) -> bytes:
    """Download a file and verify its checksum."""
    from http.client import HTTPException
    from urllib.request import urlopen

    content = bytearray()
    try:
        with urlopen(file.url, timeout=_TIMEOUT_SECONDS) as response:
            length = response.headers.get("Content-Length") or "0"
            size = int(length) if length.isascii() and length.isdigit() else 0
            with progress(f"downloading {file.name}", size or None) as step:
                while block := response.read(_BLOCK_BYTES):
                    content += block
                    step(len(block))
                    if max(size, len(content)) > MAX_DOWNLOAD_BYTES:
                        raise OSError(f"it is larger than {MAX_DOWNLOAD_BYTES >> 20} MiB")
        if len(content) < size:
            raise OSError(f"the last {size - len(content)} bytes are missing")
    except (OSError, HTTPException) as error:
        raise FileError(
            f"{file.url}: cannot be downloaded: {error}. Download it manually into {folder}"
            " and try again"
        ) from error
    if file.sha256 and hashlib.sha256(content).hexdigest() != file.sha256:
        raise FileError(
            f"{file.url}: the download does not match the SHA-256 checksum of the registry and was"
            " discarded. The file has changed, or a proxy replaced it."
        )
    return bytes(content)
