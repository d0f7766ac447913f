"""The state on disk: resumed to the bit, refused where it is another's, never half."""

import itertools
import json

import pytest

from hydrodamp.live import sources
from hydrodamp.live.rows import rows_of
from live.conftest import heard


@pytest.mark.parametrize("method", ["rls", "ai"])
@pytest.mark.parametrize("stop", [1, 123, 501, 1003])
def test_an_interrupted_run_goes_on_bit_for_bit(dive, tmp_path, method, stop):
    vehicle, log = dive
    path = tmp_path / "state.json"
    whole = heard(sources.of_log(log), vehicle, method)
    heard(itertools.islice(rows_of(log), stop), vehicle, method, path=path)
    rest = heard(sources.of_log(log), vehicle, method, path=path, log=log)
    assert rest.lines[-1] == whole.lines[-1]
    again = heard(sources.of_log(log), vehicle, method, path=path, log=log)
    assert again.lines == whole.lines[-1:]


def test_a_stream_goes_on_where_it_was(dive, tmp_path):
    vehicle, log = dive
    path, rows = tmp_path / "state.json", [*rows_of(log)]
    whole = heard(rows, vehicle)
    heard(rows[:600], vehicle, path=path)
    assert heard(rows[600:], vehicle, path=path).lines[-1] == whole.lines[-1]


def test_another_log_is_taken_from_its_first_sample(dive, tmp_path):
    vehicle, log = dive
    path, other = tmp_path / "state.json", log.between(50.0, 130.0)
    heard(itertools.islice(rows_of(log), 1100), vehicle, path=path)
    told = heard(sources.of_log(other), vehicle, path=path, log=other)
    assert "another log" in told.sentences[0]
    assert told.lines[-1]["counts"]["taken"] == 1100 + other.n


def spoil(path, change):
    path.write_text(change(path.read_text()))


FOREIGN = {
    "damaged": lambda text: text.replace('"seen": 300', '"seen": 301'),
    "cannot be read as JSON": lambda text: text[:-100],
    "is not a state": lambda text: "[]",
    "of version 2": lambda text: text.replace('"live_state": 2', '"live_state": 1'),
}


@pytest.mark.parametrize("sentence", FOREIGN)
def test_a_state_that_is_none_is_put_aside(dive, tmp_path, sentence):
    vehicle, log = dive
    path, rows = tmp_path / "state.json", [*itertools.islice(rows_of(log), 300)]
    fresh = heard(rows, vehicle, path=path)
    spoil(path, FOREIGN[sentence])
    told = heard(rows, vehicle, path=path)
    assert sentence in told.sentences[0]
    assert told.lines == fresh.lines
    assert (tmp_path / "state.json.other").exists()
    assert json.loads(path.read_text())["state"]["seen"] == 300


def test_the_state_of_another_method_is_put_aside(dive, tmp_path):
    vehicle, log = dive
    path, rows = tmp_path / "state.json", [*itertools.islice(rows_of(log), 300)]
    heard(rows, vehicle, "ai", path=path)
    assert "another vehicle, model, method" in heard(rows, vehicle, path=path).sentences[0]


def test_a_disk_that_is_full_ends_nothing(dive, tmp_path):
    vehicle, log = dive
    rows = [*itertools.islice(rows_of(log), 300)]
    told = heard(rows, vehicle, path=tmp_path / "gone" / "state.json")
    assert told.counts["taken"] == 300
    assert told.sentences == [s for s in told.sentences if s.startswith("The state is not kept")]
