"""Junk in a stream is counted and record; the estimate is that without it."""

import dataclasses
import itertools
import json
import math
from contextlib import nullcontext

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import ProblemError
from hydrodamp.live import estimator, runner, samples
from hydrodamp.live.readers import UNREADABLE, BoundedQueue, LineParser, parse_json
from hydrodamp.live.runner import LiveRun
from hydrodamp.live.samples import rows_of
from live.conftest import LiveRecord, angles, run_live, wrench

NAN = math.nan


@pytest.fixture(scope="module")
def clean_rows(run, rows):
    return run(rows)


def assert_same(record, clean, **counts):
    """Check that the estimate is that of clean rows, and what else is counted."""
    assert record.coefficients == clean.coefficients
    assert record.counts == clean.counts | counts


def soon(row, **change):
    """A sample 0.01 s after a row."""
    return row | {"time": row["time"] + 0.01} | change


JUNK = {
    "unreadable": lambda row: UNREADABLE,
    "repeated": lambda row: row,
    "late": lambda row: row | {"time": row["time"] - 3.0},
    "spike": lambda row: soon(row, v=9.0),
    "spike of a command": lambda row: soon(row, rpm=20_000.0),
    "spike of the attitude": lambda row: soon(row, qw=0.0, qx=1.0, qy=0.0, qz=0.0),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", JUNK)
def test_a_rejected_sample_leaves_no_trace(run, rows, clean_rows, kind):
    record = run([*rows[:200], JUNK[kind](rows[199]), *rows[200:]])
    assert_same(record, clean_rows, **{kind.split()[0]: 1})
    assert len(record.messages) == 1


LACKING = [{"u": NAN}, {"time": NAN}, {"time": "noon"}, {"u": None}, {"rudder": NAN}, {"qw": 3.0}]
LACKING += [{"u": True}, {"u": 10**400}, {"time": 10**400}, {"rpm": 65535}, {"rudder": 32767.0}]
ANGLES = [{"pitch": 400.0}, {"roll": 1e308}, {"yaw": -1e4}, {"pitch": -6.4}]
ABSURD = [{"u": 1e9}, {"rpm": 1e9}, {"rpm": 1e160}, {"rpm": -1e200}, {"rudder": 1e3}]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "form", "changes"),
    [("incomplete", dict, LACKING), ("absurd", dict, ABSURD), ("absurd", angles, ANGLES)],
)
def test_after_a_sample_that_lacks_something_a_run_begins(run, rows, kind, form, changes):
    full = [form(row) for row in rows[:40]]
    for change in changes:
        record = run([*full[:20], full[20] | change, *full[21:]])
        assert record.counts == {"taken": 39, "first": 1, kind: 1, "again": 1}, change


def change_rows(rows, start, stop, change):
    """Change some rows by a function of each."""
    return [*rows[:start], *(row | change(row) for row in rows[start:stop]), *rows[stop:]]


SPOILT = {
    "a clock that is set back": (
        lambda rows: change_rows(rows, 150, 300, lambda row: {"time": row["time"] - 7200.0}),
        {"taken": 281, "late": 19, "clock": 1},
    ),
    "velocities that leap and stay": (
        lambda rows: change_rows(rows, 150, 300, lambda row: {"u": row["u"] - 1.5}),
        {"taken": 298, "spike": 2, "leapt": 1},
    ),
    "a command that leaps and stays": (
        lambda rows: change_rows(rows, 150, 300, lambda row: {"rpm": 5.0 * row["rpm"]}),
        {"taken": 298, "spike": 2, "leapt": 1},
    ),
    "a sensor that freezes until it moves": (
        lambda rows: change_rows(
            rows, 100, 200, lambda _: {name: rows[100][name] for name in "uvw"}
        ),
        {"taken": 221, "frozen": 79, "again": 1},
    ),
    "a sample from the future": (
        lambda rows: [*rows[:200], rows[200] | {"time": 1e6}, *rows[200:]],
        {"taken": 301, "gap": 1, "clock": 1},
    ),
    "outliers before a new column": (
        lambda rows: change_rows(
            change_rows(rows, 150, 152, lambda _: {"rpm": 20_000.0}),
            152,
            153,
            lambda _: {"eta": 1.2},
        ),
        {"taken": 297, "spike": 2, "incomplete": 1},
    ),
    "another form of the attitude": (
        lambda rows: [*map(angles, rows[:100]), rows[100], *map(angles, rows[101:])],
        {"taken": 299, "incomplete": 1},
    ),
    "a channel that the first row lacks": (
        lambda rows: [without_channel(wrench(rows[0]), "Y"), *map(wrench, rows[1:])],
        {"taken": 298, "incomplete": 2},
    ),
    "a channel of one row": (
        lambda rows: change_rows(
            [without_channel(wrench(row), "Y") for row in rows], 50, 51, lambda _: {"Y": 0.0}
        ),
        {"taken": 299, "incomplete": 1},
    ),
}


