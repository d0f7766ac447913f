"""Writing files whole or not at all, and asking beforehand whether one may."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from hydrodamp.errors import FileError


@contextmanager
def replacing(path: str | os.PathLike[str], *, binary: bool = False) -> Iterator[IO[Any]]:
    """Open a temporary file beside ``path`` that takes its place once all is written."""
    target = Path(path)
    temporary = _beside(target)
    try:
        with (
            temporary.open("xb") if binary else temporary.open("x", encoding="utf-8", newline="")
        ) as stream:
            yield stream
        temporary.replace(target)
    except OSError as error:
        raise FileError(
            f"{target}: cannot be written: {error.strerror or error}. Give a file in a folder that "
            "exists and may be written."
        ) from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def save_text(text: str, path: str | os.PathLike[str]) -> None:
    """Write a text file whole or not at all."""
    with replacing(path) as stream:
        stream.write(text)


def save_json(document: object, path: str | os.PathLike[str]) -> None:
    """Write a document of strict JSON whole or not at all."""
    save_text(as_json(document), path)


def as_json(document: object) -> str:
    r"""Return a document as text."""
    return json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def save_bytes(content: bytes, path: str | os.PathLike[str]) -> None:
    """Write a file of bytes whole or not at all."""
    with replacing(path, binary=True) as stream:
        stream.write(content)


def save_together(
    contents: Mapping[Path, bytes], removed: Iterable[Path] = (), *, last: Path | None = None
) -> None:
    """Write several files as one step: all of them, or none if anything interrupts or fails."""
    folders = dict.fromkeys(path.parent for path in contents)
    missing = sorted({each for folder in folders for each in _missing(folder)}, reverse=True)
    temporary = {path: _beside(path) for path in contents}
    try:
        _make(folders)
        for path, content in contents.items():
            with _naming(path):
                temporary[path].write_bytes(content)
        with _undisturbed():
            _swap(temporary, removed, last)
        missing = []
    finally:
        for path in temporary.values():
            with suppress(OSError):
                path.unlink(missing_ok=True)
        for folder in missing:
            with suppress(OSError):
                folder.rmdir()


def _beside(path: Path) -> Path:
    """Return a new name in the folder of a file."""
    return path.parent / f".hydrodamp-{os.urandom(8).hex()}"


@contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Say of a failure which file was meant, not by what name it was written."""
    try:
        yield
    except OSError as error:
        raise FileError(
            f"{path}: cannot be written: {error.strerror or error}. Make room, close it in other "
            "programs, or give another folder."
        ) from error


def _make(folders: Iterable[Path]) -> None:
    for folder in folders:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FileError(f"{folder}: the folder cannot be made: {error.strerror}.") from error


def _missing(folder: Path) -> list[Path]:
    """Return what must be made for a folder to be there, itself first."""
    return [each for each in (folder, *folder.parents) if not each.exists()]


def _swap(temporary: Mapping[Path, Path], removed: Iterable[Path], last: Path | None) -> None:
    """Set aside what is there, then put the new in place; undo all where anything fails."""
    aside: dict[Path, Path] = {}
    placed: list[Path] = []
    try:
        for path in sorted(dict.fromkeys((*temporary, *removed)), key=lambda each: each != last):
            if path.is_symlink() or path.is_file():
                with _naming(path):
                    aside[path] = path.rename(_beside(path))
        for path in sorted(temporary, key=lambda each: each == last):
            with _naming(path):
                temporary[path].replace(path)
            placed.append(path)
    except BaseException:
        _put_back(aside, placed)
        raise
    for backup in aside.values():
        with suppress(OSError):
            backup.unlink()


def _put_back(aside: dict[Path, Path], placed: Iterable[Path]) -> None:
    for path in placed:
        with suppress(OSError):
            path.unlink()
    for path, backup in reversed(aside.items()):  # what says that the others are there comes last
        with suppress(OSError):
            backup.replace(path)


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Let Ctrl-C wait for the few renames of a step; only the main thread is ever told of it."""
    import signal
    import threading

    before = signal.getsignal(signal.SIGINT)
    if before is None or threading.current_thread() is not threading.main_thread():
        yield  # a handler that is not Python's could not be put back
        return
    came: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if came:
        signal.raise_signal(signal.SIGINT)


def check_folder(path: str | os.PathLike[str]) -> None:
    """Refuse a folder that cannot be made or written, before work starts."""
    import tempfile

    folder = Path(path)
    missing = _missing(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise FileError(
            f"{folder}: no folder can be made or written there: {error.strerror}. Give another one."
        ) from error
    finally:
        for each in missing:
            with suppress(OSError):
                each.rmdir()


def check_file(path: str | os.PathLike[str]) -> None:
    """Refuse a file that cannot be written, before work starts."""
    target = Path(path)
    if target.is_dir():
        raise FileError(f"{target}: is a folder; name a file in it.")
    if not target.parent.is_dir():
        raise FileError(f"{target}: cannot be written: there is no folder {target.parent}.")
    check_folder(target.parent)
