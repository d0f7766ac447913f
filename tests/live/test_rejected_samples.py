"""Junk in a stream is counted and record; the estimate is that without it."""

import dataclasses
import itertools
import json
import math

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
def rows(dive):
    _, log = dive
    return [*itertools.islice(rows_of(log), 300)]


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
def test_a_rejected_sample_leaves_no_trace(dive, rows, clean_rows, kind):
    record = run_live([*rows[:200], JUNK[kind](rows[199]), *rows[200:]], dive[0])
    assert record.coefficients == clean_rows.coefficients
    assert record.counts == clean_rows.counts | {kind.split()[0]: 1}
    assert len(record.messages) == 1


LACKING = [{"u": NAN}, {"time": NAN}, {"time": "noon"}, {"u": None}, {"rudder": NAN}, {"qw": 3.0}]
LACKING += [{"u": True}, {"u": 10**400}, {"time": 10**400}, {"rpm": 65535}, {"rudder": 32767.0}]
ANGLES = [{"pitch": 400.0}, {"roll": 1e308}, {"yaw": -1e4}, {"pitch": -6.4}]
ABSURD = [{"u": 1e9}, {"rpm": 1e9}, {"rpm": 1e160}, {"rpm": -1e200}, {"rudder": 1e3}]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["incomplete", "absurd"])
def test_after_a_sample_that_lacks_something_a_run_begins(dive, rows, kind):
    turning = [*map(angles, rows)]
    changes = [(rows, change) for change in (LACKING if kind == "incomplete" else ABSURD)]
    changes += [(turning, change) for change in ANGLES] * (kind == "absurd")
    for full, change in changes:
        record = run_live([*full[:20], full[20] | change, *full[21:40]], dive[0])
        assert record.counts == {"taken": 39, "first": 1, kind: 1, "again": 1}, change


def from_row(k, change):
    """Change all rows from one on."""
    return lambda rows: [*rows[:k], *(row | change(row) for row in rows[k:])]


