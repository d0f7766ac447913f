"""Names that a file gives for its neighbours: never followed out of their folder."""

from __future__ import annotations

from pathlib import Path


def is_plain(name: str) -> bool:
    r"""Tell whether a name is that of a file in one folder, whatever the system."""
    return Path(name).name == name and not set(name) & {"\\", "\0"}
