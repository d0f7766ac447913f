"""Readers that are not part of the base install: imported where used, named where missing."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from hydrodamp.errors import FileError

INSTALL = 'pip install "hydrodamp[logs]"'
"""What brings every reader."""


def extra(module: str, path: object, *, package: str = "", install: str = INSTALL) -> Any:
    """Return a module of an optional package."""
    try:
        return import_module(module)
    except ImportError as error:
        name = package or module.partition(".")[0]
        raise FileError(
            f"{path}: its reader, the package {name}, is not installed. Install it: {install}"
        ) from error


def installed(module: str) -> Any | None:
    """Return a module, or None where it is not installed."""
    try:
        return import_module(module)
    except ImportError:
        return None
