"""Words of captions: names and numbers as one reads them aloud."""

from __future__ import annotations

from collections.abc import Sequence

from hydrodamp.data.log import Log

_NAMED = 6
"""Names that are listed; of more, the number."""


def sentence(text: str) -> str:
    """Return what an error or a note says as a sentence."""
    return f"{text[0].upper()}{text[1:].rstrip('.')}."


def listed(names: Sequence[str]) -> str:
    """Return names as a clause."""
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} and {names[-1]}"


def segments_of(log: Log) -> str:
    """Return what a log consists of."""
    names = [segment.name for segment in log.segments]
    head = f"{log.n} samples, {log.duration:.4g} s"
    if len(names) < 2:
        return head
    named = f" ({listed(names)})" if len(names) <= _NAMED else ""
    return f"{head} in {len(names)} segments{named}"
