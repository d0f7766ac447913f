"""What an interrupted run leaves in its folder: finished rows, and fits without a replay.

``comparison.json`` says so in its provenance: ``unfinished`` in words, and ``not_replayed``
with the names of the fits that no row has.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from hydrodamp.data.segments import unique_names
from hydrodamp.errors import FileError
from hydrodamp.identification.fit import Fit
from hydrodamp.loading import load_json
from hydrodamp.report.reading import read_fit
from hydrodamp.validation.comparison import Comparison

UNFINISHED = "unfinished"
"""Key in the provenance of a comparison that lacks rows; its value says how many."""

NOT_REPLAYED = "not_replayed"
"""Key in the provenance for the names of fits that wait for their replay."""


def unfinished(comparison: Comparison, wanted: int) -> Comparison:
    """Return a comparison that says it lacks rows.

    Parameters
    ----------
    comparison : Comparison
        The rows there are.
    wanted : int
        How many there would be.

    Returns
    -------
    comparison : Comparison
        Marked in its provenance, and so in its tables and its report.

    Examples
    --------
    >>> unfinished(Comparison(()), 24).provenance
    {'unfinished': '0 of 24 rows: interrupted'}
    """
    words = f"{len(comparison.rows)} of {wanted} rows: interrupted"
    return replace(comparison, provenance={**comparison.provenance, UNFINISHED: words})


def with_waiting(comparison: Comparison, names: Sequence[str]) -> Comparison:
    """Return a comparison that names the fits that wait for their replay.

    Parameters
    ----------
    comparison : Comparison
        The rows there are.
    names : sequence of str
        Of the files of those fits; none leaves it as it is.

    Returns
    -------
    comparison : Comparison
        With their names in its provenance.
    """
    if not names:
        return comparison
    waiting = {NOT_REPLAYED: " ".join(names)}
    return replace(comparison, provenance={**comparison.provenance, **waiting})


def waiting_names(provenance: Mapping[str, str]) -> tuple[str, ...]:
    """Return the names of the fits that wait for their replay.

    Parameters
    ----------
    provenance : mapping of str to str
        As in ``comparison.json``.

    Returns
    -------
    names : tuple of str
        Of files of ``fits``, without ``.json``.

    Examples
    --------
    >>> waiting_names({"not_replayed": "linear.oe fossen.oe"})
    ('linear.oe', 'fossen.oe')
    """
    return tuple(provenance.get(NOT_REPLAYED, "").split())


def finished_fits(folder: str | os.PathLike[str]) -> tuple[Fit, ...]:
    """Return the fits of a folder of results, finished or not.

    Parameters
    ----------
    folder : str or path
        With ``comparison.json`` and ``fits``.

    Returns
    -------
    fits : tuple of Fit
        Of the rows, and those that wait for their replay.

    Raises
    ------
    FileError
        If a file is missing or is not what it should be.
    ModelError
        If a file of ``fits`` has faults.
    """
    home = Path(folder)
    path = home / "comparison.json"
    document: Any = load_json(path)
    try:
        named = unique_names(f"{entry['model']}.{entry['method']}" for entry in document["rows"])
        names = (*named, *waiting_names(document["provenance"]))
    except (KeyError, TypeError, AttributeError) as error:
        raise FileError(f"{path}: is no comparison of hydrodamp: {error!r}.") from error
    return tuple(read_fit(home / "fits" / f"{name}.json") for name in names)
