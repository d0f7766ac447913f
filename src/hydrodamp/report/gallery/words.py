"""Words of captions: names and numbers as one reads them aloud."""

from __future__ import annotations

from collections.abc import Sequence

from hydrodamp.data.log import Log

_NAMED = 6
"""Names that are listed; of more, the number."""


def sentence(text: str) -> str:
    """Return what an error or a note says as a sentence.

    Examples
    --------
    >>> sentence("no log")
    'No log.'
    """
    return f"{text[0].upper()}{text[1:].rstrip('.')}."


def listed(names: Sequence[str]) -> str:
    """Return names as a clause.

    Examples
    --------
    >>> listed(["X"]), listed(["X", "Y", "N"])
    ('X', 'X, Y and N')
    """
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} and {names[-1]}"


def segments_of(log: Log) -> str:
    """Return what a log consists of.

    Parameters
    ----------
    log : Log
        Any.

    Returns
    -------
    clause : str
        Samples, recorded time and segments.

    Examples
    --------
    >>> segments_of(Log.from_arrays([0, 1, 5, 6], {"u": [1] * 4}, segment="aabb"))
    '4 samples, 2 s in 2 segments (a and b)'
    """
    names = [segment.name for segment in log.segments]
    head = f"{log.n} samples, {log.duration:.4g} s"
    if len(names) < 2:
        return head
    named = f" ({listed(names)})" if len(names) <= _NAMED else ""
    return f"{head} in {len(names)} segments{named}"