def without_channel(row, name):
    return {key: value for key, value in row.items() if key != name}


@pytest.mark.slow
@pytest.mark.parametrize("name", SPOILT)
def test_spoilt_rows_are_counted_by_their_kind(run, rows, name):
    spoil, counts = SPOILT[name]
    record = run(spoil(rows))
    assert record.counts == {"first": 1} | counts
    lasts = name == "a channel that the first row lacks"
    assert ("Y" in record.run.state.validator.channels) == lasts


def test_samples_that_lack_what_is_needed_are_left_out_until_one_will_do(run, rows):
    poor = [without_channel(row, "rudder") for row in rows[:5]]
    record = run([*poor, *rows])
    assert record.counts == {"taken": 300, "first": 1, "incomplete": 5}
    assert "'rudder'" in record.messages[0]
    with pytest.raises(ProblemError, match=r"no sample to begin with.*'rudder'"):
        run(poor)


def test_lines_are_json_or_a_table():
    read = LineParser()
    assert read(b'{"time": 1, "u": 2}\n') == {"time": 1, "u": 2}
    assert read(b"\n") is None
    assert read(b"1,2\n") is UNREADABLE
    assert read(b"time,u,segment\n") is None
    assert read(b'1,2,"a"\n') == {"time": 1.0, "u": 2.0, "segment": "a"}
    assert read(b"1,1_0,b\n") == {"time": 1.0, "u": "1_0", "segment": "b"}
    for junk in (b"1,2\n", b"\xff\xfe\x00\n", b"{\n", b"[" * 100_000, b"{" * 100_000, b'"a'):
        assert read(junk) is UNREADABLE
    for junk in ("", "[1]", "1", '"a"', "nul"):
        assert parse_json(junk) is UNREADABLE
    assert read(json.dumps({"time": NAN}).encode())


def test_a_full_queue_drops_the_oldest_and_counts_them():
    queue = BoundedQueue()
    for k in range(10_007):
        queue.put({"time": k})
    queue.put(None)
    assert queue.dropped == 7
    assert [row["time"] for row in queue] == [*range(7, 10_007)]


def test_a_jump_of_time_prints_no_line(run, rows):
    jumping = [row | {"time": 100.0 * k} for k, row in enumerate(rows)]
    assert len(run(jumping, output_interval=1.0).lines) == 1


def test_what_overflows_leaves_the_estimate_as_it_was(run, rows):
    model = hd.DampingModel.from_table({"X": "u u^2 engine^3"}, key="driven")
    driven = [row | {"engine": 0.1 * k % 3.0} for k, row in enumerate(rows)]
    clean = run(driven[:200], model=model)
    record = run(change_rows(driven, 200, 300, lambda _: {"engine": 4e9}), model=model)
    assert all(math.isfinite(value) for value in record.coefficients)
    assert record.counts["taken"] >= clean.counts["taken"]


def test_an_error_in_a_row_is_counted(run, rows, monkeypatch):
    real = estimator.classify

    def judge(screen, time, *given):
        if time == rows[200]["time"]:
            raise np.linalg.LinAlgError("Eigenvalues did not converge")
        return real(screen, time, *given)

    monkeypatch.setattr(estimator, "classify", judge)
    record = run(rows)
    assert record.counts == {"taken": 299, "first": 1, "failed": 1, "again": 1}
    assert "Eigenvalues did not converge" in record.messages[0]


ABSENT = [(dict, "qz"), *((angles, x) for x in ("roll", "pitch", "yaw"))]
ABSENT += [(wrench, x) for x in ("X", "N", "eta", "qw")]
ABSENT += [(dict, x) for x in ("u", "rudder")]


@pytest.mark.slow
@pytest.mark.parametrize(("form", "name"), ABSENT)
def test_a_row_without_a_channel_of_the_first_is_left_out(run, rows, form, name):
    model, full = hd.catalog["fossen"], [form(row) for row in rows]
    poor = [without_channel(row, name) if k % 10 == 5 else row for k, row in enumerate(full)]
    left_out = [row for k, row in enumerate(full) if k % 10 != 5]
    clean, record = (run(each, model=model) for each in (left_out, poor))
    assert_same(record, clean, incomplete=30)


@pytest.mark.slow
def test_another_form_of_the_attitude_is_not_used(run, rows):
    full = [*map(angles, rows)]
    assert_same(run(change_rows(full, 100, 101, lambda _: {"qw": 1.0})), run(full))


STRAY = [
    {"eta": 1.2},
    {"X": 0.0, "rpm": None, "rudder": None, "elevator": None},
    {"roll": 0.0, "pitch": 0.0, "yaw": 0.0, "qw": None},
]


