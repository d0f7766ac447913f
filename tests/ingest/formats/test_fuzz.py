"""The readers of our own on anything: an answer or a LogError, and no number but those written."""

import sys

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from hydrodamp.errors import FileError, LogError
from hydrodamp.ingest.formats import ardupilot, delimited, files, moos

SETTINGS = settings(
    max_examples=30,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
NUMBER = st.floats(allow_nan=True, allow_infinity=True, width=64)
NAME = st.text(st.sampled_from("abcdefgxyz_"), min_size=1, max_size=8).map(lambda it: "x" + it)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz")


def answers(read, path):
    """Read, or refuse in words."""
    try:
        return read(path)
    except (LogError, FileError) as error:
        message = str(error)
    assert path.name in message
    return None


@SETTINGS
@given(content=st.binary(max_size=400))
@pytest.mark.parametrize("name", ["x.csv", "x.bin", "x.alog", "x.dat", "x", "x.csv.gz", "x.ulg"])
def test_any_bytes_are_answered(place, name, content):
    path = place / name
    path.write_bytes(content)
    answers(files.read_files, path)


@SETTINGS
@given(content=st.text(st.sampled_from("01.,;\t e-\n\r\"'#%tuNa_\0é="), max_size=200))
@pytest.mark.parametrize("read", [delimited.read_file, moos.read_file, ardupilot.read_file])
def test_any_text_is_answered(place, read, content):
    path = place / "x.dat"
    path.write_bytes(content.encode())
    recording = answers(read, path)
    for topic in () if recording is None else recording.topics:
        assert all(len(values) == topic.n for values in topic.fields.values())


@SETTINGS
@given(content=st.text(st.sampled_from('01.,; -\n"tuNa'), max_size=120))
def test_arrow_and_the_careful_reader_agree(place, content):
    """Where Arrow reads a text, the reader that goes row by row finds the same in it."""
    pytest.importorskip("pyarrow")
    path = place / "x.csv"
    path.write_text(content, newline="")
    fast = answers(delimited.read_file, path)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "pyarrow.csv", None)
        slow = answers(delimited.read_file, path)
    assert (fast is None) == (slow is None)
    if fast is None:
        return
    ours, theirs = fast.topics[0], slow.topics[0]
    assert list(ours.fields) == list(theirs.fields)
    assert ours.texts == theirs.texts
    assert ours.faults == theirs.faults
    assert list(ours.lines) == list(theirs.lines)
    for name, values in ours.fields.items():
        np.testing.assert_array_equal(values, theirs.fields[name])


@pytest.mark.slow
@SETTINGS
@given(data=st.data())
@pytest.mark.parametrize("fast", [True, False])
def test_tables_come_back_as_written(place, fast, data):
    names = data.draw(st.lists(NAME, min_size=2, max_size=4, unique=True))
    mark = data.draw(st.sampled_from([",", ";", "\t", "|", "  "]))
    comma = mark != "," and data.draw(st.booleans())
    cells = st.lists(NUMBER, min_size=len(names), max_size=len(names))
    rows = data.draw(st.lists(cells, min_size=1, max_size=8))
    rows.append([1.5] * len(names))  # a file of nothing but gaps has no columns of numbers
    text = mark.join(names) + "\n" + "".join(mark.join(map(repr, row)) + "\n" for row in rows)
    path = place / "x.csv"
    path.write_text(text.replace(".", ",") if comma else text)
    with pytest.MonkeyPatch.context() as patch:
        if not fast:
            patch.setitem(sys.modules, "pyarrow.csv", None)
        topic = delimited.read_file(path).topics[0]
    assert list(topic.fields) == names
    for column, values in zip(zip(*rows, strict=True), topic.fields.values(), strict=True):
        np.testing.assert_array_equal(values, column)


@pytest.mark.slow
@SETTINGS
@given(damage=st.lists(st.tuples(st.integers(0, 2000), st.integers(0, 255)), max_size=12))
@pytest.mark.parametrize("name", ["x.bin", "x.ulg"])
def test_damaged_logs_are_answered(place, dive, write_ulog, name, damage):
    path = dive.save(place / name) if name == "x.bin" else write_ulog(place / name)
    content = bytearray(path.read_bytes())
    for where, value in damage:
        content[where % len(content)] = value
    path.write_bytes(content)
    recording = answers(ardupilot.read_file if name == "x.bin" else files.read_files, path)
    assert recording is None or recording.topics
