"""The folder of an export: what was written there, what may be replaced, files in their place."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from hydrodamp.errors import FileError
from hydrodamp.export.target import Files
from hydrodamp.files import check_folder, load_json, save_all
from hydrodamp.text import first_few

CARD = "fidelity.json"
"""The card's name in the folder of an export; its ``files`` are the manifest."""

_NAMED = 6  # files in a message


def save(files: Files, folder: Path) -> None:
    """Write the files of an export into a folder."""
    save_all({folder / path: _bytes(content) for path, content in files.items()})


def manifest_of(files: Files) -> dict[str, str]:
    """Return the SHA-256 digest of each file by its path in the folder."""
    return {path: hashlib.sha256(_bytes(content)).hexdigest() for path, content in files.items()}


def check_export(folder: Path, force: bool) -> None:
    """Refuse a folder that cannot be written, or where an export would replace other files.

    With ``force`` the files of an earlier export may be replaced as long as nobody edited them.
    """
    check_folder(folder)
    if not folder.exists() or not any(folder.iterdir()):
        return
    if not (folder / CARD).is_file():
        raise FileError(f"{folder}: holds files that are no export; name a new folder.")
    if not force:
        raise FileError(f"{folder}: holds an earlier export; name another, or say --force.")
    earlier = _manifest(folder)
    edited = [
        path
        for path, digest in earlier.items()
        if os.path.lexists(folder / path) and _digest(folder / path) != digest
    ]
    if edited:
        raise FileError(
            f"{folder}: {_list(edited)} edited since the export, and --force replaces only files "
            "that an export wrote. Move what is edited elsewhere, or name a new folder."
        )


def replace_export(folder: Path, made: Path, files: Iterable[str], backup: Path) -> None:
    """Move the files of an export from where they were made into their folder.

    Files of an earlier export there, and its card, make room; all others stay. Where that fails,
    everything is moved back.
    """
    earlier = [*_manifest(folder), CARD] if (folder / CARD).is_file() else []
    new = [*files, CARD]
    taken = [path for path in new if path not in earlier and os.path.lexists(folder / path)]
    if taken:
        raise FileError(
            f"{folder}: {_list(taken)} not written by the earlier export, and would be replaced. "
            "Move what is yours elsewhere, or name a new folder."
        )
    moved: list[tuple[Path, Path]] = []

    def move(source: Path, target: Path) -> None:
        target.parent.mkdir(parents=True, exist_ok=True)
        source.rename(target)
        moved.append((source, target))

    try:
        for path in earlier:
            if os.path.lexists(folder / path):
                move(folder / path, backup / path)
        for path in new:
            move(made / path, folder / path)
    except BaseException as error:  # an interrupt too leaves the earlier export whole
        for source, target in reversed(moved):
            target.rename(source)
        _remove_empty(folder, new)
        if isinstance(error, OSError):
            raise FileError(f"{folder}: cannot be written: {error}.") from error
        raise
    _remove_empty(folder, earlier)


def _manifest(folder: Path) -> dict[str, str]:
    """Return the digests that a card lists, or say that it lists none."""
    card = load_json(folder / CARD)
    files = card.get("files") if isinstance(card, Mapping) else None
    inside = isinstance(files, Mapping) and all(
        isinstance(path, str) and not Path(path).is_absolute() and ".." not in Path(path).parts
        for path in files
    )
    if not inside or not files:
        raise FileError(
            f"{folder / CARD}: `files` must list what the export wrote, and does not: name a new "
            "folder."
        )
    return {path: str(digest) for path, digest in files.items()}


def _remove_empty(folder: Path, paths: Iterable[str]) -> None:
    """Remove folders that the files of an export were in, where nothing is left in them."""
    for path in paths:
        for parent in (folder / path).parents:
            if not parent.is_relative_to(folder):
                break
            with suppress(OSError):
                parent.rmdir()


def _bytes(content: str | bytes) -> bytes:
    return content.encode("utf-8") if isinstance(content, str) else content


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""


def _list(paths: list[str]) -> str:
    return f"{', '.join(first_few(paths, _NAMED, 'files'))} {'was' if len(paths) == 1 else 'were'}"
