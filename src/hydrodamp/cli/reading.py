"""A bar while logs are read, over their bytes."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path

from hydrodamp.cli.progress import followed

_NAMED = 3
"""Logs whose names are shown."""


def reading(paths: Sequence[str]) -> AbstractContextManager[None]:
    """Show a bar while logs are read inside."""
    from hydrodamp.ingest.formats.content import size_of

    names = ", ".join(Path(path).name for path in paths[:_NAMED])
    return followed(f"reading {names}", sum(map(size_of, paths)), unit="B")
