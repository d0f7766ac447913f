"""Readers: CSV against Arrow and polars alone, bags and ArduPilot logs against their readers.

The other side reads the same file and hands over its own objects; ours returns a recording.
"""

from __future__ import annotations

import struct
import sys
from pathlib import Path

import numpy as np
import pytest
from interleaving import interleaved, on_all_cores

from hydrodamp.ingest.formats import arrow, files

ROWS, COLUMNS = 1_000_000, 20


@pytest.fixture(scope="module")
def table() -> np.ndarray:
    """A clock and nineteen channels of noise."""
    noise = np.random.default_rng(0).standard_normal((ROWS, COLUMNS - 1))
    return np.column_stack([np.arange(ROWS) * 0.1, noise])


@pytest.fixture(scope="module")
def csv_file(tmp_path_factory: pytest.TempPathFactory, table: np.ndarray) -> Path:
    pyarrow, csv = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.csv")
    path = tmp_path_factory.mktemp("csv") / "log.csv"
    csv.write_csv(pyarrow.table({f"c{k}": table[:, k] for k in range(COLUMNS)}), path)
    return path


def _polars(path: Path) -> object:
    import polars

    return polars.read_csv(path)


def _arrow(path: Path) -> object:
    from pyarrow import csv

    return csv.read_csv(path)


@pytest.mark.parametrize(("name", "other"), [("polars", _polars), ("pyarrow", _arrow)])
def test_csv(benchmark, ledger, csv_file, name, other):
    """A million rows of twenty columns; CPU time counts, as all three use all cores."""
    pytest.importorskip(name)
    mine, theirs = interleaved(
        benchmark, lambda: files.read_files(csv_file), lambda: other(csv_file), rounds=7
    )
    ledger.within(f"CSV, 1e6 x 20, CPU time: {name} alone", mine, theirs, target=1.3)


def test_csv_on_the_wall(benchmark, ledger, csv_file):
    """The same by the clock on the wall, which only an idle machine can tell."""
    pytest.importorskip("polars")
    mine, theirs = on_all_cores(
        benchmark, lambda: files.read_files(csv_file), lambda: _polars(csv_file), rounds=7
    )
    ledger.within("CSV, 1e6 x 20, wall time: polars alone", mine.best, theirs.best)


