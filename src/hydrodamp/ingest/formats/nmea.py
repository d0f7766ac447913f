"""NMEA 0183 sentences: position, course, speed, heading and rate of turn, a topic a sentence."""

from __future__ import annotations

import re
from collections import defaultdict
from contextlib import suppress
from datetime import datetime
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.content import open_log

_SENTENCE = re.compile(r"[$!]([A-Z]{2})([A-Z]{3}),([^*\r\n]*)(?:\*([0-9A-Fa-f]{2}))?")
_DAY_SECONDS = 86400.0  # s

#: Numbers of each sentence: name, unit, and position among its cells.
_FIELDS = {
    "RMC": {"latitude": ("deg", 2), "longitude": ("deg", 4), "sog": ("kn", 6), "cog": ("deg", 7)},
    "GGA": {"latitude": ("deg", 1), "longitude": ("deg", 3), "altitude": ("m", 8)},
    "HDT": {"heading": ("deg", 0)},
    "HDG": {"heading": ("deg", 0)},
    "HDM": {"heading": ("deg", 0)},
    "THS": {"heading": ("deg", 0)},
    "ROT": {"yaw_rate": ("deg/min", 0)},
    "VTG": {"cog": ("deg", 0), "sog": ("kn", 4)},
    "VHW": {"heading": ("deg", 0), "stw": ("kn", 4)},
    "DPT": {"sounding": ("m", 0)},
    "RSA": {"rudder": ("deg", 0)},
}
_TIMED = ("RMC", "GGA")  # sentences whose first cell is the time


def read_file(path: str | Path) -> Recording:
    """Read the sentences of a file; those without a time have that of the last one with a time."""
    rows: dict[str, list[list[float]]] = defaultdict(list)
    times: dict[str, list[float]] = defaultdict(list)
    now, date, n_damaged = np.nan, "", 0
    skipped: set[str] = set()
    with open_log(path) as file:
        for raw in file:
            match = _SENTENCE.search(line := raw.decode("ascii", errors="replace"))
            if match is None or not _is_intact(match):
                n_damaged += bool(line.strip(" \0\r\n"))
                continue
            kind, cells = match[2], match[3].split(",")
            if kind in _TIMED and len(cells) > 8:
                now = _parse_number(cells[0])
                date = date or cells[8] * (kind == "RMC")
            if kind not in _FIELDS:
                skipped.add(kind)
            elif kind != "RMC" or cells[1:2] == ["A"]:
                rows[kind].append([_read_cell(cells, at) for _, at in _FIELDS[kind].values()])
                times[kind].append(now)
    if not rows:
        fault = (
            f"expected NMEA 0183 sentences {' '.join(_FIELDS)}, found"
            f" {' '.join(sorted(skipped)) or 'none with a valid checksum'}. Convert the file to"
            " CSV, for example with the Python package pynmea2"
        )
        raise LogError(fault, source=str(path))
    notes = [f"{n_damaged} lines are no NMEA sentence with a valid checksum; skipped"]
    notes = notes[: bool(n_damaged)]
    if skipped:
        notes.append(f"sentences {' '.join(sorted(skipped))} are not read")
    topics = [
        Topic(
            kind,
            _read_clock(times[kind], date),
            {
                name: np.array(values)
                for name, values in zip(_FIELDS[kind], zip(*table, strict=True), strict=True)
            },
            units={name: unit for name, (unit, _) in _FIELDS[kind].items()},
        )
        for kind, table in rows.items()
    ]
    return Recording(tuple(topics), str(path), "NMEA 0183", tuple(notes))


def _is_intact(match: re.Match[str]) -> bool:
    """Return whether a sentence has no checksum or the right one."""
    body = f"{match[1]}{match[2]},{match[3]}".encode(errors="replace")
    return match[4] is None or reduce(xor, body) == int(match[4], 16)


def _parse_number(cell: str) -> float:
    with suppress(ValueError):
        return float(cell)
    return float("nan")


def _read_cell(cells: list[str], index: int) -> float:
    """Return the number in a cell; in degrees where a hemisphere follows ddmm.mmmm."""
    value = _parse_number(cells[index]) if index < len(cells) else float("nan")
    hemisphere = cells[index + 1] if index + 1 < len(cells) else ""
    if hemisphere not in tuple("NSEW") or not hemisphere:
        return value
    degrees, minutes = divmod(value, 100.0)
    return (degrees + minutes / 60.0) * (-1.0 if hemisphere in "SW" else 1.0)


def _read_clock(digits: list[float], date: str) -> FloatArray:
    """Return seconds since 1970 of times hhmmss, unwrapped at midnight, from a date ddmmyy."""
    times = np.array(digits)
    known = np.isfinite(times)
    minutes = times // 1e4 * 60.0 + times // 1e2 % 1e2
    times = minutes * 60.0 + times % 1e2
    times[known] = np.unwrap(times[known], period=_DAY_SECONDS)
    with suppress(ValueError):
        times += datetime.strptime(f"{date}+0000", "%d%m%y%z").timestamp()
    return times
