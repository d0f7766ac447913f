"""Junk in a stream is counted and record; the estimate is that without it."""

import itertools
import json
import math

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import ProblemError
from hydrodamp.identification.recursive import estimate_uncertainty
from hydrodamp.live import estimator
from hydrodamp.live.bounded_queue import BoundedQueue
from hydrodamp.live.samples import rows_of
from hydrodamp.live.sources import UNREADABLE, LineParser, parse_json
from live.conftest import run_live

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
def test_a_rejected_sample_leaves_no_trace(dive, rows, clean_rows, kind):
    vehicle, _ = dive
    spoilt = [*rows[:200], JUNK[kind](rows[199]), *rows[200:]]
    clean, record = clean_rows, run_live(spoilt, vehicle)
    assert record.coefficients == clean.coefficients
    assert record.counts == clean.counts | {kind: 1}
    assert len(record.messages) == 1


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
        ({"u": True}, "incomplete"),
        ({"u": 10**400}, "incomplete"),
        ({"time": 10**400}, "incomplete"),
        ({"rpm": 65535}, "incomplete"),
        ({"rudder": 32767.0}, "incomplete"),
        ({"rpm": 1e9}, "absurd"),
        ({"rpm": 1e160}, "absurd"),
        ({"rpm": -1e200}, "absurd"),
        ({"rudder": 1e3}, "absurd"),
    ],
)
def test_after_a_sample_that_lacks_something_a_run_begins(dive, rows, change, kind):
    vehicle, _ = dive
    spoilt = [*rows[:200], rows[200] | change, *rows[201:]]
    record = run_live(spoilt, vehicle)
    assert record.counts == {"taken": 299, "first": 1, kind: 1, "again": 1}


def test_a_clock_that_is_set_back_begins_a_run(dive, rows):
    vehicle, _ = dive
    set_back = [*rows[:150], *(row | {"time": row["time"] - 7200.0} for row in rows[150:])]
    record = run_live(set_back, vehicle)
    assert record.counts == {"taken": 281, "first": 1, "late": 19, "clock": 1}


def test_velocities_that_leap_and_stay_begin_a_run(dive, rows):
    vehicle, _ = dive
    hit = [*rows[:150], *(row | {"u": row["u"] - 1.5} for row in rows[150:])]
    assert run_live(hit, vehicle).counts == {"taken": 298, "first": 1, "spike": 2, "leapt": 1}


def test_a_sensor_that_freezes_is_left_out_until_it_moves(dive, rows):
    vehicle, _ = dive
    held = {name: rows[100][name] for name in "uvw"}
    frozen = [*rows[:100], *(row | held for row in rows[100:200]), *rows[200:]]
    record = run_live(frozen, vehicle)
    assert record.counts == {"taken": 221, "first": 1, "frozen": 79, "again": 1}


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


def test_a_command_that_leaps_for_one_sample_leaves_no_trace(dive, rows, clean_rows):
    vehicle, _ = dive
    extra = rows[199] | {"time": rows[199]["time"] + 0.01, "rpm": 20_000.0}
    clean, record = clean_rows, run_live([*rows[:200], extra, *rows[200:]], vehicle)
    assert record.coefficients == clean.coefficients
    assert record.counts == clean.counts | {"spike": 1}


def test_a_command_that_leaps_and_stays_begins_a_run(dive, rows):
    vehicle, _ = dive
    faster = [*rows[:150], *(row | {"rpm": 5.0 * row["rpm"]} for row in rows[150:])]
    assert run_live(faster, vehicle).counts == {"taken": 298, "first": 1, "spike": 2, "leapt": 1}


@pytest.fixture(scope="module")
def clean_rows(dive, rows):
    return run_live(rows, dive[0])


def drag_of(record):
    state, labels = record.run.state.rls, list(record.lines[-1]["coefficients"])
    value = record.lines[-1]["coefficients"]["X_u|u|"]["value"]
    return value, estimate_uncertainty(state).standard_errors[labels.index("X_u|u|")]


@pytest.mark.parametrize("rpm", [65535, 1e9, 1e200, 12_000, 30_000])
def test_one_absurd_command_moves_no_estimate(dive, reference, rpm):
    vehicle, log = dive
    rows = [*rows_of(log)]
    clean, error = drag_of(reference["rls"])
    rows[700] |= {"rpm": rpm}
    value, _ = drag_of(run_live(rows, vehicle))
    assert abs(value - clean) < error


@pytest.mark.parametrize("force", [1e6, 1e200, 500.0])
def test_one_absurd_wrench_moves_no_estimate(dive, force):
    vehicle, log = dive
    wrench = vehicle.known_wrench(
        log.velocity, np.zeros((log.n, 3)), {name: log.command(name) for name in log.command_names}
    )
    commands = set(log.command_names)
    rows = [
        {name: value for name, value in row.items() if name not in commands}
        | dict(zip("XYZKMN", known.tolist(), strict=True))
        for row, known in zip(rows_of(log), wrench, strict=True)
    ]
    model = hd.catalog["fossen"]
    clean, error = drag_of(run_live(rows, vehicle, model=model))
    rows[700] |= {"X": force}
    record = run_live(rows, vehicle, model=model)
    assert abs(drag_of(record)[0] - clean) < error
    assert record.counts["absurd" if force > 1e3 else "spike"] == 1


def test_a_sample_from_the_future_blocks_none_behind_it(dive, rows):
    vehicle, _ = dive
    ahead = rows[200] | {"time": 1e6}
    record = run_live([*rows[:200], ahead, *rows[200:]], vehicle)
    assert record.counts == {"taken": 301, "first": 1, "gap": 1, "clock": 1}


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
