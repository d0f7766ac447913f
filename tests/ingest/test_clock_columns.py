"""Clocks as they stand in files: times of day, row numbers, stamps of sensors beside arrival."""

import numpy as np
import pytest

from hydrodamp.errors import LogError
from hydrodamp.ingest.mapping import LogMapping
from hydrodamp.ingest.read import read_log

TIME = np.arange(0.0, 20.0, 0.1)


def of_day(start):
    """Return times of day with four digits behind the second."""
    tenths = [round(10 * (start + time)) for time in TIME]
    return [f"{t // 36000 % 24:02}:{t // 600 % 60:02}:{t % 600 / 10:07.4f}" for t in tenths]


WALL = 1.7e9 + TIME
CASES = {
    "time of day over midnight": ({"clock": of_day(86390.0)}, "clock"),
    "date and time of day": ({"d": ["5/31/2024"] * 200, "clock": of_day(0.0)}, "clock"),
    "date of LabVIEW": ({"at": [f"05/31/2024 {one}" for one in of_day(3600.0)]}, "at"),
    "rows at a rate": ({}, {"rate": 10}),
    "a clock that stops": ({"t": np.minimum(TIME, 10.0)}, {"rate": 10}),
    "whole seconds and nanoseconds": (
        {"secs": np.floor(WALL), "nsecs": np.round(WALL % 1 * 1e9)},
        {"column": "secs", "plus": {"nsecs": 1e-9}},
    ),
    "a header nobody fills": ({"header.stamp": 0 * TIME, "t": TIME}, ["header.stamp", "t"]),
}


@pytest.mark.parametrize("case", CASES)
def test_clocks(tmp_path, case):
    columns, time = CASES[case]
    names, rows = (*columns, "speed"), zip(*columns.values(), np.sin(TIME), strict=True)
    text = "\n".join(",".join(map(str, row)) for row in rows)
    (tmp_path / "log.csv").write_text(f"{','.join(names)}\n{text}\n", "utf-8")
    mapping = LogMapping.from_dict({"time": time, "velocity": {"u": "speed"}})
    log = read_log(tmp_path / "log.csv", mapping)
    np.testing.assert_allclose(log.elapsed, TIME, atol=1e-6)
    np.testing.assert_allclose(log.velocity[:, 0], np.sin(TIME))


def test_a_clock_of_words_is_told_as_such(tmp_path, refused):
    (tmp_path / "eta.csv").write_text("early,1\nlater,2\n", "utf-8")
    (tmp_path / "nu.csv").write_text("0.0,1\n0.1,2\n", "utf-8")
    mapping = LogMapping.from_dict({"time": "column 1", "velocity": {"u": "eta.column 2"}})
    refused(LogError, read_log, tmp_path, mapping)
