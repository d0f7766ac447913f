"""Result folders: a manifest of written files with SHA-256 digests, and one exchange of them all.

The manifest ``.hydrodamp.json`` lists the files that hydrodamp wrote. A file that it does not list,
or whose content differs from its digest, belongs to the user and is never replaced.

New files and a journal are written into a staging folder. Its renaming to ``.hydrodamp-commit`` is
the commit point: an earlier abort leaves the old files, and after a later one the next command that
uses the folder completes the exchange. The journal lists the digests of new and replaced content;
what would hinder the exchange, or write outside the folder, is refused before the commit point.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Container, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from glob import escape
from itertools import chain
from pathlib import Path, PureWindowsPath

from hydrodamp.errors import FileError
from hydrodamp.files import (
    as_json,
    check_file,
    check_folder,
    create_folder,
    load_json,
    refuse_input,
    write_error,
    write_new_file,
)
from hydrodamp.locks import locked_folder

MANIFEST = ".hydrodamp.json"
_STAGING, _COMMIT = ".hydrodamp-staging", ".hydrodamp-commit"
#: In these folders: the new files, and the journal of their digests and of those that they replace.
_NEW, _JOURNAL = "new", "journal.json"

#: Patterns that no file matched when they were checked without ``force``, by folder, until this
#: process writes there: files that another process wrote meanwhile are not replaced.
_unmatched: dict[Path, set[str]] = {}


def check_new_file(path: Path | None, force: bool) -> None:
    """Refuse a file that cannot be written, is an input, or exists without ``force``."""
    if path is None:
        return
    check_file(path)
    complete_exchange(path.parent)
    if path.exists() and not force:
        raise FileError(f"{path}: exists already. Name another file, or replace it with `--force`.")
    _keep_check(path.parent, (escape(path.name),), force)


def check_results(folder: Path, patterns: Iterable[str], force: bool) -> None:
    """Refuse, before work starts, a folder in which results would replace files.

    Patterns are paths in the folder. A pattern with a star matches listed files only, so that other
    files of the user may remain. With ``force``, files that hydrodamp wrote and that nobody changed
    may be replaced; inputs of the running command are not.
    """
    check_folder(folder)
    complete_exchange(folder)
    for path in chain.from_iterable(map(folder.glob, patterns)):
        refuse_input(path)
    manifest = _read_manifest(folder)
    files = list(_matches(folder, patterns, manifest))
    if files and not force:
        raise FileError(
            f"{folder}: holds results already, such as {files[0].relative_to(folder)}. Name another"
            " folder, or replace what hydrodamp wrote there with `--force`."
        )
    _check_replaceable(files, folder, manifest)
    _keep_check(folder, patterns, force)


def _matches(folder: Path, patterns: Iterable[str], manifest: Container[str]) -> Iterator[Path]:
    """Yield the files that match patterns, those with a star only if they are listed."""
    for pattern in patterns:
        for path in filter(Path.is_file, sorted(folder.glob(pattern))):
            if "*" not in pattern or _name(path, folder) in manifest:
                yield path


def _keep_check(folder: Path, patterns: Iterable[str], force: bool) -> None:
    earlier = _unmatched.get(folder.absolute(), ())
    _unmatched[folder.absolute()] = set() if force else {*earlier, *patterns}


def _repeat_check(folder: Path) -> None:
    """Refuse files that another process wrote since a check without ``force``."""
    manifest, patterns = _read_manifest(folder), _unmatched.get(folder.absolute(), ())
    for path in _matches(folder, sorted(patterns), manifest):
        reason = f"{path}: was written by another program while this command ran"
        raise FileError(f"{reason}. Name another file or folder, or repeat it with `--force`.")
    _unmatched.pop(folder.absolute(), None)


def save_results(
    contents: Mapping[Path, bytes],
    folder: Path,
    obsolete: Iterable[str] = (),
    outside: Mapping[Path, bytes] | None = None,
) -> None:
    """Write files into a folder and its manifest, and remove obsolete ones: all of it, or nothing.

    Files that hydrodamp did not write, or that another process wrote since a check without
    ``force``, are refused before any is written. Files that match the patterns ``obsolete`` are
    removed unless they are new or were changed. Files ``outside``, in the parent of the folder,
    have names that the user gave: they are replaced whatever they are.
    """
    named = outside or {}
    root = folder.parent if outside else folder
    with _locked_for_exchange(root):
        _repeat_check(folder)
        manifest = _read_manifest(folder)
        _check_replaceable(contents, folder, manifest)
        removed = {
            path
            for pattern in obsolete
            for path in folder.glob(pattern)
            if path not in contents and path.is_file() and _is_unchanged(path, folder, manifest)
        }
        listed = {
            name: digest
            for name, digest in manifest.items()
            if (path := folder / name).exists() and path not in removed
        } | _digests(contents, folder)
        files = {**contents, **named, **_updated_manifest(named, root)}
        if listed:
            files[folder / MANIFEST] = _manifest_text(listed)
        else:
            removed.add(folder / MANIFEST)
        _exchange(files, removed, root)


def save_result(text: str, path: Path) -> None:
    """Write a file that the user named, and list it where its folder has a manifest."""
    check_file(path)
    with _locked_for_exchange(path.parent):
        files = {path: text.encode("utf-8")}
        _exchange({**files, **_updated_manifest(files, path.parent)}, (), path.parent)


def _updated_manifest(files: Mapping[Path, bytes], folder: Path) -> dict[Path, bytes]:
    """Return the manifest of a folder that has one, with new files in it."""
    listed = _read_manifest(folder)
    is_kept = bool(files) and (folder / MANIFEST).is_file()
    return {folder / MANIFEST: _manifest_text(listed | _digests(files, folder))} if is_kept else {}


def complete_exchange(folder: Path) -> None:
    """Complete the exchange of files that an aborted process committed, and remove its rest."""
    if (folder / _COMMIT).is_dir() or (folder / _STAGING).is_dir():
        with locked_folder(folder):
            _complete(folder)


def complete_inputs(paths: Iterable[Path]) -> None:
    """Complete the exchanges of aborted processes that replace any of these files and folders."""
    inputs = {path.resolve() for path in paths}
    for root in {root for path in inputs for root in (path, *path.parents)}:
        if (root / _COMMIT).is_dir():
            with locked_folder(root):
                targets = [root / name for each in _read_journal(root) for name in each]
                if any(not inputs.isdisjoint((path, *path.parents)) for path in targets):
                    _complete(root)


@contextmanager
def _locked_for_exchange(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder, which is created, without an exchange of an aborted process."""
    check_folder(folder)
    is_new = not folder.exists()
    create_folder(folder)
    try:
        with locked_folder(folder):
            _complete(folder)
            _repeat_check(folder)
            yield
    except BaseException:
        if is_new:
            with suppress(OSError):  # another process uses it
                folder.rmdir()
        raise


