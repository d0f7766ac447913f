"""Result folders: a manifest of written files with SHA-256 digests, and transactional replacement.

The manifest ``.hydrodamp.json`` lists the files that hydrodamp wrote. A file that it does not list,
or whose content differs from its digest, belongs to the user and is never replaced.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path, PurePosixPath

from hydrodamp.errors import FileError
from hydrodamp.files import check_file, check_folder, load_json, save_all, save_json, save_text

MANIFEST = ".hydrodamp.json"
_FORMAT = "hydrodamp-manifest"


def check_new_file(path: Path, force: bool) -> None:
    """Refuse a file that cannot be written, or that exists unless ``force`` permits replacing."""
    check_file(path)
    if path.exists() and not force:
        raise FileError(f"{path}: exists already. Name another file, or replace it with `--force`.")


def check_results(folder: Path, patterns: Iterable[str], force: bool) -> None:
    """Refuse, before work starts, a folder in which results would replace files.

    Patterns are paths in the folder. A pattern with a star matches listed files only, so that other
    files of the user may remain. With ``force``, files that hydrodamp wrote and that nobody changed
    may be replaced.
    """
    check_folder(folder)
    manifest = _read_manifest(folder)
    files = [
        path
        for pattern in patterns
        for path in sorted(folder.glob(pattern))
        if path.is_file() and ("*" not in pattern or _name(path, folder) in manifest)
    ]
    if files and not force:
        raise FileError(
            f"{folder}: holds results already, such as {files[0].relative_to(folder)}. Name another"
            " folder, or replace what hydrodamp wrote there with `--force`."
        )
    _check_replaceable(files, folder, manifest)


def save_results(
    contents: Mapping[Path, bytes], folder: Path, obsolete: Iterable[Path] = ()
) -> None:
    """Write files into a folder and its manifest, and remove obsolete ones: all of it, or nothing.

    Files that hydrodamp did not write are refused before any is written, and obsolete ones that
    were changed stay. An error or interrupt restores the earlier files.
    """
    manifest = _read_manifest(folder)
    _check_replaceable(contents, folder, manifest)
    earlier = {path for path in contents if path.exists()}
    earlier |= {path for path in obsolete if _is_replaceable(path, folder, manifest)}
    check_folder(folder)
    folder.mkdir(parents=True, exist_ok=True)
    digests = {path: hashlib.sha256(content).hexdigest() for path, content in contents.items()}
    try:
        with tempfile.TemporaryDirectory(prefix=".hydrodamp-", dir=folder) as staging:
            new, backup = Path(staging, "new"), Path(staging, "backup")
            save_all({new / _name(path, folder): content for path, content in contents.items()})
            _update_manifest(digests, folder)  # first: an aborted process leaves no unlisted file
            moves = [(path, backup / _name(path, folder)) for path in sorted(earlier)]
            moves += [(new / _name(path, folder), path) for path in contents]
            _move_files(moves, folder)
    except BaseException:
        _update_manifest({}, folder)
        with suppress(OSError):  # the folder holds files
            folder.rmdir()
        raise
    _remove_empty_folders(earlier, folder)


def _move_files(moves: Sequence[tuple[Path, Path]], folder: Path) -> None:
    """Move files in their order; where one fails, move all back."""
    finished: list[tuple[Path, Path]] = []
    try:
        for source, target in moves:
            target.parent.mkdir(parents=True, exist_ok=True)
            source.rename(target)
            finished.append((source, target))
    except BaseException as error:
        for source, target in reversed(finished):
            target.rename(source)
        _remove_empty_folders((target for _, target in moves), folder)
        if isinstance(error, OSError):
            raise FileError(f"{folder}: cannot be written: {error}.") from error
        raise


def register_results(paths: Iterable[Path], folder: Path) -> None:
    """Add files to the manifest that another library has just written."""
    _update_manifest({path: digest for path in paths if (digest := _digest(path))}, folder)


def save_result(text: str, path: Path) -> None:
    """Write a file that the user named, and register it where its folder has a manifest."""
    save_text(text, path)
    if (path.parent / MANIFEST).is_file():
        register_results((path,), path.parent)


def remove_results(folder: Path, patterns: Iterable[str], keep: Iterable[Path] = ()) -> None:
    """Remove unchanged files that hydrodamp wrote, by patterns, except those to ``keep``."""
    manifest, excluded = _read_manifest(folder), {*keep}
    for path in [path for pattern in patterns for path in sorted(folder.glob(pattern))]:
        if path not in excluded and path.is_file() and _is_replaceable(path, folder, manifest):
            path.unlink()
            _remove_empty_folders((path,), folder)


def _remove_empty_folders(paths: Iterable[Path], folder: Path) -> None:
    for path in paths:
        for parent in path.parents:
            if not parent.is_relative_to(folder) or parent == folder:
                break
            with suppress(OSError):  # the folder holds other files
                parent.rmdir()


def _check_replaceable(
    paths: Iterable[Path], folder: Path, manifest: Mapping[str, list[str]]
) -> None:
    """Refuse files that exist and differ from what hydrodamp wrote."""
    for path in paths:
        if os.path.lexists(path) and not _is_replaceable(path, folder, manifest):
            is_listed = _name(path, folder) in manifest
            reason = "was changed since hydrodamp wrote it" if is_listed else "is not hydrodamp's"
            raise FileError(
                f"{path}: {reason}, so `--force` does not replace it. Move it elsewhere, or name"
                " another folder."
            )


def _is_replaceable(path: Path, folder: Path, manifest: Mapping[str, list[str]]) -> bool:
    return _digest(path) in manifest.get(_name(path, folder), ())


def _read_manifest(folder: Path) -> dict[str, list[str]]:
    """Return the digests that each file may have: as written last, and before that."""
    path = folder / MANIFEST
    if not path.is_file():
        return {}
    content = load_json(path)
    manifest = content.get("files") if isinstance(content, dict) else None
    if not isinstance(manifest, dict) or not all(
        isinstance(digests, list) and _is_inside(name) for name, digests in manifest.items()
    ):
        raise FileError(f"{path}: is not a manifest of hydrodamp. Move it elsewhere.")
    return manifest


def _is_inside(name: str) -> bool:
    return not Path(name).is_absolute() and ".." not in PurePosixPath(name).parts


def _update_manifest(digests: Mapping[Path, str], folder: Path) -> None:
    manifest = _read_manifest(folder)
    for path, digest in digests.items():
        name = _name(path, folder)
        # Until the new content is in place, the content on disk is hydrodamp's too.
        present = {*manifest.get(name, ())} & {_digest(path)} - {digest}
        manifest[name] = [digest, *present]
    existing = {
        name: manifest[name]
        for name in sorted(manifest)
        if folder / name in digests or (folder / name).exists()
    }
    if existing:
        save_json({"format": _FORMAT, "files": existing}, folder / MANIFEST)
    else:
        (folder / MANIFEST).unlink(missing_ok=True)


def _name(path: Path, folder: Path) -> str:
    return path.relative_to(folder).as_posix()


def _digest(path: Path) -> str:
    """Return the SHA-256 digest of a file; empty for what is no file."""
    if not path.is_file():
        return ""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
