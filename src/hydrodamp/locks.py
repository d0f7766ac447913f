"""Locks between processes: of an open file, and of a folder."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from time import sleep

from hydrodamp.files import write_error

LOCK_OFFSET = 0x7FFF0000  # bytes; Windows locks a byte behind the content, which others may read
_POLL_INTERVAL = 0.01  # s


def acquire_lock(descriptor: int) -> bool:
    """Return whether this process has the lock of a file, or the file system has no locks.

    The operating system releases the lock when the file is closed or the process ends.
    """
    try:
        if sys.platform == "win32":
            import msvcrt

            os.lseek(descriptor, LOCK_OFFSET, os.SEEK_SET)
            try:
                msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
            finally:
                os.lseek(descriptor, 0, os.SEEK_SET)  # a child process writes at the offset
        else:
            import fcntl

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    except OSError:
        return True
    return True


@contextmanager
def locked_folder(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder, after other processes have released it."""
    is_openable = sys.platform != "win32"  # else a file in the folder has the lock
    path = folder if is_openable else folder / ".hydrodamp-lock"
    try:
        descriptor = os.open(path, os.O_RDONLY if is_openable else os.O_RDWR | os.O_CREAT)
    except OSError as error:
        raise write_error(folder, error) from error
    try:
        while not acquire_lock(descriptor):
            sleep(_POLL_INTERVAL)
        yield
    finally:
        os.close(descriptor)
        if not is_openable:
            with suppress(OSError):  # another process has it open
                path.unlink()
