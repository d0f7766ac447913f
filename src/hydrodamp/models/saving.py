"""Writing a text file whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from hydrodamp.errors import FileError


def save_text(text: str, path: str | os.PathLike[str]) -> None:
    """Write a text to a temporary file beside ``path``, then rename it.

    Parameters
    ----------
    text : str
        What to write, as UTF-8.
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
    except OSError as error:
        raise FileError(
            f"{target}: cannot be written: {error.strerror}. Give a file in a folder that exists "
            "and may be written."
        ) from error
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as stream:
            stream.write(text)
        Path(temporary).chmod(0o644)
        Path(temporary).replace(target)
    except OSError as error:
        Path(temporary).unlink(missing_ok=True)
        raise FileError(f"{target}: cannot be written: {error.strerror}.") from error


def load_text(path: str | os.PathLike[str]) -> str:
    """Return the text of a file.

    Parameters
    ----------
    path : str or path
        A UTF-8 file.

    Returns
    -------
    text : str
        Without a byte order mark.

    Raises
    ------
    FileError
        If there is no such file or it is no text.
    """
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        raise FileError(f"{path}: is no UTF-8 text (byte {error.start}).") from error
