"""Fetching a public log: what is there is checked, what is not is downloaded once."""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from hydrodamp.errors import FileError, list_faults
from hydrodamp.ingest.datasets.lock import LOCK, record, recorded, sha256
from hydrodamp.ingest.datasets.registry import DataFile, Dataset
from hydrodamp.ingest.formats.detect import INSTALL


@dataclass(frozen=True)
class Fetched:
    """A public log in a folder."""

    dataset: Dataset
    folder: Path
    verified: tuple[str, ...]
    locked: tuple[str, ...]
    unchecked: tuple[str, ...]
    lacking: tuple[str, ...]
    downloaded: tuple[str, ...] = ()
    recorded: tuple[str, ...] = ()


def look(dataset: Dataset, folder: Path) -> Fetched:
    """Look at what a folder holds of a public log, and check it; nothing is downloaded."""
    known = recorded(folder)
    there = [file for file in dataset.files if (folder / file.name).exists()]
    faults = [fault for file in there if (fault := _fault(file, folder, known))]
    if faults:
        raise FileError(list_faults(str(folder), faults))
    without = [file.name for file in there if not file.sha256]
    return Fetched(
        dataset,
        folder,
        verified=tuple(file.name for file in there if file.sha256),
        locked=tuple(name for name in without if name in known),
        unchecked=tuple(name for name in without if name not in known),
        lacking=tuple(file.name for file in dataset.files if file not in there),
    )


Reach = Callable[[str, int, int], None]
"""Takes the name of a file, how many bytes of it have come, and how many it has, 0 if unknown."""


def fetch(dataset: Dataset, folder: Path, reach: Reach | None = None) -> Fetched:
    """Bring a public log into a folder, and check it.

    Parameters
    ----------
    dataset : Dataset
        From :func:`~hydrodamp.ingest.datasets.registry.find_dataset`; mind its licence.
    folder : Path
        Where its files shall lie; made if need be. What is there is not downloaded again.
    reach : callable, optional
        Called as bytes come, with the name of the file, how many of its bytes are there and
        of how many, 0 where the server does not tell.

    Returns
    -------
    fetched : Fetched
        With what was downloaded and what each file was compared with.

    Raises
    ------
    FileError
        If a file differs from its checksum, cannot be downloaded, or the package pooch is
        missing; files that came before stay.
    """
    before = look(dataset, folder)
    wanted = [file for file in dataset.files if file.name in before.lacking and file.url]
    _download_all(wanted, folder, reach)
    return dataclasses.replace(
        look(dataset, folder),
        downloaded=tuple(file.name for file in wanted),
        recorded=tuple(file.name for file in wanted if not file.sha256),
    )


@dataclass
class _Bar:
    """A progress bar as pooch wants one: what it counts is handed on."""

    name: str
    reach: Reach
    total: int = 0
    count: int = 0

    def update(self, more: int) -> None:
        """Count bytes: those of whole blocks, so that the last seems too long."""
        if more:
            self.count = min(self.count + more, self.total or self.count + more)
            self.reach(self.name, self.count, self.total)

    def reset(self) -> None:
        """Begin anew: pooch does, and then tells all bytes at once."""
        self.count = 0

    def close(self) -> None:
        """Do nothing: what shows the bar ends it."""


def _fault(file: DataFile, folder: Path, known: Mapping[str, str]) -> str:
    """Return what is wrong with a file that is there, or nothing."""
    right = file.sha256 or known.get(file.name, "")
    if not right or sha256(folder / file.name) == right:
        return ""
    whose = "the registry" if file.sha256 else f"`{LOCK}`"
    return f"`{file.name}` is not the file that {whose} knows; remove it to fetch it anew"


def _download_all(files: Sequence[DataFile], folder: Path, reach: Reach | None) -> None:
    if not files:
        return
    pooch = _pooch(files[0])
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"{folder}: cannot be made: {error.strerror or error}.") from error
    for file in files:
        _download(pooch, file, folder, reach)


def _pooch(file: DataFile) -> Any:
    try:
        pooch = import_module("pooch")
    except ImportError as error:
        raise FileError(
            f"{file.url}: downloads need the package pooch. Install it: {INSTALL}"
        ) from error
    pooch.get_logger().setLevel(logging.WARNING)  # it would tell every hash, on standard error
    return pooch


def _download(pooch: Any, file: DataFile, folder: Path, reach: Reach | None) -> None:
    """Fetch one file; it takes its place only once it is whole and has the right checksum."""
    known = f"sha256:{file.sha256}" if file.sha256 else None
    bar = False if reach is None else _Bar(file.name, reach)
    try:
        pooch.retrieve(file.url, known_hash=known, fname=file.name, path=folder, progressbar=bar)
    except ValueError as error:
        raise FileError(
            f"{file.url}: what came is not the file that the registry knows, and was not kept."
            " It changed, or something stands between."
        ) from error
    except OSError as error:  # those of requests among them
        raise FileError(
            f"{file.url}: cannot be downloaded: {error}. Fetch it by other means into {folder},"
            " and call again"
        ) from error
    if not file.sha256:
        record(folder, recorded(folder) | {file.name: sha256(folder / file.name)})
