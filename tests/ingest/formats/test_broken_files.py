"""A corpus of broken and odd files: each is refused in words, or read with a note.

A row of the table holds a name; the files, or what makes them; the damage; what becomes of it; and
what is said. ``refused`` raises a message that names the file; ``noted`` reads and tells in the
notes; ``spoilt`` reads, and who asks for the field is told.
"""

import gzip
import json
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from hydrodamp.errors import FileError, LogError
from hydrodamp.ingest.formats import files
from strangers import write_columns

TABLE = "time,u,r\n0.0,1.5,0.1\n0.1,1.6,0.2\n0.2,1.7,0.3\n0.3,1.8,0.4\n"
MOOS = "%% LOGSTART 1000.5\n0.1 NAV_X pNav 1.5\n0.2 NAV_X pNav 1.6\n"


def write_files(folder, contents):
    """Write columns, or text of one byte a character; return the file, or the folder of several."""
    for name, content in contents.items():
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        if isinstance(content, dict):
            write_columns(path, content)
        else:
            content = content.replace("{TABLE}", TABLE).replace("{MOOS}", MOOS)
            path.write_bytes(content.encode("latin-1"))
    return path if path.parent == folder else path.parent


def find_storage(path):
    """Return the storage file of a bag's folder, or the file itself."""
    return next(iter([*path.glob("*.mcap"), *path.glob("*.db3")])) if path.is_dir() else path


def write_twists(it, kind="MCAP"):
    return it.bag.ros2(it.folder / "dive", it.bag.twists(40), kind)


def two_types(it):
    joints = it.bag.joints(105.0, [0.1], ["fin"])
    joints = ("/dvl", "sensor_msgs/msg/JointState", 105.0, joints)
    return it.bag.ros2(it.folder / "dive", [*it.bag.twists(3), joints])


def markers(it):
    kind = "visualization_msgs/msg/MarkerArray"
    message = it.bag.modern.types[kind](markers=[])
    return it.bag.ros2(it.folder / "dive", [("/eye", kind, 1.0, message)])


def no_metadata(it):
    path = write_twists(it, "SQLITE3")
    (path / "metadata.yaml").unlink()
    return path


def broken_metadata(it):
    path = write_twists(it)
    (path / "metadata.yaml").write_text("rosbag2_bagfile_information: [\n")
    return path


def lost_storage(it):
    path = write_twists(it)
    find_storage(path).unlink()
    return path


def hdf5(it):
    h5py = pytest.importorskip("h5py")
    with h5py.File(it.folder / "run.mat", "w", userblock_size=512) as file:
        file["u"] = np.ones(5000)
    return it.folder / "run.mat"


def long_cell(it, rows=1):
    return write_files(it.folder, {"a.csv": "t,u\n" + "0,1\n" * rows + '1,"' + "x" * 140_000})


def write_ulog(it, **options):
    return it.write_ulog(it.folder / "dive.ulg", **options)


def columns(it, name, **values):
    return write_columns(it.folder / name, values)


MAKERS = {
    "noise": lambda it: write_files(
        it.folder, {"a.csv": np.random.default_rng(1).bytes(5000).decode("latin-1")}
    ),
    "utf16": lambda it: write_files(it.folder, {"a.csv": TABLE.encode("utf-16").decode("latin-1")}),
    "long_cell": long_cell,
    "late_long_cell": lambda it: long_cell(it, 70_000),
    "ros1": lambda it: it.bag.ros1(it.folder / "dive.bag", it.bag.twists(40, old=True)),
    "mcap": write_twists,
    "sqlite": lambda it: write_twists(it, "SQLITE3"),
    "empty_bag": lambda it: it.bag.ros2(it.folder / "dive", []),
    "two_types": two_types,
    "markers": markers,
    "no_metadata": no_metadata,
    "broken_metadata": broken_metadata,
    "lost_storage": lost_storage,
    "dataflash": lambda it: it.dive.save(it.folder / "dive.bin"),
    "ulog": write_ulog,
    "long_ulog": lambda it: write_ulog(it, n=50),
    "dropout": lambda it: write_ulog(it, dropout=True),
    "parquet": lambda it: columns(it, "run.parquet", time=np.arange(99.0), u=np.ones(99)),
    "matrix": lambda it: columns(it, "run.mat", time=np.arange(4.0), u=np.ones((4, 300))),
    "hdf5": hdf5,
}


def spoil(content, damage):
    """Return bytes cut after a share, with zeros from a share on, packed, or with another byte."""
    kind, *numbers = damage.split()
    if kind == "gzip":
        return gzip.compress(content)
    first, *rest = map(float, numbers)
    offset = int(first if kind == "byte" else len(content) * first)
    if kind == "cut":
        return content[:offset]
    put = bytes([int(*rest)]) if kind == "byte" else bytes(int(*rest))
    return content[:offset] + put + content[offset + len(put) :]


CORPUS = json.loads(Path(__file__).with_suffix(".json").read_text("utf-8"))
CASES = [pytest.param(True, *row, id=name) for name, *row in CORPUS]
CASES += [
    pytest.param(False, source, *row, id=f"{name}-without-arrow")
    for name, source, *row in CORPUS
    if isinstance(source, dict) or source in ("noise", "utf16", "long_cell", "late_long_cell")
]


@pytest.mark.slow
@pytest.mark.parametrize(("arrow", "source", "damages", "becomes", "says"), CASES)
def test_corpus(
    tmp_path, bag, dive, write_ulog, monkeypatch, arrow, source, damages, becomes, says
):
    if not arrow:
        monkeypatch.setitem(sys.modules, "pyarrow.csv", None)
    if isinstance(source, dict):
        path = write_files(tmp_path, source)
    else:
        tools = SimpleNamespace(folder=tmp_path, bag=bag, dive=dive, write_ulog=write_ulog)
        path = MAKERS[source](tools)
    for damage in damages:
        whole = find_storage(path)
        path = whole.with_name(whole.name + ".gz") if damage == "gzip" else whole
        path.write_bytes(spoil(whole.read_bytes(), damage))
    if becomes == "refused":
        with pytest.raises((LogError, FileError), match=says) as caught:
            files.read_files(path)
        assert path.name in str(caught.value)
        return
    recording = files.read_files(path)
    assert recording.topics
    if becomes == "noted":
        assert any(re.search(says, note) for note in recording.notes), recording.notes
    if becomes == "spoilt":
        faults = {name: fault for topic in recording.topics for name, fault in topic.faults.items()}
        assert any(re.search(says, f"{name}: {fault}") for name, fault in faults.items()), faults
    for topic in recording.topics:
        assert not set(topic.faults) & set(topic.fields)
        for fault in topic.faults.values():
            assert re.search("must hold numbers|keep one|values but", fault)