def _exchange(files: Mapping[Path, bytes], removed: Iterable[Path], root: Path) -> None:
    """Write files below a folder and remove others."""
    staging = root / _STAGING
    pairs = _digests(files, root).items()
    digests = {name: (digest, _digest(root / name)) for name, digest in pairs}
    obsolete = {_name(path, root): _digest(path) for path in removed}
    journal = as_json({"new": digests, "obsolete": obsolete}).encode("utf-8")
    try:
        _check_targets((staging / _JOURNAL, *files, *removed), root)
        for path, content in files.items():
            refuse_input(path)
            write_new_file(staging / _NEW / _name(path, root), content, path)
        write_new_file(staging / _JOURNAL, journal, root)
        for path in files:
            create_folder(path.parent)
        staging.rename(root / _COMMIT)
    except BaseException as error:
        shutil.rmtree(staging, ignore_errors=True)
        remove_empty_folders(files, root)
        if isinstance(error, OSError) and not isinstance(error, FileError):
            raise write_error(root, error) from error
        raise
    _complete(root)


def _complete(root: Path) -> None:
    """Complete a committed exchange; all steps may be repeated."""
    commit, staging = root / _COMMIT, root / _STAGING
    if commit.is_dir():
        new, obsolete = _read_journal(root)
        remedy = f"Files in {commit} wait to be put into {root}: repeat the command after that."
        try:
            sources = [commit / _JOURNAL, *(commit / _NEW / name for name in new)]
            _check_targets((*sources, *(root / name for name in (*new, *obsolete))), root)
            waiting = [name for name in new if (commit / _NEW / name).is_file()]
            _check_contents(new, waiting, root)
        except FileError as error:
            raise FileError(f"{error} {remedy}") from error
        try:
            for name in waiting:
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (commit / _NEW / name).replace(root / name)
            for name, digest in obsolete.items():
                if digest and _digest(root / name) == digest:
                    (root / name).unlink()
            shutil.rmtree(staging, ignore_errors=True)
            commit.rename(staging)
        except OSError as error:
            raise FileError(f"{write_error(root, error)} {remedy}") from error
        remove_empty_folders((root / name for name in obsolete), root)
    shutil.rmtree(staging, ignore_errors=True)