SPOILT = {
    "a clock that is set back": (
        from_row(150, lambda row: {"time": row["time"] - 7200.0}),
        {"taken": 281, "first": 1, "late": 19, "clock": 1},
    ),
    "velocities that leap and stay": (
        from_row(150, lambda row: {"u": row["u"] - 1.5}),
        {"taken": 298, "first": 1, "spike": 2, "leapt": 1},
    ),
    "a command that leaps and stays": (
        from_row(150, lambda row: {"rpm": 5.0 * row["rpm"]}),
        {"taken": 298, "first": 1, "spike": 2, "leapt": 1},
    ),
    "a sensor that freezes until it moves": (
        lambda rows: [
            *rows[:100],
            *(row | {name: rows[100][name] for name in "uvw"} for row in rows[100:200]),
            *rows[200:],
        ],
        {"taken": 221, "first": 1, "frozen": 79, "again": 1},
    ),
    "a sample from the future": (
        lambda rows: [*rows[:200], rows[200] | {"time": 1e6}, *rows[200:]],
        {"taken": 301, "first": 1, "gap": 1, "clock": 1},
    ),
    "outliers before a new column": (
        lambda rows: [
            *rows[:150],
            *(row | {"rpm": 20_000.0} for row in rows[150:152]),
            rows[152] | {"eta": 1.2},
            *rows[153:],
        ],
        {"taken": 297, "first": 1, "spike": 2, "incomplete": 1},
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SPOILT)
def test_spoilt_rows_are_counted_by_their_kind(dive, rows, name):
    spoil, counts = SPOILT[name]
    assert run_live(spoil(rows), dive[0]).counts == counts


def test_samples_that_lack_what_is_needed_are_left_out_until_one_will_do(dive, rows):
    vehicle, _ = dive
    poor = [{key: value for key, value in row.items() if key != "rudder"} for row in rows[:5]]
    record = run_live([*poor, *rows], vehicle)
    assert record.counts == {"taken": 300, "first": 1, "incomplete": 5}
    assert "'rudder'" in record.messages[0]
    with pytest.raises(ProblemError, match=r"no sample to begin with.*'rudder'"):
        run_live(poor, vehicle)


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


@pytest.fixture(scope="module")
def clean_rows(dive, rows):
    return run_live(rows, dive[0])


def test_a_jump_of_time_prints_no_line(dive, rows):
    vehicle, _ = dive
    jumping = [row | {"time": 100.0 * k} for k, row in enumerate(rows)]
    assert len(run_live(jumping, vehicle, output_interval=1.0).lines) == 1


def test_what_overflows_leaves_the_estimate_as_it_was(dive, rows):
    vehicle, _ = dive
    model = hd.DampingModel.from_table({"X": "u u^2 engine^3"}, key="driven")
    driven = [row | {"engine": 0.1 * k % 3.0} for k, row in enumerate(rows)]
    huge = [row | {"engine": 4e9} for row in driven[200:]]
    clean = run_live(driven[:200], vehicle, model=model)
    record = run_live([*driven[:200], *huge], vehicle, model=model)
    assert all(math.isfinite(value) for value in record.coefficients)
    assert record.counts["taken"] >= clean.counts["taken"]


def test_an_error_in_a_row_is_counted(dive, rows, monkeypatch):
    vehicle, _ = dive
    real = estimator.classify

    def judge(screen, time, *given):
        if time == rows[200]["time"]:
            raise np.linalg.LinAlgError("Eigenvalues did not converge")
        return real(screen, time, *given)

    monkeypatch.setattr(estimator, "classify", judge)
    record = run_live(rows, vehicle)
    assert record.counts == {"taken": 299, "first": 1, "failed": 1, "again": 1}
    assert "Eigenvalues did not converge" in record.messages[0]


ABSENT = [(dict, "qz"), *((angles, x) for x in ("roll", "pitch", "yaw"))]
ABSENT += [(wrench, x) for x in ("X", "N", "eta", "qw")]
ABSENT += [(dict, x) for x in ("u", "rudder")]


@pytest.mark.slow
@pytest.mark.parametrize(("form", "name"), ABSENT)
def test_a_row_without_a_channel_of_the_first_is_left_out(dive, rows, form, name):
    model, full = hd.catalog["fossen"], [form(row) for row in rows]
    poor = [
        {x: v for x, v in row.items() if x != name or k % 10 != 5} for k, row in enumerate(full)
    ]
    left_out = [row for k, row in enumerate(full) if k % 10 != 5]
    clean, record = (run_live(each, dive[0], model=model) for each in (left_out, poor))
    assert record.coefficients == clean.coefficients
    assert record.counts == clean.counts | {"incomplete": 30}


@pytest.mark.slow
def test_another_form_of_the_attitude_is_not_used(dive, rows):
    vehicle, full = dive[0], [angles(row) for row in rows]
    clean = run_live(full, vehicle)
    both = run_live([*full[:100], full[100] | {"qw": 1.0}, *full[101:]], vehicle)
    assert (both.coefficients, both.counts) == (clean.coefficients, clean.counts)
    other = run_live([*full[:100], rows[100], *full[101:]], vehicle)
    assert other.counts == clean.counts | {"taken": 300 - 1, "first": 1, "incomplete": 1}


@pytest.mark.slow
def test_a_channel_that_the_first_row_lacked_is_used_when_it_lasts(dive, rows):
    full = [wrench(row) for row in rows]
    first = {name: value for name, value in full[0].items() if name != "Y"}
    model = hd.catalog["fossen"]
    record = run_live([first, *full[1:]], dive[0], model=model)
    assert record.counts == {"taken": 298, "first": 1, "incomplete": 2}
    assert "Y" in record.run.state.validator.channels
    stray = run_live([*({**row, "Y": 0.0} if k == 50 else
                        {x: v for x, v in row.items() if x != "Y"} for k, row in enumerate(full))],
                     dive[0], model=model)  # fmt: skip
    assert stray.counts == {"taken": 299, "first": 1, "incomplete": 1}


STRAY = [
    {"eta": 1.2},
    {"X": 0.0, "rpm": None, "rudder": None, "elevator": None},
    {"roll": 0.0, "pitch": 0.0, "yaw": 0.0, "qw": None},
]


@pytest.mark.slow
@pytest.mark.parametrize("change", STRAY)
@pytest.mark.parametrize("n", [1, 5])
def test_columns_of_the_first_rows_alone_are_not_required(dive, rows, change, n):
    first = [
        {name: value for name, value in (row | change).items() if value is not None}
        for row in rows[:n]
    ]
    model = hd.catalog["linear"]
    clean, record = (run_live(x, dive[0], model=model) for x in (rows[n + 19 :], first + rows[n:]))
    assert record.coefficients == clean.coefficients
    assert record.counts == {"taken": 300 - 19, "first": 2, "incomplete": 19}


def test_a_column_that_a_run_loses_is_required_still(dive, rows):
    full = [row | {"eta": 1.2} for row in rows[:100]]
    clean, record = run_live(full, dive[0]), run_live([*full, *rows[100:]], dive[0])
    assert record.coefficients == clean.coefficients
    assert record.counts == clean.counts | {"incomplete": 200}


@pytest.mark.parametrize("foreign", [{"heartbeat": 1}, {"battery": 15.8, "time": 3.0}])
def test_rows_of_other_programs_interrupt_nothing(dive, rows, clean_rows, foreign):
    mixed = [each for row in rows for each in (row, foreign)]
    record = run_live(mixed, dive[0])
    assert record.coefficients == clean_rows.coefficients
    assert record.counts == clean_rows.counts | {"foreign": 300}


def test_the_cause_is_told_where_no_block_is_whole(dive, rows):
    mixed = [row | {"segment": str(k % 2)} for k, row in enumerate(rows)]
    entries = run_live(mixed, dive[0]).lines[-1]["coefficients"].values()
    assert {entry["cause"] for entry in entries} == {"no whole block"}
    assert {entry["value"] for entry in entries} == {None}


@pytest.mark.slow
@pytest.mark.parametrize("n", [1, 3, 8])
def test_wild_rows_are_not_remembered(dive, reference, n):
    """After wild rows, that may be the first ones, single ones are outliers still."""
    vehicle, log = dive
    samples = [*rows_of(log)]
    start = 0 if n == 1 else 300
    wild = {*range(start, start + n), *range(400, len(samples), 47)}
    spoilt = [row | ({"rpm": 20_000.0} if k in wild else {}) for k, row in enumerate(samples)]
    record = run_live(spoilt, vehicle)
    assert record.counts["spike"] == len(range(400, len(samples), 47)) + min(2, n - 1)


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
def test_a_stream_whose_clock_is_not_in_seconds_does_not_begin(dive, rows, time):
    with pytest.raises(ProblemError, match="must be in seconds"):
        run_live([row | {"time": time + k} for k, row in enumerate(rows[:9])], dive[0])


def test_losses_of_a_source_are_told_when_they_begin_and_at_the_end(dive, rows):
    number = itertools.count()
    counts = lambda: {"dropped": next(number), "kernel drops": 0}  # noqa: E731
    record = run_live(rows, dive[0], output_interval=5.0, source_counts=counts)
    told = [message for message in record.messages if "oldest" in message]
    assert len(told) == 2
    assert "so far" in told[0]
    assert "in all" in told[1]


def test_a_source_that_falls_silent_is_reported_once_each_time(dive, rows, monkeypatch):
    clock = itertools.count()  # s, one for each row
    monkeypatch.setattr(runner, "monotonic", lambda: next(clock))
    stream = [None] * 9 + rows[:3] + [None] * 3 + rows[3:6] + [None] * 9
    record = run_live(stream, dive[0], checkpoint_interval=1e9)
    assert record.messages == ["no data for 5 s; the run waits."] * 2


def test_losses_are_told_where_no_run_begins():
    messages = []
    run = LiveRun(hd.fleet["vt690"], hd.catalog["linear"], "rls", print, messages.append)
    run.source_counts = lambda: {"dropped": 3}
    with pytest.raises(ProblemError, match="no sample to begin with"):
        run.process_rows([{"x": 1}] * 20)
    assert [("so far" in text, "in all" in text) for text in messages[1:]] == [
        (True, False),
        (False, True),
    ]
