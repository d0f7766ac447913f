"""The bytes of a file, compressed by gzip or not; a file that cannot be opened is named."""

from __future__ import annotations

import gzip
import io
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import IO, TYPE_CHECKING, cast

from hydrodamp.errors import FileError, LogError
from hydrodamp.progress import Step, progress

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

_GZIP = b"\x1f\x8b"
_BUFFER = 1 << 16
_NO_BAR = nullcontext(lambda count: None)


def head(path: str | Path, size: int) -> bytes:
    """Return the first bytes of a file, unpacked where it is compressed by gzip."""
    with opened(path, counted=False) as file:
        return file.read(size)


def content(path: str | Path) -> bytes:
    """Return all bytes of a file, unpacked where it is compressed by gzip."""
    with opened(path) as file:
        return file.read()


@contextmanager
def seekable(path: str | Path) -> Iterator[IO[bytes]]:
    """Open a file for a library that seeks in it: in memory where gzip has to unpack it."""
    with opened(path) as file:
        yield io.BytesIO(file.read()) if isinstance(file, gzip.GzipFile) else file


class _CountedFile(io.FileIO):
    """A file that says how many of its bytes have been read."""

    def __init__(self, path: str | Path, step: Step) -> None:
        super().__init__(path)
        self.step = step

    def readinto(self, buffer: WriteableBuffer, /) -> int | None:
        count = super().readinto(buffer)
        self.step(count or 0)
        return count

    def readall(self) -> bytes:
        rest = super().readall()
        self.step(len(rest))
        return rest


@contextmanager
def opened(path: str | Path, *, counted: bool = True) -> Iterator[IO[bytes]]:
    """Open a file for reading, unpacked where it is compressed by gzip, under a bar if counted."""
    try:
        size = Path(path).stat().st_size
        bar = progress(f"reading {Path(path).name}", size) if counted else _NO_BAR
        with bar as step, io.BufferedReader(_CountedFile(path, step), _BUFFER) as file:
            packed = file.peek(len(_GZIP)).startswith(_GZIP)
            yield cast("IO[bytes]", gzip.GzipFile(fileobj=file) if packed else file)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise LogError(
            f"the gzip compression is cut off or damaged ({error}). Copy the file again, or unpack"
            " what is left of it with `gzip -dc FILE > LOG`",
            source=str(path),
        ) from error
    except OSError as error:
        if error.errno is None:  # not of the file system, but of who reads the file
            raise
        raise FileError(f"{path}: cannot be read: {error.strerror or error}") from error
