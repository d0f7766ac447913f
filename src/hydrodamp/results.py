"""Result folders: a manifest of written files with SHA-256 digests, and one exchange of them all.

The manifest ``.hydrodamp.json`` lists the files that hydrodamp wrote. A file that it does not list,
or whose content differs from its digest, belongs to the user and is never replaced.

New files and a journal are written into a staging folder. Its renaming to ``.hydrodamp-commit`` is
the commit point: an earlier abort leaves the old files, and after a later one the next command that
uses the folder completes the exchange.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from itertools import chain
from pathlib import Path, PurePosixPath

from hydrodamp.errors import FileError
from hydrodamp.files import (
    as_json,
    check_file,
    check_folder,
    create_folder,
    load_json,
    refuse_input,
    save_text,
    write_error,
    write_new_file,
)
from hydrodamp.locks import locked_folder

MANIFEST = ".hydrodamp.json"
_STAGING, _COMMIT = ".hydrodamp-staging", ".hydrodamp-commit"
#: In these folders: the new files, and the digests of the files that they replace.
_NEW, _JOURNAL = "new", "journal.json"


def check_new_file(path: Path | None, force: bool) -> None:
    """Refuse a file that cannot be written, is an input, or exists without ``force``."""
    if path is None:
        return
    check_file(path)
    complete_exchange(path.parent)
    if path.exists() and not force:
        raise FileError(f"{path}: exists already. Name another file, or replace it with `--force`.")


def check_results(folder: Path, patterns: Iterable[str], force: bool) -> None:
    """Refuse, before work starts, a folder in which results would replace files.

    Patterns are paths in the folder. A pattern with a star matches listed files only, so that other
    files of the user may remain. With ``force``, files that hydrodamp wrote and that nobody changed
    may be replaced; inputs of the running command are not.
    """
    check_folder(folder)
    complete_exchange(folder)
    manifest = _read_manifest(folder)
    files = []
    for pattern in patterns:
        for path in filter(Path.is_file, sorted(folder.glob(pattern))):
            refuse_input(path)
            if "*" not in pattern or _name(path, folder) in manifest:
                files.append(path)
    if files and not force:
        raise FileError(
            f"{folder}: holds results already, such as {files[0].relative_to(folder)}. Name another"
            " folder, or replace what hydrodamp wrote there with `--force`."
        )
    _check_replaceable(files, folder, manifest)


def save_results(
    contents: Mapping[Path, bytes],
    folder: Path,
    obsolete: Iterable[str] = (),
    outside: Mapping[Path, bytes | None] | None = None,
) -> None:
    """Write files into a folder and its manifest, and remove obsolete ones: all of it, or nothing.

    Files that hydrodamp did not write are refused before any is written. Files that match the
    patterns ``obsolete`` are removed unless they are new or were changed. Files ``outside`` the
    folder have names that the user gave: they are replaced whatever they are, or removed if None.
    """
    root = folder.parent if outside else folder
    with _locked_for_exchange(root):
        manifest = _read_manifest(folder)
        _check_replaceable(contents, folder, manifest)
        matches = chain.from_iterable(folder.glob(pattern) for pattern in obsolete)
        removed = {
            path
            for path in matches
            if path not in contents and path.is_file() and _is_unchanged(path, folder, manifest)
        }
        listed = {
            name: digest
            for name, digest in manifest.items()
            if (path := folder / name).exists() and path not in removed
        } | {_name(path, folder): _sha256(content) for path, content in contents.items()}
        named = outside or {}
        files = {path: content for path, content in named.items() if content is not None}
        removed |= named.keys() - files.keys()
        if listed:
            files[folder / MANIFEST] = _manifest_text(listed)
        else:
            removed.add(folder / MANIFEST)
        _exchange({**contents, **files}, removed, root)


def save_result(text: str, path: Path) -> None:
    """Write a file that the user named, and list it where its folder has a manifest."""
    folder = path.parent
    complete_exchange(folder)
    if not (folder / MANIFEST).is_file():
        save_text(text, path)
        return
    with _locked_for_exchange(folder):
        content = text.encode("utf-8")
        listed = _read_manifest(folder) | {path.name: _sha256(content)}
        _exchange({path: content, folder / MANIFEST: _manifest_text(listed)}, (), folder)


def complete_exchange(folder: Path) -> None:
    """Complete the exchange of files that an aborted process committed, and remove its rest."""
    if (folder / _COMMIT).is_dir() or (folder / _STAGING).is_dir():
        with locked_folder(folder):
            _complete(folder)


@contextmanager
def _locked_for_exchange(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder, which is created, without an exchange of an aborted process."""
    check_folder(folder)
    is_new = not folder.exists()
    create_folder(folder)
    try:
        with locked_folder(folder):
            _complete(folder)
            yield
    except BaseException:
        if is_new:
            with suppress(OSError):  # another process uses it
                folder.rmdir()
        raise


