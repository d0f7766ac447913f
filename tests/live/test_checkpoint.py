"""Checkpoints: a run resumes bit for bit; foreign and damaged files are refused."""

import dataclasses
import itertools
import json
from pathlib import Path

import pytest

from hydrodamp.errors import FileError
from hydrodamp.live import sources
from hydrodamp.live.estimator import METHODS
from hydrodamp.live.samples import rows_of
from live.conftest import run_live


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("stop", [1, 501, 1003])
def test_an_interrupted_run_resumes_bit_for_bit(dive, reference, tmp_path, method, stop):
    vehicle, log = dive
    path, expected = tmp_path / "state.json", reference[method].lines[-1]
    run_live(itertools.islice(rows_of(log), stop), vehicle, method, checkpoint_path=path)
    second = run_live(sources.LogRows(log), vehicle, method, checkpoint_path=path, log=log)
    assert second.lines[-1] == expected
    again = run_live(sources.LogRows(log), vehicle, method, checkpoint_path=path, log=log)
    assert again.lines == [expected]


REJECTED = {"spike": {"u": 30.0}, "absurd": {"u": 1e3}, "incomplete": {"rpm": 65535.0}}


@pytest.mark.slow
@pytest.mark.parametrize("kind", REJECTED)
def test_a_log_resumes_after_a_rejected_sample(dive, tmp_path, kind):
    vehicle, log = dive[0], dive[1].between(0.0, 40.0)
    path, rows = tmp_path / "state.json", [*itertools.islice(rows_of(log), 300)]
    run_live([*rows[:-1], rows[-1] | REJECTED[kind]], vehicle, checkpoint_path=path)
    record = run_live(sources.LogRows(log), vehicle, checkpoint_path=path, log=log)
    assert "resumes after sample 300" in record.messages[0]
    assert record.counts["taken"] + record.counts[kind] == log.n


@pytest.mark.slow
def test_rejected_samples_at_the_start_count_as_processed(dive, tmp_path):
    vehicle, log = dive[0], dive[1].between(0.0, 40.0)
    path, rows = tmp_path / "state.json", [*rows_of(log)]
    run_live(rows[:300], vehicle, checkpoint_path=path)
    other = dive[1].between(50.0, 130.0)
    poor = [{"time": row["time"], "u": row["u"]} for row in rows_of(other)][:5]
    rows = [*poor, *itertools.islice(rows_of(other), 5, None)]
    first = run_live(rows, vehicle, checkpoint_path=path, log=other)
    assert "another log" in first.messages[1]
    assert (first.counts["incomplete"], first.counts["taken"]) == (5, 300 + other.n - 5)
    again = run_live(rows, vehicle, checkpoint_path=path, log=other)
    assert again.lines == first.lines


@pytest.mark.slow
def test_another_log_with_the_same_clock_is_not_resumed(dive, tmp_path):
    vehicle, log = dive[0], dive[1].between(0.0, 40.0)
    path, other = tmp_path / "state.json", dataclasses.replace(log, velocity=0.9 * log.velocity)
    run_live(itertools.islice(rows_of(log), 300), vehicle, checkpoint_path=path)
    record = run_live(sources.LogRows(other), vehicle, checkpoint_path=path, log=other)
    assert "another log" in record.messages[0]


def test_a_stray_column_of_the_first_row_is_not_required_after_a_resume(dive, tmp_path):
    vehicle, log = dive
    path, rows = tmp_path / "state.json", [*itertools.islice(rows_of(log), 300)]
    run_live(rows[:150], vehicle, checkpoint_path=path)
    record = run_live([rows[150] | {"eta": 1.2}, *rows[151:]], vehicle, checkpoint_path=path)
    assert record.counts == {"taken": 299, "first": 1, "incomplete": 1}


def spoil(path, change):
    path.write_text(change(path.read_text()))


FOREIGN = {
    "damaged": lambda text: text.replace('"n_rows": 300', '"n_rows": 301'),
    "cannot be read as JSON": lambda text: text[:-100],
    "cannot be read": lambda text: "",
    "of version 8": lambda text: text.replace('"live_state": 8', '"live_state": 1'),
}


