"""Junk in a stream is counted and told; the estimate is that without it."""

import itertools
import json
import math

import pytest

from hydrodamp.errors import ProblemError
from hydrodamp.live.rows import rows_of
from hydrodamp.live.sources import UNREADABLE, Lines, Waiting, from_json
from live.conftest import heard

NAN = math.nan


@pytest.fixture(scope="module")
def rows(dive):
    _, log = dive
    return [*itertools.islice(rows_of(log), 300)]


JUNK = {
    "unreadable": lambda row: UNREADABLE,
    "repeated": lambda row: row,
    "late": lambda row: row | {"time": row["time"] - 3.0},
    "spike": lambda row: row | {"time": row["time"] + 0.01, "v": 9.0},
}


@pytest.mark.parametrize("kind", JUNK)
def test_what_is_left_out_leaves_no_trace(dive, rows, kind):
    vehicle, _ = dive
    spoilt = [*rows[:200], JUNK[kind](rows[199]), *rows[200:]]
    clean, told = heard(rows, vehicle), heard(spoilt, vehicle)
    assert told.coefficients == clean.coefficients
    assert told.counts == clean.counts | {kind: 1}
    assert len(told.sentences) == 1


@pytest.mark.parametrize(
    ("change", "kind"),
    [
        ({"u": NAN}, "incomplete"),
        ({"time": NAN}, "incomplete"),
        ({"time": "noon"}, "incomplete"),
        ({"u": None}, "incomplete"),
        ({"rudder": NAN}, "incomplete"),
        ({"qw": 3.0}, "incomplete"),
        ({"u": 1e9}, "absurd"),
    ],
)
def test_after_a_sample_that_lacks_something_a_run_begins(dive, rows, change, kind):
    vehicle, _ = dive
    spoilt = [*rows[:200], rows[200] | change, *rows[201:]]
    told = heard(spoilt, vehicle)
    assert told.counts == {"taken": 299, "first": 1, kind: 1, "again": 1}


def test_a_clock_that_is_set_back_begins_a_run(dive, rows):
    vehicle, _ = dive
    set_back = [*rows[:150], *(row | {"time": row["time"] - 7200.0} for row in rows[150:])]
    told = heard(set_back, vehicle)
    assert told.counts == {"taken": 281, "first": 1, "late": 19, "clock": 1}


def test_velocities_that_leap_and_stay_begin_a_run(dive, rows):
    vehicle, _ = dive
    hit = [*rows[:150], *(row | {"u": row["u"] - 1.5} for row in rows[150:])]
    assert heard(hit, vehicle).counts == {"taken": 298, "first": 1, "spike": 2, "leapt": 1}


def test_a_sensor_that_freezes_is_left_out_until_it_moves(dive, rows):
    vehicle, _ = dive
    held = {name: rows[100][name] for name in "uvw"}
    frozen = [*rows[:100], *(row | held for row in rows[100:200]), *rows[200:]]
    told = heard(frozen, vehicle)
    assert told.counts == {"taken": 221, "first": 1, "frozen": 79, "again": 1}


def test_samples_that_lack_what_is_needed_are_left_out_until_one_will_do(dive, rows):
    vehicle, _ = dive
    poor = [{key: value for key, value in row.items() if key != "rudder"} for row in rows[:5]]
    told = heard([*poor, *rows], vehicle)
    assert told.counts == {"taken": 300, "first": 1, "incomplete": 5}
    assert "'rudder'" in told.sentences[0]
    with pytest.raises(ProblemError, match=r"no sample to begin with.*'rudder'"):
        heard(poor, vehicle)


def test_lines_are_json_or_a_table():
    read = Lines()
    assert read(b'{"time": 1, "u": 2}\n') == {"time": 1, "u": 2}
    assert read(b"\n") is None
    assert read(b"1,2\n") is UNREADABLE
    assert read(b"time,u,segment\n") is None
    assert read(b'1,2,"a"\n') == {"time": 1.0, "u": 2.0, "segment": "a"}
    for junk in (b"1,2\n", b"\xff\xfe\x00\n", b"{\n", b"[" * 100_000, b"{" * 100_000, b'"a'):
        assert read(junk) is UNREADABLE
    for junk in ("", "[1]", "1", '"a"', "nul"):
        assert from_json(junk) is UNREADABLE
    assert read(json.dumps({"time": NAN}).encode())


def test_what_nobody_takes_is_dropped_and_counted():
    waiting = Waiting()
    for k in range(10_007):
        waiting.put({"time": k})
    assert waiting.dropped == 7