def _exchange(files: Mapping[Path, bytes], removed: Iterable[Path], root: Path) -> None:
    """Write files below a folder and remove others."""
    staging = root / _STAGING
    journal = {
        "replaced": {_name(path, root): _digest(path) for path in files if os.path.lexists(path)},
        "obsolete": {_name(path, root): _digest(path) for path in removed},
    }
    try:
        for path, content in files.items():
            refuse_input(path)
            write_new_file(staging / _NEW / _name(path, root), content, path)
        write_new_file(staging / _JOURNAL, as_json(journal).encode("utf-8"), root)
        for path in files:
            create_folder(path.parent)
        staging.rename(root / _COMMIT)
    except BaseException as error:
        shutil.rmtree(staging, ignore_errors=True)
        _remove_empty_folders(files, root)
        if isinstance(error, OSError):
            raise write_error(root, error) from error
        raise
    _complete(root)


def _complete(root: Path) -> None:
    """Complete a committed exchange; all steps may be repeated."""
    commit, staging = root / _COMMIT, root / _STAGING
    if commit.is_dir():
        replaced, obsolete = _read_journal(commit / _JOURNAL)
        new = commit / _NEW
        files = {root / _name(path, new): path for path in new.rglob("*") if path.is_file()}
        for path in files:
            if os.path.lexists(path) and replaced.get(_name(path, root)) != _digest(path):
                raise FileError(
                    f"{path}: was changed while hydrodamp replaced it. Move it elsewhere and"
                    " repeat the command."
                )
        try:
            for path, source in files.items():
                path.parent.mkdir(parents=True, exist_ok=True)
                source.replace(path)
            for name, digest in obsolete.items():
                if digest and _digest(root / name) == digest:
                    (root / name).unlink()
            commit.rename(staging)
        except OSError as error:
            raise write_error(root, error) from error
        _remove_empty_folders((root / name for name in obsolete), root)
    shutil.rmtree(staging, ignore_errors=True)


def _read_journal(path: Path) -> tuple[dict[str, str], dict[str, str]]:
    """Return the digests of the files that an exchange replaces, and of those that it removes."""
    journal = load_json(path)
    tables = (
        [journal.get(key) for key in ("replaced", "obsolete")] if isinstance(journal, dict) else []
    )
    match tables:
        case [dict() as replaced, dict() as obsolete] if all(map(_is_inside, obsolete)):
            return replaced, obsolete
    raise FileError(f"{path}: is not a journal of hydrodamp. Move its folder elsewhere.")


def _remove_empty_folders(paths: Iterable[Path], folder: Path) -> None:
    for path in paths:
        for parent in path.parents:
            if not parent.is_relative_to(folder) or parent == folder:
                break
            with suppress(OSError):  # the folder holds other files
                parent.rmdir()


def _check_replaceable(paths: Iterable[Path], folder: Path, manifest: Mapping[str, str]) -> None:
    """Refuse files that exist and differ from what hydrodamp wrote."""
    for path in paths:
        if os.path.lexists(path) and not _is_unchanged(path, folder, manifest):
            is_listed = _name(path, folder) in manifest
            reason = "was changed since hydrodamp wrote it" if is_listed else "is not hydrodamp's"
            raise FileError(
                f"{path}: {reason}, so `--force` does not replace it. Move it elsewhere, or name"
                " another folder."
            )


def _is_unchanged(path: Path, folder: Path, manifest: Mapping[str, str]) -> bool:
    """Return whether a file has the content that hydrodamp wrote."""
    return manifest.get(_name(path, folder), "") == _digest(path) != ""


def _read_manifest(folder: Path) -> dict[str, str]:
    """Return the digest of each file that hydrodamp wrote."""
    path = folder / MANIFEST
    if not path.is_file():
        return {}
    content = load_json(path)
    manifest = content.get("files") if isinstance(content, dict) else None
    if not isinstance(manifest, dict) or not all(
        isinstance(digest, str) and _is_inside(name) for name, digest in manifest.items()
    ):
        raise FileError(f"{path}: is not a manifest of hydrodamp. Move it elsewhere.")
    return manifest


def _manifest_text(digests: Mapping[str, str]) -> bytes:
    files = dict(sorted(digests.items()))
    return as_json({"format": "hydrodamp-manifest", "files": files}).encode("utf-8")


def _is_inside(name: str) -> bool:
    return not Path(name).is_absolute() and ".." not in PurePosixPath(name).parts


def _name(path: Path, folder: Path) -> str:
    return path.relative_to(folder).as_posix()


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _digest(path: Path) -> str:
    """Return the SHA-256 digest of a file; empty for what is no file."""
    if not path.is_file():
        return ""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
