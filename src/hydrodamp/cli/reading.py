"""A bar while logs are read: over their bytes where there are several."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from hydrodamp.cli.progress import progress

_NAMED = 3
"""Logs whose names are shown."""


@contextmanager
def reading(paths: Sequence[str]) -> Iterator[Callable[[str | Path], None]]:
    """Show a bar while logs are read.

    Parameters
    ----------
    paths : sequence of str
        Files and folders, each once. Of one alone nobody can tell how much of it is read, and
        the bar only shows how long it has taken.

    Yields
    ------
    done : callable
        To be called with each when it is read.
    """
    sizes = {str(path): _size(Path(path)) for path in paths} if len(paths) > 1 else {}
    names = ", ".join(Path(path).name for path in paths[:_NAMED])
    with progress(f"reading {names}", sum(sizes.values()) or None, unit="B") as step:
        yield lambda path: step(steps=sizes.get(str(path), 0))


def _size(path: Path) -> int:
    """Return the bytes of a file, or of all files of a folder; 0 where there is nothing."""
    inside = path.rglob("*") if path.is_dir() else (path,)
    return sum(each.stat().st_size for each in inside if each.is_file())
