"""Bytes of a log file, decompressed if gzip, with bounds against decompression bombs."""

from __future__ import annotations

import codecs
import gzip
import io
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, cast

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import FileError, LogError
from hydrodamp.files import irregular_file
from hydrodamp.progress import Step, progress

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

_GZIP_SIGNATURE = b"\x1f\x8b"
_BUFFER_BYTES = 1 << 16  # bytes
_BLOCK_BYTES = 1 << 20  # bytes
MAX_UNPACKED_BYTES = 1 << 29  # a day of 20 text columns at 30 Hz
MAX_UNPACKED_RATIO = 20  # gzip compresses measured numbers by 2 to 10
MESSAGE_COPIES = 32  # of a message: MOOS and MAVLink take 20 to 25 times its bytes in memory
_CELL_BYTES = 8  # bytes; of a number, or of a reference to a text
_TEXT_BYTES = 64  # bytes; of a short text in memory
_FREE_BYTES = 1 << 26  # bytes; a block of text and its cells need half of it
MAX_COLUMNS = 4096  # PX4 logs have some 2000 fields in all topics
_NO_PROGRESS = nullcontext(lambda count: None)

#: Error handler that decodes bytes invalid in UTF-8 as Windows-1252.
CP1252_FALLBACK = "hydrodamp.western"


def _decode_cp1252(error: UnicodeError) -> tuple[str, int]:
    assert isinstance(error, UnicodeDecodeError)
    decoded = error.object[error.start : error.end].decode("cp1252", "replace")
    return decoded if error.encoding == "utf-8" else "\ufffd", error.end


codecs.register_error(CP1252_FALLBACK, _decode_cp1252)

ENCODINGS = {
    rb"\xef\xbb\xbf": "utf-8-sig",
    rb"\xff\xfe|\xfe\xff": "utf-16",
    rb"([^\0]\0){4}": "utf-16-le",
    rb"(\0[^\0]){4}": "utf-16-be",
}


def read_head(path: str | Path, size: int) -> bytes:
    """Return the first bytes of a file, decompressed."""
    with open_log(path, counted=False) as file:
        return file.read(size)


def as_numbers(values: Any) -> FloatArray:
    """Return numbers in double precision; a signalling NaN is a NaN like others."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.multiply(values, 1.0, dtype=np.float64))


def read_bytes(path: str | Path) -> bytes:
    """Return all bytes of a log of messages, decompressed."""
    bound = max_unpacked_bytes(path, MESSAGE_COPIES)
    with open_log(path) as file:
        data = file.read(bound + 1 if isinstance(file, gzip.GzipFile) else -1)
    check_unpacked(len(data), path, MESSAGE_COPIES)
    return data


def max_unpacked_bytes(path: str | Path, copies: int = 1) -> int:
    """Return the largest decompressed size [bytes] allowed for a file."""
    return max(MAX_UNPACKED_BYTES // copies, MAX_UNPACKED_RATIO * Path(path).stat().st_size)


def check_unpacked(size: float, path: str | Path, copies: int = 1) -> None:
    """Refuse a file with an implausible compression ratio."""
    if size > (bound := max_unpacked_bytes(path, copies)):
        packed = Path(path).stat().st_size
        raise LogError(
            f"its {packed / 1e6:.3g} MB unpack to more than {bound / 1e6:.4g} MB, which is"
            " implausible for a log. If the file is correct, unpack it and read the result",
            source=str(path),
        )


def check_cells(n: int, path: str | Path, n_texts: int = 0) -> None:
    """Refuse a table whose cells, and distinct texts, need an implausible amount of memory."""
    check_unpacked(_CELL_BYTES * n + _TEXT_BYTES * n_texts, path)
    check_memory()


def check_memory() -> None:
    """Raise MemoryError under a limit of memory, before Arrow would abort the process there."""
    np.empty(_FREE_BYTES, np.uint8)


def check_columns(n: int, path: str | Path) -> None:
    """Refuse a table with an implausible number of columns."""
    if n > MAX_COLUMNS:
        raise LogError(
            f"the table has {n} columns; the maximum is {MAX_COLUMNS}. If rows and columns are"
            " swapped, transpose it; otherwise keep only the columns of the vehicle's motion",
            source=str(path),
        )


class _BoundedGzip(gzip.GzipFile):
    """A gzip file with a bound on its decompressed size."""

    def __init__(self, file: IO[bytes], path: str | Path) -> None:
        super().__init__(fileobj=file)
        self.path, self.n_unpacked = path, 0

    def read(self, size: int | None = -1) -> bytes:
        if size is not None and size >= 0:
            return self._count(super().read(size))
        return b"".join(iter(partial(self.read, _BLOCK_BYTES), b""))

    def read1(self, size: int = -1) -> bytes:
        return self._count(super().read1(size))

    def _count(self, block: bytes) -> bytes:
        self.n_unpacked += len(block)
        check_unpacked(self.n_unpacked, self.path)
        return block


@contextmanager
def open_seekable(path: str | Path) -> Iterator[IO[bytes]]:
    """Open a file for a library that seeks; a gzip file is decompressed in memory."""
    with open_log(path) as file:
        yield io.BytesIO(file.read()) if isinstance(file, gzip.GzipFile) else file


class _CountedFile(io.FileIO):
    """A file that reports the bytes read to a progress bar."""

    def __init__(self, path: str | Path, step: Step) -> None:
        super().__init__(path)
        self.step = step

    def readinto(self, buffer: WriteableBuffer, /) -> int | None:
        count = super().readinto(buffer)
        self.step(count or 0)
        return count

    def readall(self) -> bytes:
        data = super().readall()
        self.step(len(data))
        return data


@contextmanager
def open_log(path: str | Path, *, counted: bool = True) -> Iterator[IO[bytes]]:
    """Open a file for reading, decompressed, with a progress bar if `counted`."""
    if fault := irregular_file(path):
        raise LogError(fault, source=str(path))
    try:
        size = Path(path).stat().st_size
        bar = progress(f"reading {Path(path).name}", size) if counted else _NO_PROGRESS
        with bar as step, io.BufferedReader(_CountedFile(path, step), _BUFFER_BYTES) as file:
            packed = file.peek(len(_GZIP_SIGNATURE)).startswith(_GZIP_SIGNATURE)
            yield cast("IO[bytes]", _BoundedGzip(cast("IO[bytes]", file), path) if packed else file)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise LogError(
            f"the gzip stream is truncated or damaged ({error}). Copy the file again, or recover"
            " the readable beginning with `gzip -dc FILE > LOG`",
            source=str(path),
        ) from error
    except OSError as error:
        if error.errno is None:  # raised by the reader, not by the file system
            raise
        raise FileError(f"{path}: cannot be read: {error.strerror or error}") from error
