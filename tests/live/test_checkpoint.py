"""Checkpoints: a run resumes bit for bit; foreign and damaged files are refused."""

import dataclasses
import itertools
import json
from functools import partial
from pathlib import Path

import pytest

from hydrodamp.errors import FileError
from hydrodamp.live import sources
from hydrodamp.live.estimator import METHODS
from hydrodamp.live.samples import rows_of
from live.conftest import run_live


@pytest.fixture
def path(tmp_path):
    return tmp_path / "state.json"


@pytest.fixture
def run(dive, path):
    """Run over rows and save the state."""
    return partial(run_live, vehicle=dive[0], checkpoint_path=path)


@pytest.fixture
def resume(run):
    """Run over a log that may have been begun."""
    return lambda log, **settings: run(sources.LogRows(log), log=log, **settings)


@pytest.fixture
def short(dive):
    return dive[1].between(0.0, 40.0)


def n_rows(path):
    return json.loads(path.read_text())["state"]["n_rows"]


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("stop", [1, 501, 1003])
def test_an_interrupted_run_resumes_bit_for_bit(dive, reference, run, resume, method, stop):
    log, expected = dive[1], reference[method].lines[-1]
    run(itertools.islice(rows_of(log), stop), method=method)
    assert resume(log, method=method).lines[-1] == expected
    assert resume(log, method=method).lines == [expected]


REJECTED = {"spike": {"u": 30.0}, "absurd": {"u": 1e3}, "incomplete": {"rpm": 65535.0}}


@pytest.mark.slow
@pytest.mark.parametrize("kind", REJECTED)
def test_a_log_resumes_after_a_rejected_sample(short, rows, run, resume, kind):
    run([*rows[:-1], rows[-1] | REJECTED[kind]])
    record = resume(short)
    assert "resumes after sample 300" in record.messages[0]
    assert record.counts["taken"] + record.counts[kind] == short.n


@pytest.mark.slow
def test_rejected_samples_at_the_start_count_as_processed(dive, rows, run):
    run(rows)
    other = dive[1].between(50.0, 130.0)
    samples = [*rows_of(other)]
    samples[:5] = [{"time": row["time"], "u": row["u"]} for row in samples[:5]]
    first = run(samples, log=other)
    assert "another log" in first.messages[1]
    assert (first.counts["incomplete"], first.counts["taken"]) == (5, 300 + other.n - 5)
    assert run(samples, log=other).lines == first.lines


@pytest.mark.slow
def test_another_log_with_the_same_clock_is_not_resumed(short, rows, run, resume):
    run(rows)
    other = dataclasses.replace(short, velocity=0.9 * short.velocity)
    assert "another log" in resume(other).messages[0]


def test_a_stray_column_of_the_first_row_is_not_required_after_a_resume(rows, run):
    run(rows[:150])
    record = run([rows[150] | {"eta": 1.2}, *rows[151:]])
    assert record.counts == {"taken": 299, "first": 1, "incomplete": 1}


FOREIGN = {
    "damaged": lambda text: text.replace('"n_rows": 300', '"n_rows": 301'),
    "cannot be read as JSON": lambda text: text[:-100],
    "cannot be read": lambda text: "",
    "of version 8": lambda text: text.replace('"live_state": 8', '"live_state": 1'),
}


@pytest.mark.slow
@pytest.mark.parametrize("sentence", FOREIGN)
def test_a_state_that_is_none_is_put_aside(rows, run, path, sentence):
    fresh = run(rows)
    for _ in range(2):
        path.write_text(FOREIGN[sentence](path.read_text()))
        record = run(rows)
        assert sentence in record.messages[0]
        assert record.lines == fresh.lines
    names = {one.name for one in path.parent.glob("*.other*")}
    assert names == {"state.json.other", "state.json.other1"}
    assert n_rows(path) == 300


@pytest.mark.slow
def test_the_state_of_another_method_is_put_aside(rows, run):
    run(rows, method="ai")
    assert "another vehicle, model, method" in run(rows).messages[0]


def test_a_disk_that_is_full_ends_nothing(rows, run, tmp_path):
    record = run(rows, checkpoint_path=tmp_path / "gone" / "state.json")
    assert record.counts["taken"] == 300
    assert record.messages == [s for s in record.messages if s.startswith("The state is not saved")]


def test_a_full_disk_at_the_start_ends_nothing(rows, run, path, monkeypatch):
    if not Path("/dev/full").exists():
        pytest.skip("needs /dev/full")
    path.with_name(".hydrodamp-state.json-lock").symlink_to("/dev/full")

    def fail(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", fail)
    record = run(rows)
    assert record.counts["taken"] == 300
    assert "state.json: cannot be written: No space left on device" in record.messages[0]


@pytest.mark.parametrize("content", ["[]", '{"type": "FeatureCollection"}', "time,u\n0,1\n"])
def test_a_file_that_is_no_state_stays_as_it_is(rows, run, path, content):
    path.write_text(content)
    with pytest.raises(FileError, match="is not a state of `hydrodamp live`"):
        run(rows)
    assert path.read_text() == content


@pytest.mark.slow
def test_a_state_belongs_to_one_run(rows, run):
    def during():
        yield from rows
        with pytest.raises(FileError, match=r"another run of `hydrodamp live` .process [0-9]"):
            run(rows)

    run(during())
    run(rows)


def test_temporary_files_of_killed_runs_are_removed(rows, run, tmp_path):
    stale = tmp_path / f".hydrodamp-state.json-{15:016x}"
    names = (".hydrodamp-state.json-notes", f".hydrodamp-other.json-{15:016x}", "a.txt")
    others = [tmp_path / name for name in names]
    for one in (stale, *others):
        one.touch()
    run(rows)
    assert not stale.exists()
    assert all(one.exists() for one in others)


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_the_state_is_written_whatever_ends_a_run(rows, run, path, error):
    def ended():
        yield from rows
        raise error

    with pytest.raises(error):
        run(ended())
    assert n_rows(path) == 300
