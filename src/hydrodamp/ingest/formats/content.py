"""The bytes of a file, compressed by gzip or not; what cannot be opened is named."""

from __future__ import annotations

import gzip
import io
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, cast

from hydrodamp.advance import advance
from hydrodamp.errors import FileError, LogError

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

GZIP = b"\x1f\x8b"
"""How a file compressed by gzip begins."""

_BUFFER = 1 << 16


def head(path: str | Path, size: int) -> bytes:
    """Return the first bytes of a file, unpacked where it is compressed by gzip."""
    with opened(path) as file:
        return file.read(size)


def content(path: str | Path) -> bytes:
    """Return all bytes of a file, unpacked where it is compressed by gzip."""
    with opened(path) as file:
        return file.read()


def size_of(path: str | Path) -> int:
    """Return how large a file is, or all files right in a folder."""
    path = Path(path)
    try:
        inside = path.iterdir() if path.is_dir() else (path,)
        return sum(each.stat().st_size for each in inside if each.is_file())
    except OSError:
        return 0


@contextmanager
def followed(path: str | Path) -> Iterator[IO[bytes]]:
    """Open a file as :func:`opened` does, and tell how much of it has been read, block by block."""
    with _unpacked(path, _Followed) as file:
        yield file


@contextmanager
def opened(path: str | Path) -> Iterator[IO[bytes]]:
    """Open a file for reading, unpacked where it is compressed by gzip."""
    with _unpacked(path, io.FileIO) as file:
        yield file


class _Followed(io.FileIO):
    """A file that tells how much of it has been read."""

    def __init__(self, path: str | Path) -> None:
        super().__init__(path)
        self.by = advance(size_of(path))

    def readinto(self, buffer: WriteableBuffer, /) -> int | None:
        count = super().readinto(buffer)
        self.by(count or 0)
        return count


@contextmanager
def _unpacked(path: str | Path, kind: type[io.FileIO]) -> Iterator[IO[bytes]]:
    try:
        with io.BufferedReader(kind(path), _BUFFER) as file:
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
