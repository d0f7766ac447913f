"""NMEA 0183 sentences: position, course, speed, heading and rate of turn, a topic a sentence."""

from __future__ import annotations

import re
from collections import defaultdict
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.content import open_log
from hydrodamp.ingest.formats.dates import DAY_SECONDS
from hydrodamp.ingest.formats.time_columns import decode_time_of_day

_SENTENCE = re.compile(r"[$!]([A-Z]{2})([A-Z]{3}),([^*\r\n]*)(?:\*([0-9A-Fa-f]{2}))?")

#: Numbers of each sentence: name, unit, and position among its cells.
_FIELDS = {
    "RMC": {"latitude": ("deg", 2), "longitude": ("deg", 4), "sog": ("kn", 6), "cog": ("deg", 7)},
    "GGA": {"latitude": ("deg", 1), "longitude": ("deg", 3), "altitude": ("m", 8)},
    "HDT": {"heading": ("deg", 0)},
    "HDG": {"heading_magnetic": ("deg", 0)},
    "HDM": {"heading_magnetic": ("deg", 0)},
    "THS": {"heading": ("deg", 0)},
    "ROT": {"yaw_rate": ("deg/min", 0)},
    "VTG": {"cog": ("deg", 0), "sog": ("kn", 4)},
    "VHW": {"heading": ("deg", 0), "stw": ("kn", 4)},
    "DPT": {"sounding": ("m", 0)},
    "RSA": {"rudder": ("deg", 0)},
}
_TIMED = ("RMC", "GGA")  # sentences whose first cell is the time
_INVALID = {  # position of the status among the cells, and its value for invalid numbers
    **dict.fromkeys(("RMC", "ROT", "RSA", "THS"), (1, "V")),
    "GGA": (5, "0"),
    "VTG": (8, "N"),
}


def read_file(path: str | Path) -> Recording:
    """Read the sentences of a file; those without a time have that of the last one with a time."""
    rows: dict[str, list[list[float]]] = defaultdict(list)
    times: dict[str, list[float]] = defaultdict(list)
    clock, n_damaged = _Clock(), 0
    skipped: set[str] = set()
    with open_log(path) as file:
        for raw in file:
            match = _SENTENCE.search(line := raw.decode("ascii", errors="replace"))
            if match is None or not _is_intact(match):
                n_damaged += bool(line.strip(" \0\r\n"))
                continue
            kind, cells = match[2], match[3].split(",")
            status, invalid = _INVALID.get(kind, (len(cells), ""))
            is_valid = cells[status : status + 1] != [invalid]
            if kind in _TIMED and len(cells) > 8:
                clock.advance(cells[0], cells[8] if kind == "RMC" and is_valid else "")
            if kind not in _FIELDS:
                skipped.add(kind)
                continue
            numbers = [_read_cell(cells, name, k) for name, (_, k) in _FIELDS[kind].items()]
            rows[kind].append(numbers if is_valid else [np.nan] * len(numbers))
            times[kind].append(clock.now)
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
            np.array(times[kind]) + clock.start,
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


def _read_cell(cells: list[str], name: str, index: int) -> float:
    """Return the number in a cell; latitude and longitude ddmm.mmmm in degrees."""
    value = _parse_number(cells[index]) if index < len(cells) else float("nan")
    if name not in ("latitude", "longitude"):
        return value
    degrees, minutes = divmod(value, 100.0)
    is_negative = cells[index + 1 : index + 2] in (["S"], ["W"])
    return (degrees + minutes / 60.0) * (-1.0 if is_negative else 1.0)


@dataclass
class _Clock:
    """Time of the last sentence with a time [s], continuous at midnight; start is since 1970."""

    now: float = float("nan")
    start: float = 0.0
    known: float = DAY_SECONDS / 2  # last time that is no NaN

    def advance(self, digits: str, date: str) -> None:
        """Read a time hhmmss, and a date ddmmyy if there is one."""
        self.now = of_day = float(decode_time_of_day(np.array(_parse_number(digits))))
        if np.isnan(of_day):
            return
        self.now += DAY_SECONDS * np.rint((self.known - of_day) / DAY_SECONDS)
        with suppress(ValueError):
            midnight = datetime.strptime(f"{date}+0000", "%d%m%y%z").timestamp()
            self.start = self.start or midnight + of_day - self.now
            self.now = midnight + of_day - self.start
        self.known = self.now