@pytest.mark.slow
@pytest.mark.parametrize("sentence", FOREIGN)
def test_a_state_that_is_none_is_put_aside(dive, tmp_path, sentence):
    vehicle, log = dive
    path, rows = tmp_path / "state.json", [*itertools.islice(rows_of(log), 300)]
    fresh = run_live(rows, vehicle, checkpoint_path=path)
    spoil(path, FOREIGN[sentence])
    record = run_live(rows, vehicle, checkpoint_path=path)
    assert sentence in record.messages[0]
    assert record.lines == fresh.lines
    spoil(path, FOREIGN[sentence])
    run_live(rows, vehicle, checkpoint_path=path)
    assert {one.name for one in tmp_path.glob("*.other*")} == {
        "state.json.other",
        "state.json.other1",
    }
    assert json.loads(path.read_text())["state"]["n_rows"] == 300


@pytest.mark.slow
def test_the_state_of_another_method_is_put_aside(dive, tmp_path):
    vehicle, log = dive
    path, rows = tmp_path / "state.json", [*itertools.islice(rows_of(log), 300)]
    run_live(rows, vehicle, "ai", checkpoint_path=path)
    assert (
        "another vehicle, model, method"
        in run_live(rows, vehicle, checkpoint_path=path).messages[0]
    )


def test_a_disk_that_is_full_ends_nothing(dive, tmp_path):
    vehicle, log = dive
    rows = [*itertools.islice(rows_of(log), 300)]
    record = run_live(rows, vehicle, checkpoint_path=tmp_path / "gone" / "state.json")
    assert record.counts["taken"] == 300
    assert record.messages == [s for s in record.messages if s.startswith("The state is not saved")]


def test_a_full_disk_at_the_start_ends_nothing(dive, tmp_path, monkeypatch):
    vehicle, log = dive
    path = tmp_path / "state.json"
    if not Path("/dev/full").exists():
        pytest.skip("needs /dev/full")
    path.with_name(".hydrodamp-state.json-lock").symlink_to("/dev/full")

    def fail(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", fail)
    record = run_live(itertools.islice(rows_of(log), 300), vehicle, checkpoint_path=path)
    assert record.counts["taken"] == 300
    assert "state.json: cannot be written: No space left on device" in record.messages[0]


@pytest.mark.parametrize("content", ["[]", '{"type": "FeatureCollection"}', "time,u\n0,1\n"])
def test_a_file_that_is_no_state_stays_as_it_is(dive, tmp_path, content):
    vehicle, log = dive
    path = tmp_path / "mission.json"
    path.write_text(content)
    with pytest.raises(FileError, match="is not a state of `hydrodamp live`"):
        run_live(itertools.islice(rows_of(log), 300), vehicle, checkpoint_path=path)
    assert path.read_text() == content


@pytest.mark.slow
def test_a_state_belongs_to_one_run(dive, tmp_path):
    vehicle, log = dive
    path, rows = tmp_path / "state.json", [*itertools.islice(rows_of(log), 300)]

    def during():
        yield from rows
        with pytest.raises(FileError, match=r"another run of `hydrodamp live` .process [0-9]"):
            run_live(rows, vehicle, checkpoint_path=path)

    run_live(during(), vehicle, checkpoint_path=path)
    run_live(rows, vehicle, checkpoint_path=path)


def test_temporary_files_of_killed_runs_are_removed(dive, tmp_path):
    vehicle, log = dive
    stale = tmp_path / f".hydrodamp-state.json-{15:016x}"
    others = [
        tmp_path / name
        for name in (".hydrodamp-state.json-notes", f".hydrodamp-other.json-{15:016x}", "a.txt")
    ]
    for one in (stale, *others):
        one.touch()
    run_live(itertools.islice(rows_of(log), 300), vehicle, checkpoint_path=tmp_path / "state.json")
    assert not stale.exists()
    assert all(one.exists() for one in others)


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_the_state_is_written_whatever_ends_a_run(dive, tmp_path, error):
    vehicle, log = dive
    path = tmp_path / "state.json"

    def ended():
        yield from itertools.islice(rows_of(log), 300)
        raise error

    with pytest.raises(error):
        run_live(ended(), vehicle, checkpoint_path=path)
    assert json.loads(path.read_text())["state"]["n_rows"] == 300
