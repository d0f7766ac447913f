"""Logs of Virginia Tech's 690 vehicles: a folder of ``.dat`` files, one topic each."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from hydrodamp.data.recording import Recording
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats import delimited
from hydrodamp.ingest.formats.naming import is_unit

FORMAT = "VT/AVL topic"
"""How messages call the format."""

_CLOCK = "time"


def recognised(begin: bytes) -> bool:
    """Return whether a file begins as these logs do."""
    lines = begin.decode("latin-1").splitlines()[:3]
    if len(lines) < 3 or not all(line.rstrip().endswith(",") for line in lines[1:]):
        return False
    units = lines[2].rstrip(", \t").split(",")
    return lines[1].lstrip().startswith(f"{_CLOCK},") and is_unit(units[0])


def read(path: str | Path) -> Recording:
    """Read one ``.dat`` file."""
    table = delimited.read(path)
    topic = table.topics[0]
    if _CLOCK not in topic.fields:
        fault = topic.faults.get(_CLOCK, f"there is no column `{_CLOCK}` in its second line")
        raise LogError(fault, source=str(path))
    name = Path(path).name.removesuffix(".gz").removesuffix(".dat")
    called = replace(topic, name=name, time=topic.fields[_CLOCK])
    return replace(table, topics=(called,), format=FORMAT)
