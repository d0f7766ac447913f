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
_BUFFER = 1 << 16  # bytes
_BLOCK = 1 << 20  # bytes
MAX_UNPACKED = 1 << 29  # bytes that any file may unpack to: a day of 20 columns at 30 Hz as text
MAX_RATIO = 20  # unpacked to packed size; text of measured numbers shrinks 2 to 10 times
MAX_COLUMNS = 4096  # of a table; whole-vehicle logs of PX4 have some 2000 fields in all topics
_NO_BAR = nullcontext(lambda count: None)


def head(path: str | Path, size: int) -> bytes:
    """Return the first bytes of a file, unpacked where it is compressed by gzip."""
    with opened(path, counted=False) as file:
        return file.read(size)


def content(path: str | Path) -> bytes:
    """Return all bytes of a file, unpacked where it is compressed by gzip."""
    with opened(path) as file:
        return file.read()


def unpacked_bound(path: str | Path) -> int:
    """Return to how many bytes a file may unpack."""
    return max(MAX_UNPACKED, MAX_RATIO * Path(path).stat().st_size)


def check_unpacked(size: float, path: str | Path) -> None:
    """Refuse a file whose unpacked content is out of proportion to it."""
    if size > (bound := unpacked_bound(path)):
        packed = Path(path).stat().st_size
        raise LogError(
            f"its {packed / 1e6:.3g} MB unpack to more than {bound / 1e6:.4g} MB, as no log of"
            " measured numbers does. If that is what you want, unpack it by other means and give"
            " what comes out",
            source=str(path),
        )


def check_columns(n: int, path: str | Path) -> None:
    """Refuse a table of more columns than any log has."""
    if n > MAX_COLUMNS:
        raise LogError(
            f"the table has {n} columns, at most {MAX_COLUMNS} are read. If rows and columns are"
            " exchanged, transpose it; otherwise keep the columns of the vehicle's motion",
            source=str(path),
        )


class _BoundedGzip(gzip.GzipFile):
    """A compressed file that is read up to :data:`MAX_UNPACKED` or :data:`MAX_RATIO`."""

    def __init__(self, file: IO[bytes], path: str | Path) -> None:
        super().__init__(fileobj=file)
        self.path, self.n_unpacked = path, 0

    def read(self, size: int | None = -1) -> bytes:
        if size is not None and size >= 0:
            return self._checked(super().read(size))
        parts = []
        while part := self._checked(super().read(_BLOCK)):
            parts.append(part)
        return b"".join(parts)

    def read1(self, size: int = -1) -> bytes:
        return self._checked(super().read1(size))

    def _checked(self, part: bytes) -> bytes:
        self.n_unpacked += len(part)
        check_unpacked(self.n_unpacked, self.path)
        return part


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
            yield cast("IO[bytes]", _BoundedGzip(cast("IO[bytes]", file), path) if packed else file)
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
