"""Checksums that were recorded at the first sight of a file, in a lock file beside it."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path

from hydrodamp.errors import FileError
from hydrodamp.files import as_json, load_json, save_text

LOCK = "hydrodamp-lock.json"
"""What the lock file is called."""

_BLOCK = 1 << 20


def sha256(path: Path) -> str:
    """Return the checksum of a file."""
    digest = hashlib.sha256()
    try:
        with path.open("rb") as stream:
            while block := stream.read(_BLOCK):
                digest.update(block)
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror or error}.") from error
    return digest.hexdigest()


def recorded(folder: Path) -> dict[str, str]:
    """Return the checksums that were recorded in a folder."""
    path = folder / LOCK
    if not path.exists():
        return {}
    content = load_json(path)
    checksums = content.get("sha256") if isinstance(content, dict) else None
    if not isinstance(checksums, dict) or not all(isinstance(v, str) for v in checksums.values()):
        raise FileError(f"{path}: must hold checksums under `sha256`. Remove it to record anew.")
    return checksums


def record(folder: Path, checksums: Mapping[str, str]) -> None:
    """Write the lock file of a folder."""
    said = "recorded when these files were first fetched or found; not published by their authors"
    save_text(as_json({"note": said, "sha256": dict(sorted(checksums.items()))}), folder / LOCK)
