"""Names that a file gives for its neighbours: never followed out of their folder."""

from __future__ import annotations

from pathlib import Path


def is_plain(name: str) -> bool:
    r"""Tell whether a name is that of a file in one folder, whatever the system.

    Parameters
    ----------
    name : str
        As a file gave it.

    Returns
    -------
    plain : bool
        Whether it has no separator of folders and no NUL.

    Examples
    --------
    >>> [is_plain(name) for name in ("linear.oe", "../linear.oe", "/linear.oe", "a\\linear.oe")]
    [True, False, False, False]
    """
    return Path(name).name == name and not set(name) & {"\\", "\0"}
