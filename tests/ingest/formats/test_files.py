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

TABLE = "t,u\n0,1\n1,2\n"


@pytest.mark.parametrize(
    ("begin", "name", "form"),
    [
        (b"#ROSBAG V2.0\n", "x", "ROS 1 bag"),
        (b"\x89MCAP0\r\n", "x.csv", "ROS 2 bag (MCAP)"),
        (b"SQLite format 3\0", "x", "ROS 2 bag (SQLite)"),
        (b"PAR1", "x.csv", "Parquet"),
        (b"\x93NUMPY", "x.npz", "NumPy arrays"),
        (b"PK\x03\x04", "x.npz", "NumPy arrays"),
        (b"MATLAB 5.0 MAT-file", "x.dat", "MATLAB file"),
        (b"\x89HDF\r\n\x1a\n", "x", "MATLAB or HDF5 file"),
        (b"MATLAB".ljust(512, b" ") + b"\x89HDF\r\n\x1a\n", "x", "MATLAB file"),
        (b"X" * 512 + b"\x89HDF\r\n\x1a\n", "x", "MATLAB or HDF5 file"),
        (b"\xa3\x95\x80", "x", "ArduPilot log"),
        (b"FMT, 128, 89, FMT", "x.log", "ArduPilot log"),
        (b"ULog\x01\x12\x35", "x.bin", "PX4 ULog"),
        (b"%% LOGSTART 5", "x", "MOOS log"),
        (b"0.1 A b 1", "x.alog", "MOOS log"),
        (b"t,u\n0,1\n", "x.log", "text in columns"),
        (b"t,u\n0,1\n", "x", "text in columns"),
        (TABLE.encode("utf-16"), "x", "text in columns"),
    ],
)
def test_content_comes_before_the_name(tmp_path, begin, name, form):
    path = tmp_path / name
    path.write_bytes(begin)
    assert files.format_of(path).name == form


@pytest.mark.parametrize(
    ("content", "name", "package"),
    [
        (b"PAR1", "x.parquet", "pyarrow"),
        (b"\x89HDF\r\n\x1a\n", "x.mat", "h5py"),
        (b"ULog\x01\x12\x35", "x.ulg", "pyulog"),
        (b"#ROSBAG V2.0", "x.bag", "rosbags"),
    ],
)
def test_a_missing_reader_is_named_with_its_command(
    tmp_path, monkeypatch, content, name, package, refused
):
    for module in [it for it in sys.modules if it.partition(".")[0] == package]:
        monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.setitem(sys.modules, package, None)
    (tmp_path / name).write_bytes(content)
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
    if name.endswith("t"):
        arrow, writer = (pytest.importorskip(f"pyarrow{tail}") for tail in ("", ".parquet"))
        writer.write_table(arrow.table({"u": values}), path)
    elif name.endswith("5"):
        with pytest.importorskip("h5py").File(path, "w") as file:
            file["u"] = values
    else:
        mark = " u me " if "alog" in name else ","
        text = "".join(f"{k}{mark}{value}\n" for k, value in enumerate(values)).encode()
        path.write_bytes(gzip.compress(text) if name.endswith("gz") else text)
    files.read_files(path)
    ((label, total, steps),) = bars
    assert (label, total) == (f"reading {name}", path.stat().st_size)
    assert len(steps) > 1
    # Who seeks reads some bytes again.
    assert total <= sum(steps) <= (1.5 * total if name[-1] in "t5" else total)


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
