"""Readers that are not part of the base install: imported where used, named where missing."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from hydrodamp.errors import FileError

INSTALL = 'pip install "hydrodamp[logs]"'
"""What brings every reader."""


def extra(module: str, path: object, *, package: str = "", install: str = INSTALL) -> Any:
    """Return a module of an optional package.

    Parameters
    ----------
    module : str
        Its dotted name.
    path : str or Path
        The file that asks for it, for the message.
    package : str, optional
        The package that holds it; the first part of ``module`` where not given.
    install : str, optional
        The command that brings it.

    Returns
    -------
    module : module
        Imported.

    Raises
    ------
    FileError
        With the package and the command, if it is not installed.

    Examples
    --------
    >>> extra("no_such_reader.core", "dive.log")
    Traceback (most recent call last):
    ...
    hydrodamp.errors.FileError: dive.log: its reader, the package no_such_reader, is not \
installed. Install it: pip install "hydrodamp[logs]"
    """
    try:
        return import_module(module)
    except ImportError as error:
        name = package or module.partition(".")[0]
        raise FileError(
            f"{path}: its reader, the package {name}, is not installed. Install it: {install}"
        ) from error


def installed(module: str) -> Any | None:
    """Return a module, or None where it is not installed.

    Parameters
    ----------
    module : str
        Its dotted name.

    Returns
    -------
    module : module or None
        Imported.

    Examples
    --------
    >>> installed("no_such_reader") is None
    True
    """
    try:
        return import_module(module)
    except ImportError:
        return None
