"""The public logs that are known by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import as_file, files
from types import MappingProxyType
from typing import Any, cast

from hydrodamp.errors import FileError, did_you_mean
from hydrodamp.files import load_yaml


@dataclass(frozen=True)
class DataFile:
    """A file of a public log."""

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


@lru_cache(maxsize=1)
def datasets() -> Mapping[str, Dataset]:
    """Return all public logs that are known."""
    with as_file(files(__package__) / "registry.yaml") as path:
        content = cast("dict[str, Any]", load_yaml(path))
    return MappingProxyType({name: _dataset(name, entry) for name, entry in content.items()})


def find_dataset(name: str) -> Dataset:
    """Return a public log.

    Parameters
    ----------
    name : str
        Such as ``"kvlcc2-hsva"``; see :func:`datasets`.

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
        listed = ", ".join(known)
        raise FileError(
            f"no dataset is called '{name}'.{did_you_mean(name, known)} Known: {listed}."
        )
    return known[name]


def _dataset(name: str, entry: Mapping[str, Any]) -> Dataset:
    words = {key: value for key, value in entry.items() if key != "sources"}
    found = [
        DataFile(file, f"{source['base']}{file}" if source["base"] else "", checksum or "")
        for source in entry["sources"]
        for file, checksum in source["files"].items()
    ]
    return Dataset(name, **words, files=tuple(sorted(found, key=lambda file: file.name)))
