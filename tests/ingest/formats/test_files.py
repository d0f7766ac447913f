"""Which reader a file gets, and several files as one recording."""

import gzip
import os
import sys
from contextlib import contextmanager

import numpy as np
import pytest

from hydrodamp.batch.discovery import expand_addresses
from hydrodamp.data.recording import Topic
from hydrodamp.errors import FileError, LogError
from hydrodamp.files import load_text
from hydrodamp.ingest.formats import content, files, rosbag
from strangers import write_columns
from table_rows import rows

TABLE = "t,u\n0,1\n1,2\n"


@rows("begin, at_512, name, form")
def test_content_comes_before_the_name(tmp_path, begin, at_512, name, form):
    path = tmp_path / name
    path.write_bytes((begin.ljust(512) + at_512 if at_512 else begin).encode("latin-1"))
    assert files.format_of(path).name == form


@rows("begin, name, package")
def test_a_missing_reader_is_named_with_its_command(
    tmp_path, monkeypatch, begin, name, package, refused
):
    for module in [it for it in sys.modules if it.partition(".")[0] == package]:
        monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.setitem(sys.modules, package, None)
    (tmp_path / name).write_bytes(begin.encode("latin-1"))
    refused(FileError, lambda: files.read_files(tmp_path / name))


def test_a_folder_of_tables_is_a_topic_each(tmp_path):
    (tmp_path / "dvl.csv").write_text(TABLE)
    (tmp_path / "imu.CSV").write_text("t,r\n0,x\n1,2\n2,3\n")
    (tmp_path / "notes.md").write_text("calm sea")
    (tmp_path / ".hidden.csv").write_text("nothing")
    (tmp_path / "derived.npz").write_bytes(b"")
    recording = files.read_files(tmp_path)
    assert [topic.name for topic in recording.topics] == ["dvl", "imu"]
    assert recording.notes == ("imu.CSV: column `r` must hold numbers; got 'x' in row 1 (line 2)",)
    assert recording.source == str(tmp_path)
    (tmp_path / "imu.CSV").unlink()
    (tmp_path / "derived.npz").unlink()
    assert files.read_files(tmp_path).topics[0].name == "dvl"


def test_several_files_are_one_recording(tmp_path):
    (tmp_path / "dvl.csv").write_text(TABLE)
    np.savez(tmp_path / "imu.npz", t=np.arange(3.0))
    recording = files.read_files([tmp_path / "dvl.csv", tmp_path / "imu.npz"])
    assert {topic.name: topic.n for topic in recording.topics} == {"dvl": 2, "imu": 3}
    assert recording.format == "text in columns and NumPy arrays"
    assert files.read_files([tmp_path / "dvl.csv"]).topics[0].name == ""


def test_topics_of_unequal_fields_cannot_be(refused):
    refused(LogError, Topic, "a", [0.0, 1.0, 2.0], {"x": [1.0, 2.0]})


@pytest.fixture
def bars(monkeypatch):
    """Every bar of a reader: its label, its total and the steps it was told."""
    bars = []

    @contextmanager
    def progress(label, total):
        bars.append((label, total, []))
        yield bars[-1][2].append

    for module in (content, rosbag):
        monkeypatch.setattr(module, "progress", progress)
    return bars


@pytest.mark.slow
@pytest.mark.parametrize("name", ["log.csv", "log.csv.gz", "log.alog", "log.parquet", "log.h5"])
def test_a_bar_counts_the_bytes_of_a_file(tmp_path, bars, name):
    path, values = tmp_path / name, np.random.default_rng(0).normal(size=60_000)
    is_table = path.suffix in (".parquet", ".h5")
    if is_table:
        write_columns(path, {"u": values})
    else:
        mark = " u me " if "alog" in name else ","
        text = "".join(f"{k}{mark}{value}\n" for k, value in enumerate(values)).encode()
        path.write_bytes(gzip.compress(text) if path.suffix == ".gz" else text)
    files.read_files(path)
    ((label, total, steps),) = bars
    assert (label, total) == (f"reading {name}", path.stat().st_size)
    assert len(steps) > 1
    # Who seeks reads some bytes again.
    assert total <= sum(steps) <= (1.5 * total if is_table else total)


def test_a_pipe_a_socket_and_a_dangling_link_are_named_and_not_waited_for(tmp_path, refused):
    table = "time,u\n0,1\n1,2\n"
    (tmp_path / "good.csv").write_text(table, "utf-8")
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "link.csv").symlink_to("nowhere.csv")
    for name in ("pipe.csv", "link.csv"):
        refused(LogError, files.read_files, tmp_path / name)
        refused(FileError, load_text, tmp_path / name)
    notes = " ".join(files.read_files(tmp_path).notes)
    assert "pipe.csv: it is a pipe" in notes
    assert "link.csv: it is a link" in notes
    assert len(expand_addresses([str(tmp_path)])) == 3


@rows("names, topics")
def test_files_have_the_same_topics_in_a_folder_and_joined(tmp_path, names, topics):
    paths = [tmp_path / name for name in names]
    for path in paths:
        path.write_text("t,a\n0,1\n1,2\n2,4\n", "utf-8")
    joined = files.read_files("+".join(map(str, paths)))
    assert [topic.name for topic in joined.topics] == topics
    assert [topic.name for topic in files.read_files(tmp_path).topics] == topics