def _check_targets(paths: Iterable[Path], root: Path) -> None:
    """Refuse files that cannot be written or removed, or are outside a folder by a link."""
    home, device = root.resolve(), root.stat().st_dev
    for path in paths:
        parent = next(each for each in path.parents if os.path.lexists(each))
        check_folder(parent)
        if path.is_dir() and not path.is_symlink():
            raise FileError(f"{path}: is a folder, where a file is to be. Move it elsewhere.")
        if not parent.resolve().is_relative_to(home) or parent.stat().st_dev != device:
            reason = f"{path}: is outside of {root}, by a link or on another file system."
            raise FileError(f"{reason} Replace {parent} by a folder, or give another one.")


def _check_contents(new: Mapping[str, list[str]], waiting: Container[str], root: Path) -> None:
    """Refuse an exchange that would replace changed files, or that lacks new ones."""
    for name, (digest, replaced) in new.items():
        current = _digest(root / name)
        if name not in waiting:
            if current == replaced != digest:
                raise FileError(
                    f"{root / name}: its new content is lost. Move {_COMMIT} elsewhere."
                )
        elif os.path.lexists(root / name) and current not in {replaced, digest}:
            raise FileError(
                f"{root / name}: was changed while hydrodamp replaced it. Move it elsewhere."
            )


def _read_journal(root: Path) -> tuple[dict[str, list[str]], dict[str, str]]:
    """Return the digests of new files and of what they replace, and those of obsolete files."""
    path = root / _COMMIT / _JOURNAL
    match load_json(path) if path.parent.is_dir() else {"new": {}, "obsolete": {}}:
        case {"new": dict() as new, "obsolete": dict() as obsolete}:
            is_paired = all(isinstance(each, list) and len(each) == 2 for each in new.values())
            if is_paired and all(map(_is_inside, (*new, *obsolete))):
                return new, obsolete
    raise FileError(f"{path}: is not a journal of hydrodamp. Move its folder elsewhere.")


def remove_empty_folders(paths: Iterable[Path], folder: Path) -> None:
    """Remove the folders of paths below a folder that hold no file."""
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
    files = {name: digest for name, digest in sorted(digests.items()) if _is_inside(name)}
    return as_json({"format": "hydrodamp-manifest", "files": files}).encode("utf-8")


def _is_inside(name: str) -> bool:
    """Return whether a path stays in its folder, on Windows too."""
    path = PureWindowsPath(name)
    return not path.anchor and ".." not in path.parts


def _name(path: Path, folder: Path) -> str:
    return path.relative_to(folder).as_posix()


def _digests(contents: Mapping[Path, bytes], folder: Path) -> dict[str, str]:
    return {_name(path, folder): _sha256(content) for path, content in contents.items()}


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _digest(path: Path) -> str:
    """Return the SHA-256 digest of a file; empty for what is no file."""
    if not path.is_file():
        return ""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
