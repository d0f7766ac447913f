import sys
from collections.abc import Callable

import numpy as np
import pytest

from hydrodamp.data.recording import Recording
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats import delimited
from table_rows import rows

TABLE = {"t": [0.0, 0.5, 1.0], "u": [1.5, -2.25, 3.0]}


@pytest.fixture(params=["arrow", "alone"])
def reader(request, monkeypatch):
    """Both readers: Arrow's, and our own where Arrow is not installed."""
    if request.param == "arrow":
        pytest.importorskip("pyarrow")
    else:
        monkeypatch.setitem(sys.modules, "pyarrow.csv", None)
    return request.param


Read = Callable[[str | bytes], Recording]


@pytest.fixture
def read(tmp_path):
    """What reads a text from a file."""

    def read_text(text):
        path = tmp_path / "log.csv"
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return delimited.read_file(path)

    return read_text


@rows("text")
def test_any_spelling_gives_the_same_numbers(read, text, reader):
    for encoding in ("utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252"):
        topic = read(text.encode(encoding)).topics[0]
        assert topic.name == ""
        assert topic.time is None
        assert {name: values.tolist() for name, values in topic.fields.items()} == TABLE
        assert topic.faults == {}
        assert topic.texts == {}


@rows("head, names, units")
def test_names_and_units_of_columns(read, reader, head, names, units):
    columns = range(names.count("|") + 1)
    rows = "".join(",".join(str(row + column) for column in columns) + "\n" for row in range(2))
    topic = read(f"{head}\n{rows}").topics[0]
    assert "|".join(topic.fields) == names
    assert topic.units == units
    above = head.count("\n") + 1
    assert list(topic.lines) == [above + 1, above + 2]


def test_words_truths_dates_and_gaps(read, reader):
    recording = read(
        "t,mode,good,when,none,u\n"
        "0,AUTO,True,2022-07-28T12:00:00Z,,1\n"
        "1,AUTO,False,2022-07-28T14:00:01+02:00,,n/a\n"
        "2,STOP,,2022-07-28 12:00:02.500,NaN,3\n"
    )
    topic = recording.topics[0]
    assert topic.texts == {"mode": ("AUTO", "AUTO", "STOP")}
    np.testing.assert_array_equal(topic.fields["good"], [1, 0, np.nan])
    np.testing.assert_array_equal(topic.fields["when"] - 1659009600, [0, 1, 2.5])
    assert topic.units == {"when": "s"}
    assert np.isnan(topic.fields["none"]).all()
    np.testing.assert_array_equal(topic.fields["u"], [1, np.nan, 3])
    assert recording.notes == ("column `when` holds dates or times of day; it is read in seconds",)


def test_numbers_spelt_in_ways_of_other_tongues_are_refused(read, reader):
    topic = read("t;u\n0;1,5\n1;1_000\n2;1.234,5\n3;2,5\n").topics[0]
    assert topic.texts["u"] == ("1,5", "1_000", "1.234,5", "2,5")
    assert topic.faults["u"] == ("column `u` must hold numbers; got '1_000' in row 2 (line 3)")


def test_a_bad_column_keeps_its_cells_across_blocks(read, monkeypatch):
    monkeypatch.setattr(delimited, "_BLOCK_ROWS", 2)
    topic = read("t,u\n0,1.5\n1,2\n2,x\n3,4\n4,y\n5,6\n6,7\n").topics[0]
    assert topic.texts["u"] == ("1.5", "2.0", "x", "4", "y", "6", "7.0")
    assert "'x' in row 3 (line 4), 'y' in row 5 (line 6)" in topic.faults["u"]
    assert topic.fields["t"].tolist() == [0, 1, 2, 3, 4, 5, 6]


@pytest.mark.slow
def test_letters_that_are_no_unicode_far_down(read):
    rows = "".join(f"{k},calm\n" for k in range(60_000))
    recording = read(("t,sea\n" + rows + "60000,müde\n").encode("cp1252"))
    assert recording.topics[0].texts["sea"][-1] == "müde"


def test_the_topics_of_virginia_tech(read, reader):
    head = "DVL\r\n" r"time,v_x,data\_good," "\r\nseconds,m/s,bool,\r\n"
    (topic,) = read(f"{head}10.25,  0.340,  1.0,\r\n10.50,    NaN,  0.0,\r\n").topics
    assert topic.fields["time"].tolist() == [10.25, 10.5]
    np.testing.assert_array_equal(topic.fields["v_x"], [0.34, np.nan])
    assert topic.units == {"time": "seconds", "v_x": "m/s", "data_good": "bool"}
    assert list(topic.lines) == [4, 5]


def test_a_file_of_words_only(read, reader):
    (topic,) = read("event,who\ndive,crew\nrise,crew\n").topics
    assert topic.texts["event"] == ("dive", "rise")


def test_a_line_without_end_is_named(read, refused):
    refused(LogError, read, f"a b,c\n1,x\n2,y\n3,{'z' * (1 << 21)}\n4,q\n")


@rows("cells, delimiter")
def test_marks_of_thousands(read, reader, cells, delimiter):
    text = "\n".join([f"t{delimiter}u", *(f"{k}{delimiter}{cell}" for k, cell in enumerate(cells))])
    (topic,) = read(text).topics
    assert topic.fields["u"].tolist() == [999.5, 1000.5, 12001.5]


def test_a_lone_comma_is_no_mark_of_thousands(read, reader):
    (topic,) = read("t;u;v\n0,5;1,250;1.250,5\n1,5;2,500;2.500,5\n").topics
    assert topic.fields["u"].tolist() == [1.25, 2.5]
    assert topic.fields["v"].tolist() == [1250.5, 2500.5]
