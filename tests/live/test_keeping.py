"""The state on disk: resumed to the bit, refused where it is another's, never half."""

import itertools
import json

import pytest

from hydrodamp.errors import FileError
from hydrodamp.live import sources
from hydrodamp.live.samples import rows_of
from live.conftest import heard


@pytest.mark.parametrize("method", ["rls", "ai"])
@pytest.mark.parametrize("stop", [1, 123, 501, 1003])
def test_an_interrupted_run_goes_on_bit_for_bit(dive, tmp_path, method, stop):
    vehicle, log = dive
    path = tmp_path / "state.json"
    whole = heard(sources.LogRows(log), vehicle, method)
    heard(itertools.islice(rows_of(log), stop), vehicle, method, checkpoint_path=path)
    rest = heard(sources.LogRows(log), vehicle, method, checkpoint_path=path, log=log)
    assert rest.lines[-1] == whole.lines[-1]
    again = heard(sources.LogRows(log), vehicle, method, checkpoint_path=path, log=log)
    assert again.lines == whole.lines[-1:]


def test_a_stream_goes_on_where_it_was(dive, tmp_path):
    vehicle, log = dive
    path, rows = tmp_path / "state.json", [*rows_of(log)]
    whole = heard(rows, vehicle)
    heard(rows[:600], vehicle, checkpoint_path=path)
    assert heard(rows[600:], vehicle, checkpoint_path=path).lines[-1] == whole.lines[-1]


def test_another_log_is_taken_from_its_first_sample(dive, tmp_path):
    vehicle, log = dive
    path, other = tmp_path / "state.json", log.between(50.0, 130.0)
    heard(itertools.islice(rows_of(log), 1100), vehicle, checkpoint_path=path)
    told = heard(sources.LogRows(other), vehicle, checkpoint_path=path, log=other)
    assert "another log" in told.sentences[0]
    assert told.lines[-1]["counts"]["taken"] == 1100 + other.n


def spoil(path, change):
    path.write_text(change(path.read_text()))


FOREIGN = {
    "damaged": lambda text: text.replace('"seen": 300', '"seen": 301'),
    "cannot be read as JSON": lambda text: text[:-100],
    "cannot be read": lambda text: "",
    "of version 2": lambda text: text.replace('"live_state": 2', '"live_state": 1'),
}


@pytest.mark.parametrize("sentence", FOREIGN)
def test_a_state_that_is_none_is_put_aside(dive, tmp_path, sentence):
    vehicle, log = dive
    path, rows = tmp_path / "state.json", [*itertools.islice(rows_of(log), 300)]
    fresh = heard(rows, vehicle, checkpoint_path=path)
    spoil(path, FOREIGN[sentence])
    told = heard(rows, vehicle, checkpoint_path=path)
    assert sentence in told.sentences[0]
    assert told.lines == fresh.lines
    spoil(path, FOREIGN[sentence])
    heard(rows, vehicle, checkpoint_path=path)
    assert {one.name for one in tmp_path.glob("*.other*")} == {
        "state.json.other",
        "state.json.other1",
    }
    assert json.loads(path.read_text())["state"]["seen"] == 300


def test_the_state_of_another_method_is_put_aside(dive, tmp_path):
    vehicle, log = dive
    path, rows = tmp_path / "state.json", [*itertools.islice(rows_of(log), 300)]
    heard(rows, vehicle, "ai", checkpoint_path=path)
    assert (
        "another vehicle, model, method" in heard(rows, vehicle, checkpoint_path=path).sentences[0]
    )


def test_a_disk_that_is_full_ends_nothing(dive, tmp_path):
    vehicle, log = dive
    rows = [*itertools.islice(rows_of(log), 300)]
    told = heard(rows, vehicle, checkpoint_path=tmp_path / "gone" / "state.json")
    assert told.counts["taken"] == 300
    assert told.sentences == [s for s in told.sentences if s.startswith("The state is not kept")]


@pytest.mark.parametrize("content", ["[]", '{"type": "FeatureCollection"}', "time,u\n0,1\n"])
def test_a_file_that_is_no_state_stays_as_it_is(dive, tmp_path, content):
    vehicle, log = dive
    path = tmp_path / "mission.json"
    path.write_text(content)
    with pytest.raises(FileError, match="is not a state of `hydrodamp live`"):
        heard(itertools.islice(rows_of(log), 300), vehicle, checkpoint_path=path)
    assert path.read_text() == content


def test_a_state_belongs_to_one_run(dive, tmp_path):
    vehicle, log = dive
    path, rows = tmp_path / "state.json", [*itertools.islice(rows_of(log), 300)]

    def during():
        yield from rows
        with pytest.raises(FileError, match=r"another run of `hydrodamp live` .process [0-9]"):
            heard(rows, vehicle, checkpoint_path=path)

    heard(during(), vehicle, checkpoint_path=path)
    heard(rows, vehicle, checkpoint_path=path)


def test_temporary_files_of_killed_runs_are_removed(dive, tmp_path):
    vehicle, log = dive
    stale = tmp_path / f".hydrodamp-state.json-{15:016x}"
    others = [
        tmp_path / name
        for name in (".hydrodamp-state.json-notes", f".hydrodamp-other.json-{15:016x}", "a.txt")
    ]
    for one in (stale, *others):
        one.touch()
    heard(itertools.islice(rows_of(log), 300), vehicle, checkpoint_path=tmp_path / "state.json")
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
        heard(ended(), vehicle, checkpoint_path=path)
    assert json.loads(path.read_text())["state"]["seen"] == 300
