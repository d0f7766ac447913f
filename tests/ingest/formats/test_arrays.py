"""Parquet, NPZ and MAT: written by pyarrow, NumPy, SciPy and h5py."""

import datetime
import gzip
import struct
from decimal import Decimal

import numpy as np
import pytest
import scipy.io

from hydrodamp.ingest.formats import arrays, files
from strangers import write_columns

TIME = np.arange(5.0)


def test_parquet_of_every_type(tmp_path):
    arrow = pytest.importorskip("pyarrow")
    writer = pytest.importorskip("pyarrow.parquet")
    noon = datetime.datetime(2022, 7, 28, 12, tzinfo=datetime.UTC)
    stated = arrow.field("depth", arrow.float32(), metadata={"unit": "m"})
    nan = pytest.approx(np.nan, nan_ok=True)
    written = {
        "count": (arrow.array([1, None], arrow.int64()), [1, nan]),
        "good": (arrow.array([True, None]), [1, nan]),
        "fine": (arrow.array([False, True]), [0, 1]),
        "price": (arrow.array([Decimal("1.25"), None]), [1.25, nan]),
        "when": (arrow.array([noon, None], arrow.timestamp("us", "UTC")), [1659009600, nan]),
        "day": (arrow.array([noon.date(), None]), [1658966400, nan]),
        "span": (arrow.array([250, None], arrow.duration("ms")), [0.25, nan]),
    }
    columns = {name: array for name, (array, _) in written.items()} | {
        "time [s]": arrow.array([0.0, 0.5]),
        "mode": arrow.array(["AUTO", None]),
        "kind": arrow.array(["a", "b"]).dictionary_encode(),
        "rpm": arrow.array([[1.0, 2.0], [3.0]]),
        "pose": arrow.array([{"x": 1.0, "at": {"y": 2.0}}, {"x": 3.0, "at": {"y": 4.0}}]),
        "blob": arrow.array([b"a", b"b"]),
        "names": arrow.array([["a"], ["b"]]),
        "cloud": arrow.array([[0.0] * 99] * 2),
    }
    table = arrow.table(columns).append_column(stated, arrow.array([3.0, 4.0], arrow.float32()))
    writer.write_table(table, tmp_path / "run.parquet")
    recording = files.read_files(tmp_path / "run.parquet")
    topic = recording.topics[0]
    nested = {"rpm[0]": [1, 3], "rpm[1]": [2, nan], "pose.x": [1, 3], "pose.at.y": [2, 4]}
    expected = {name: values for name, (_, values) in written.items()} | nested
    expected |= {"time": [0, 0.5], "depth": [3, 4]}
    assert {name: values.tolist() for name, values in topic.fields.items()} == expected
    assert topic.texts == {"mode": ("AUTO", ""), "kind": ("a", "b")}
    assert topic.units == {"time": "s", "when": "s", "day": "s", "span": "s", "depth": "m"}
    assert [note.split("`")[1] for note in recording.notes] == ["blob", "names", "cloud"]


def test_npz(tmp_path):
    path = tmp_path / "run.npz"
    nu = np.arange(10.0).reshape(5, 2)
    np.savez(
        path,
        **{"time": TIME, "nu": nu, "across": nu.T, "u [m/s]": TIME, "mode": list("abcde")},
        mass=12.0,
        cube=np.zeros((5, 2, 2)),
        wide=np.zeros((5, 99)),
    )
    recording = arrays.read_file(path)
    topic = recording.topics[0]
    np.testing.assert_array_equal(topic.fields["nu[1]"], nu[:, 1])
    np.testing.assert_array_equal(topic.fields["across[1]"], nu[:, 1])
    assert topic.units == {"u": "m/s"}
    assert topic.texts == {"mode": tuple("abcde")}
    assert [note.split("`")[1] for note in recording.notes] == ["mass", "cube", "wide"]


@pytest.mark.parametrize("name", ["a.npz", "a.parquet"])
def test_numbers_held_as_text_are_numbers_and_labels_stay_words(tmp_path, name):
    columns = {"u": np.array(["0.5", "1e3", ""]), "segment": np.array(["001", "001", "2"])}
    (topic,) = files.read_files(write_columns(tmp_path / name, columns)).topics
    np.testing.assert_equal(topic.fields["u"], [0.5, 1000.0, np.nan])
    assert topic.texts["segment"] == ("001", "001", "2")


def test_structures_of_numpy_are_taken_apart(tmp_path):
    rows = np.zeros(3, dtype=[("t", "f8"), ("v", "f8", 3)])
    rows["t"] = [0, 1, 2]
    np.savez(tmp_path / "a.npz", log=rows)
    np.save(tmp_path / "a.npy", rows)
    for name, stem in (("a.npz", "log."), ("a.npy", "")):
        (topic,) = files.read_files(tmp_path / name).topics
        assert [*topic.fields] == [f"{stem}{item}" for item in ("t", "v[0]", "v[1]", "v[2]")]


@pytest.mark.parametrize("userblock", [0, 512])
def test_mat_of_version_seven_three(tmp_path, userblock):
    """MATLAB writes a matrix of n x 3 as a dataset of 3 x n, and says its class."""
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "run.mat"
    with h5py.File(path, "w", userblock_size=userblock) as file:
        for name, block in (("log/time", TIME[None]), ("log/nu", np.arange(15.0).reshape(3, 5))):
            file[name] = block
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
        file["log/name"] = np.array([100, 105], dtype="u2")
        file["log/name"].attrs["MATLAB_class"] = np.bytes_("char")
        file["#refs#/a"] = TIME
        file["plain"] = TIME
        file["words"] = ["a", "b"]
    recording = arrays.read_file(path)
    topic = recording.topics[0]
    assert sorted(topic.fields) == ["log.nu[0]", "log.nu[1]", "log.nu[2]", "log.time", "plain"]
    assert topic.fields["log.nu[1]"].tolist() == [5, 6, 7, 8, 9]
    assert "`words`" in recording.notes[0]


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["npz", "npy", "mat", "parquet", "h5"])
def test_arrays_and_tables_compressed_by_gzip(tmp_path, suffix):
    path = write_columns(tmp_path / f"run.{suffix}", {"time": TIME})
    packed = tmp_path / f"{path.name}.gz"
    packed.write_bytes(gzip.compress(path.read_bytes()))
    assert files.read_files(packed).topics[0].fields["time"].tolist() == TIME.tolist()


@pytest.mark.slow
@pytest.mark.parametrize("order", ["<", ">"])
def test_mat_of_version_four(tmp_path, order):
    """A header of five whole numbers, the name, and the columns (MATLAB MAT-File Format, 1999)."""
    path = tmp_path / "run.mat"
    scipy.io.savemat(path, {"time": TIME, "u": 2 * TIME}, format="4")
    if order == ">":
        header = struct.pack(">5i", 1000, 5, 1, 0, 5)
        path.write_bytes(header + b"time\0" + TIME.astype(">f8").tobytes())
    topic = files.read_files(path).topics[0]
    assert topic.fields["time"].tolist() == TIME.tolist()
    assert order == ">" or topic.fields["u"].tolist() == (2 * TIME).tolist()