def test_csv_without_arrow(benchmark, ledger, csv_file, tmp_path, monkeypatch):
    """The careful reader on a tenth of the rows, against NumPy's loadtxt."""
    lines = csv_file.read_bytes().split(b"\n", ROWS // 10 + 1)[:-1]
    path = tmp_path / "log.csv"
    path.write_bytes(b"\n".join(lines) + b"\n")
    monkeypatch.setitem(sys.modules, "pyarrow.csv", None)
    mine, theirs = interleaved(
        benchmark,
        lambda: files.read_files(path),
        lambda: np.loadtxt(path, delimiter=",", skiprows=1),
        rounds=3,
    )
    ledger.within("CSV without Arrow, 1e5 x 20: numpy.loadtxt", mine, theirs)


@pytest.mark.parametrize("kind", ["MCAP", "SQLITE3"])
def test_bag(benchmark, ledger, tmp_path, kind):
    """20 000 odometry messages of 84 numbers; rosbags deserialises each."""
    highlevel = pytest.importorskip("rosbags.highlevel")
    path = _bag(tmp_path / "dive", kind, 20_000)

    def alone() -> list[object]:
        with highlevel.AnyReader([path]) as bag:
            return [bag.deserialize(raw, it.msgtype) for it, _, raw in bag.messages()]

    ours, reference = interleaved(benchmark, lambda: files.read_files(path), alone, rounds=5)
    ledger.within(f"ROS 2 bag ({kind}), 2e4 odometry: rosbags alone", ours, reference, target=1.2)


def test_mcap_against_its_own_reader(benchmark, ledger, tmp_path):
    """The same against mcap with mcap-ros2-support."""
    reader = pytest.importorskip("mcap_ros2.reader")
    pytest.importorskip("rosbags")
    path = _bag(tmp_path / "dive", "MCAP", 20_000)
    (file,) = path.glob("*.mcap")
    ours, reference = interleaved(
        benchmark,
        lambda: files.read_files(file),
        lambda: [it.ros_msg for it in reader.read_ros2_messages(str(file))],
        rounds=3,
    )
    ledger.within("the same: mcap-ros2-support alone", ours, reference, target=1.2)


def _bag(folder: Path, kind: str, n: int) -> Path:
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.LATEST)
    name = "nav_msgs/msg/Odometry"
    types = {key.rpartition("/")[2]: value for key, value in store.types.items()}
    vector, square = types["Vector3"](x=0.1, y=0.2, z=0.3), np.arange(36.0)
    pose = types["Pose"](
        position=types["Point"](x=1.0, y=2.0, z=3.0),
        orientation=types["Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
    )
    message = types["Odometry"](
        header=types["Header"](stamp=types["Time"](sec=100, nanosec=5), frame_id="odom"),
        child_frame_id="base_link",
        pose=types["PoseWithCovariance"](pose=pose, covariance=square),
        twist=types["TwistWithCovariance"](
            twist=types["Twist"](linear=vector, angular=vector), covariance=square
        ),
    )
    raw = store.serialize_cdr(message, name)
    with Writer(folder, version=9, storage_plugin=StoragePlugin[kind]) as writer:
        connection = writer.add_connection("/odometry", name, typestore=store)
        for k in range(n):
            writer.write(connection, 100_000_000_000 + k * 20_000_000, raw)
    return folder


def test_dataflash(benchmark, ledger, tmp_path):
    """60 000 ArduPilot messages of three kinds; pymavlink hands out each."""
    reader = pytest.importorskip("pymavlink.DFReader")
    path = tmp_path / "dive.bin"
    path.write_bytes(_dataflash(20_000))

    def alone() -> int:
        log = reader.DFReader_binary(str(path))
        count = 0
        while log.recv_msg() is not None:
            count += 1
        log.close()
        return count

    ours, reference = interleaved(benchmark, lambda: files.read_files(path), alone, rounds=3)
    ledger.within("ArduPilot .bin, 6e4 messages: pymavlink alone", ours, reference, target=1.2)


def _dataflash(n: int) -> bytes:
    about = struct.Struct("<BBB BB 4s 16s 64s")
    kinds = (
        (128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns"),
        (140, 23, b"ATT", b"QffB" + b"BBB", b"TimeUS,Roll,Pitch,a,b,c,d"),
        (141, 36, b"IMU", b"QBffffff", b"TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ"),
        (142, 27, b"CTUN", b"Qffff", b"TimeUS,ThI,ThO,DAlt,Alt"),
    )
    content = bytearray(b"".join(about.pack(0xA3, 0x95, 128, *kind) for kind in kinds))
    attitude, inertial = struct.Struct("<BBBQffBBBB"), struct.Struct("<BBBQBffffff")
    tuning = struct.Struct("<BBBQffff")
    for k in range(n):
        content += attitude.pack(0xA3, 0x95, 140, 2_500 * k, 0.5, 0.25, 1, 2, 3, 4)
        content += inertial.pack(0xA3, 0x95, 141, 2_500 * k, 0, *range(6))
        content += tuning.pack(0xA3, 0x95, 142, 2_500 * k, 1.0, 2.0, 3.0, 4.0)
    return bytes(content)


def test_px4(benchmark, ledger, tmp_path):
    """20 000 messages of PX4; pyulog alone."""
    pyulog = pytest.importorskip("pyulog")
    path = tmp_path / "dive.ulg"
    body = bytearray(b"ULog\x01\x12\x35\x01" + bytes(8))
    formats = b"vehicle_attitude:uint64_t timestamp;float[4] q;"
    for kind, content in ((b"F", formats), (b"A", bytes(3) + b"vehicle_attitude")):
        body += struct.pack("<HB", len(content), kind[0]) + content
    for k in range(20_000):
        body += struct.pack("<HBHQ4f", 26, b"D"[0], 0, 2_500 * k, 1.0, 0.0, 0.0, 0.0)
    path.write_bytes(body)
    ours, reference = interleaved(
        benchmark, lambda: files.read_files(path), lambda: pyulog.ULog(str(path)), rounds=5
    )
    ledger.within("PX4 .ulg, 2e4 messages: pyulog alone", ours, reference)


def test_parquet(benchmark, ledger, tmp_path, table):
    pyarrow = pytest.importorskip("pyarrow")
    reader = pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "log.parquet"
    reader.write_table(pyarrow.table({f"c{k}": table[:, k] for k in range(COLUMNS)}), path)
    mine, theirs = on_all_cores(
        benchmark, lambda: arrow.read_file(path), lambda: reader.read_table(path), rounds=5
    )
    ledger.within("Parquet, 1e6 x 20: pyarrow alone", mine.best, theirs.best, target=1.5)
