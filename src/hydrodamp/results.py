"""Files of results: what hydrodamp wrote in a folder, and what may therefore be replaced.

A folder of results holds a manifest of the files in it that hydrodamp wrote, with digests. A file
that is not listed there, or that was changed since, belongs to somebody and is never touched.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from hydrodamp.errors import FileError
from hydrodamp.files import check_file, check_folder, load_json, save_all, save_json, save_text

MANIFEST = ".hydrodamp.json"
_FORMAT = "hydrodamp-manifest"


def check_new_file(path: Path, force: bool) -> None:
    """Refuse a file that cannot be written, or that exists unless it may be replaced."""
    check_file(path)
    if path.exists() and not force:
        raise FileError(f"{path}: exists already. Name another file, or replace it with `--force`.")


def check_results(folder: Path, patterns: Iterable[str], force: bool) -> None:
    """Refuse, before work starts, a folder in which results would replace files.

    Patterns name the results that may be written, by their paths in the folder. With force those
    may be there that hydrodamp wrote and nobody changed since. Of a pattern with a star the files
    that hydrodamp did not write are no results, and stay.
    """
    check_folder(folder)
    listed = _listed(folder)
    files = [
        path
        for pattern in patterns
        for path in sorted(folder.glob(pattern))
        if path.is_file() and ("*" not in pattern or _name(path, folder) in listed)
    ]
    if files and not force:
        raise FileError(
            f"{folder}: holds results already, such as {files[0].relative_to(folder)}. Name another"
            " folder, or replace what hydrodamp wrote there with `--force`."
        )
    _check_written(files, folder)


def save_results(contents: Mapping[Path, bytes], folder: Path) -> None:
    """Write files into a folder and list them in its manifest.

    Files that hydrodamp did not write are refused before any is written.
    """
    _check_written(contents, folder)
    digests = {path: hashlib.sha256(content).hexdigest() for path, content in contents.items()}
    _list(digests, folder)  # first, so that whoever is interrupted leaves no file without an owner
    save_all(contents)


def register_results(paths: Iterable[Path], folder: Path) -> None:
    """List files in the manifest of a folder that were just written by other means."""
    _list({path: digest for path in paths if (digest := _digest(path))}, folder)


def save_result(text: str, path: Path) -> None:
    """Write a file that a user named, and list it where its folder is one of results."""
    save_text(text, path)
    if (path.parent / MANIFEST).is_file():
        register_results((path,), path.parent)


def remove_results(folder: Path, patterns: Iterable[str], keep: Iterable[Path] = ()) -> None:
    """Remove what hydrodamp wrote in a folder, by patterns, but what was changed or is kept."""
    listed, kept = _listed(folder), {*keep}
    for path in [path for pattern in patterns for path in sorted(folder.glob(pattern))]:
        if path not in kept and path.is_file() and _is_written(path, folder, listed):
            path.unlink()
            if path.parent != folder:
                with suppress(OSError):  # it holds other files
                    path.parent.rmdir()


def _check_written(paths: Iterable[Path], folder: Path) -> None:
    """Refuse files that are there and not as hydrodamp wrote them."""
    listed = _listed(folder)
    for path in paths:
        if path.exists() and not _is_written(path, folder, listed):
            is_listed = _name(path, folder) in listed
            why = "was changed since hydrodamp wrote it" if is_listed else "is not hydrodamp's"
            raise FileError(
                f"{path}: {why}, so nothing replaces it, `--force` neither. Move it elsewhere, or"
                " name another folder."
            )


def _is_written(path: Path, folder: Path, listed: Mapping[str, list[str]]) -> bool:
    return _digest(path) in listed.get(_name(path, folder), ())


def _listed(folder: Path) -> dict[str, list[str]]:
    """Return the digests that each file may have: as written last, and before that."""
    path = folder / MANIFEST
    if not path.is_file():
        return {}
    content = load_json(path)
    files = content.get("files") if isinstance(content, dict) else None
    if not isinstance(files, dict) or not all(isinstance(it, list) for it in files.values()):
        raise FileError(f"{path}: is no manifest of hydrodamp's. Move it elsewhere.")
    return files


def _list(digests: Mapping[Path, str], folder: Path) -> None:
    listed = _listed(folder)
    for path, digest in digests.items():
        name = _name(path, folder)
        # Until the new content is in place, the old one is hydrodamp's too.
        listed[name] = [digest, *(old for old in listed.get(name, ())[:1] if old != digest)]
    there = {name: known for name, known in listed.items() if _may_exist(name, folder, digests)}
    check_folder(folder)
    folder.mkdir(parents=True, exist_ok=True)
    save_json({"format": _FORMAT, "files": dict(sorted(there.items()))}, folder / MANIFEST)


def _may_exist(name: str, folder: Path, digests: Mapping[Path, str]) -> bool:
    return folder / name in digests or (folder / name).exists()


def _name(path: Path, folder: Path) -> str:
    return path.relative_to(folder).as_posix()


def _digest(path: Path) -> str:
    """Return the digest of a file's content; empty for what is no file."""
    if not path.is_file():
        return ""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
