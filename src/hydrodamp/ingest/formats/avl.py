"""Logs of Virginia Tech's 690 vehicles: a folder of ``.dat`` files, one topic each."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from hydrodamp.data.recording import Recording
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats import delimited

_CLOCK = "time"


def read(path: str | Path) -> Recording:
    """Read one ``.dat`` file."""
    table = delimited.read(path)
    topic = table.topics[0]
    if _CLOCK not in topic.fields:
        fault = topic.faults.get(_CLOCK, f"there is no column of numbers `{_CLOCK}`")
        raise LogError(fault, source=str(path))
    name = Path(path).name.removesuffix(".gz").removesuffix(".dat")
    named = replace(topic, name=name, time=topic.fields[_CLOCK])
    return replace(table, topics=(named,), format="VT/AVL topic")
