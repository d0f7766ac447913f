"""Writing bytes whole or not at all, and asking beforehand whether one may."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from hydrodamp.errors import FileError


def save_bytes(content: bytes, path: str | os.PathLike[str]) -> None:
    """Write bytes to a temporary file beside ``path``, then rename it.

    Parameters
    ----------
    content : bytes
        What to write.
    path : str or path
        The file; one that is there is replaced.

    Raises
    ------
    FileError
        If the folder is not there or cannot be written.
    """
    target = Path(path)
    try:
        handle, temporary = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
        try:
            with os.fdopen(handle, "wb") as stream:
                stream.write(content)
            Path(temporary).chmod(0o644)
            Path(temporary).replace(target)
        except OSError:
            Path(temporary).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise FileError(f"{target}: cannot be written: {error.strerror}.") from error


def check_folder(path: str | os.PathLike[str]) -> None:
    """Refuse a folder that cannot be made or written, before work starts.

    What is made to find out is removed again.

    Parameters
    ----------
    path : str or path
        A folder that is there or is to be made.

    Raises
    ------
    FileError
        If it is a file, cannot be made, or cannot be written.
    """
    folder = Path(path)
    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=folder)
        os.close(handle)
        Path(temporary).unlink()
    except OSError as error:
        raise FileError(
            f"{folder}: no folder can be made or written there: {error.strerror}. Give another one."
        ) from error
    finally:
        for each in missing:
            if each.is_dir():
                each.rmdir()


def check_file(path: str | os.PathLike[str]) -> None:
    """Refuse a file that cannot be written, before work starts.

    Parameters
    ----------
    path : str or path
        The file to be written; its folder must be there.

    Raises
    ------
    FileError
        If the folder is not there or cannot be written, or the path is a folder.
    """
    target = Path(path)
    if target.is_dir():
        raise FileError(f"{target}: is a folder; name a file in it.")
    if not target.parent.is_dir():
        raise FileError(f"{target}: cannot be written: there is no folder {target.parent}.")
    check_folder(target.parent)