@pytest.mark.slow
@pytest.mark.parametrize("change", STRAY)
@pytest.mark.parametrize("n", [1, 5])
def test_columns_of_the_first_rows_alone_are_not_required(run, rows, change, n):
    first = [
        {name: value for name, value in (row | change).items() if value is not None}
        for row in rows[:n]
    ]
    model = hd.catalog["linear"]
    clean, record = (run(x, model=model) for x in (rows[n + 19 :], first + rows[n:]))
    assert_same(record, clean, taken=300 - 19, first=2, incomplete=19)


def test_a_column_that_a_run_loses_is_required_still(run, rows):
    full = [row | {"eta": 1.2} for row in rows[:100]]
    assert_same(run([*full, *rows[100:]]), run(full), incomplete=200)


@pytest.mark.parametrize("foreign", [{"heartbeat": 1}, {"battery": 15.8, "time": 3.0}])
def test_rows_of_other_programs_interrupt_nothing(run, rows, clean_rows, foreign):
    assert_same(run([each for row in rows for each in (row, foreign)]), clean_rows, foreign=300)


def test_the_cause_is_told_where_no_block_is_whole(run, rows):
    mixed = [row | {"segment": str(k % 2)} for k, row in enumerate(rows)]
    entries = run(mixed).lines[-1]["coefficients"].values()
    assert {(entry["cause"], entry["value"]) for entry in entries} == {("no whole block", None)}


@pytest.mark.slow
@pytest.mark.parametrize("n", [1, 3, 8])
def test_wild_rows_are_not_remembered(dive, run, n):
    """After wild rows, that may be the first ones, single ones are outliers still."""
    samples = [*rows_of(dive[1])]
    start = 0 if n == 1 else 300
    wild = {*range(start, start + n), *range(400, len(samples), 47)}
    spoilt = [row | ({"rpm": 20_000.0} if k in wild else {}) for k, row in enumerate(samples)]
    assert run(spoilt).counts["spike"] == len(range(400, len(samples), 47)) + min(2, n - 1)


def test_each_reason_why_no_run_begins_is_told_once(rows):
    poor = [{"x": 1}, UNREADABLE, *rows[:9], {"x": 1}, *rows[9:20], *[UNREADABLE] * 50]
    vehicle = hd.fleet["bluerov2"]
    record = LiveRecord()
    run = LiveRun(vehicle, hd.catalog["fossen"], "rls", record.lines.append, record.messages.append)
    with pytest.raises(ProblemError, match="'bluerov2' has no actuators"):
        run.process_rows(poor)
    assert len(record.messages) == 3
    assert "'bluerov2' has no actuators" in record.messages[2]
    run.is_stopped = True
    run.process_rows(poor)
    assert "'bluerov2' has no actuators" in record.messages[-1]


def test_equation_1_is_built_once_for_each_set_of_columns(dive, rows, monkeypatch):
    vehicle, built, build = dataclasses.replace(dive[0], name="new"), [], samples.prepare
    monkeypatch.setattr(samples, "prepare", lambda *given: built.append(given) or build(*given))
    poor = [{"time": 1.0, "u": 1.0}, rows[0] | {"v": math.inf}, rows[0] | {"u": 1e9}]
    record = run_live([*poor * 50, *rows], vehicle)
    assert record.counts == {"taken": 300, "first": 1, "incomplete": 150}
    assert len(built) <= len(poor)
    assert "outside the plausible range" in record.messages[2]


@pytest.mark.parametrize("time", [1.7e12, 1.7e15, 1_700_000_000_000_000_000])
def test_a_stream_whose_clock_is_not_in_seconds_does_not_begin(run, rows, time):
    with pytest.raises(ProblemError, match="must be in seconds"):
        run([row | {"time": time + k} for k, row in enumerate(rows[:9])])


@pytest.mark.parametrize("is_started", [True, False])
def test_losses_of_a_source_are_told_when_they_begin_and_at_the_end(rows, is_started):
    messages, number = [], itertools.count()
    live = LiveRun(hd.fleet["vt690"], hd.catalog["linear"], "rls", print, messages.append)
    live.source_counts = lambda: {"dropped": next(number), "kernel drops": 0}
    with nullcontext() if is_started else pytest.raises(ProblemError, match="no sample to begin"):
        live.process_rows(rows if is_started else [{"x": 1}] * 20)
    told = [("so far" in text, "in all" in text) for text in messages if "oldest" in text]
    assert told == [(True, False), (False, True)]


def test_a_source_that_falls_silent_is_reported_once_each_time(run, rows, monkeypatch):
    clock = itertools.count()  # s, one for each row
    monkeypatch.setattr(runner, "monotonic", lambda: next(clock))
    stream = [None] * 9 + rows[:3] + [None] * 3 + rows[3:6] + [None] * 9
    record = run(stream, checkpoint_interval=1e9)
    assert record.messages == ["no data for 5 s; the run waits."] * 2
