"""The bytes of a file, compressed by gzip or not; what cannot be opened is named."""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, cast

from hydrodamp.errors import FileError, LogError

GZIP = b"\x1f\x8b"
"""How a file compressed by gzip begins."""


def head(path: str | Path, size: int) -> bytes:
    """Return the first bytes of a file, unpacked where it is compressed by gzip.

    Parameters
    ----------
    path : str or Path
        The file.
    size : int
        How many bytes at most.

    Returns
    -------
    content : bytes
        As many as there are.

    Raises
    ------
    FileError
        If the file cannot be opened.
    LogError
        If the compression is damaged.
    """
    with opened(path) as file:
        return file.read(size)


def content(path: str | Path) -> bytes:
    """Return all bytes of a file, unpacked where it is compressed by gzip.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    content : bytes
        Everything.

    Raises
    ------
    FileError
        If the file cannot be opened.
    LogError
        If the compression is damaged.
    """
    with opened(path) as file:
        return file.read()


@contextmanager
def opened(path: str | Path) -> Iterator[IO[bytes]]:
    """Open a file for reading, unpacked where it is compressed by gzip.

    Parameters
    ----------
    path : str or Path
        The file.

    Yields
    ------
    file : binary file
        At its beginning.

    Raises
    ------
    FileError
        If the file cannot be opened.
    LogError
        If the compression is damaged.
    """
    try:
        with open(path, "rb") as file:
            packed = file.read(2) == GZIP
            file.seek(0)
            yield cast("IO[bytes]", gzip.GzipFile(fileobj=file)) if packed else file
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise LogError(
            f"the gzip compression is cut off or damaged ({error}). Copy the file again, or unpack"
            " what is left of it with `gzip -dc FILE > LOG`",
            source=str(path),
        ) from error
    except (FileError, LogError):
        raise
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror or error}") from error
