"""A corpus of broken and odd files: each is refused in words, or read with a note.

One line of the table a file. ``refused`` raises a message that names the file;
``noted`` reads and tells in the notes; ``spoilt`` reads, and who asks for the field is told.
"""

import gzip
import json
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hydrodamp.errors import FileError, LogError
from hydrodamp.ingest.formats import files

TABLE = "time,u,r\n0.0,1.5,0.1\n0.1,1.6,0.2\n0.2,1.7,0.3\n0.3,1.8,0.4\n"
Make = Callable[[Path, Any, Any, Any], Path]


def text(name, content, encoding="utf-8"):
    return raw(name, content.encode(encoding))


def raw(name, content):
    def make(folder, *_):
        (folder / name).write_bytes(content)
        return folder / name

    return make


def changed(make, change, ending=""):
    """Change the bytes of a file."""

    def make_folder(folder, *tools):
        path = keep(make(folder, *tools))
        renamed = path.with_name(path.name + ending)
        renamed.write_bytes(change(path.read_bytes()))
        return renamed

    return make_folder


def truncate(make, share):
    """Keep the first part of a file."""
    return changed(make, lambda content: content[: int(len(content) * share)])


def overwritten(make, start, length=64):
    """Put zero bytes over part of a file."""

    def overwrite(content):
        offset = int(len(content) * start)
        return content[:offset] + bytes(length) + content[offset + length :]

    return changed(make, overwrite)


def packed(make):
    """Compress a file by gzip."""
    return changed(make, gzip.compress, ".gz")


def keep(path):
    """The storage file of a bag's folder, or the file itself."""
    return next(iter([*path.glob("*.mcap"), *path.glob("*.db3")])) if path.is_dir() else path


def ros2(kind="MCAP", messages=lambda bag: bag.twists(40)):
    return lambda folder, bag, *_: bag.ros2(folder / "dive", messages(bag), kind)


def ros1(folder, bag, *_):
    return bag.ros1(folder / "dive.bag", bag.twists(40, old=True))


def two_types(bag):
    joints = ("/dvl", "sensor_msgs/msg/JointState", 105.0, bag.joints(105.0, [0.1], ["fin"]))
    return [*bag.twists(3), joints]


def only_markers(bag):
    kind = "visualization_msgs/msg/MarkerArray"
    return [("/eye", kind, 1.0, bag.modern.types[kind](markers=[]))]


def no_metadata(folder, bag, *_):
    path = ros2("SQLITE3")(folder, bag)
    (path / "metadata.yaml").unlink()
    return path


def broken_metadata(folder, bag, *_):
    path = ros2()(folder, bag)
    (path / "metadata.yaml").write_text("rosbag2_bagfile_information: [\n")
    return path


def lost_storage(folder, bag, *_):
    path = ros2()(folder, bag)
    keep(path).unlink()
    return path


def dataflash(folder, _, dive, *__):
    return dive.save(folder / "dive.bin")


def ulog(**options):
    return lambda folder, _, __, write: write(folder / "dive.ulg", **options)


def unknown_kind(content):
    """Give the second message of a ULog a kind that there is not."""
    return content[:61] + b"?" + content[62:]


def parquet(folder, *_):
    arrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    path = folder / "run.parquet"
    parquet.write_table(arrow.table({"time": np.arange(99.0), "u": np.ones(99)}), path)
    return path


def npz(**arrays):
    def make(folder, *_):
        np.savez(folder / "run.npz", **arrays)
        return folder / "run.npz"

    return make


def mat(**arrays):
    def make(folder, *_):
        scipy = pytest.importorskip("scipy.io")
        scipy.savemat(folder / "run.mat", arrays)
        return folder / "run.mat"

    return make


def hdf5(folder, *_):
    h5py = pytest.importorskip("h5py")
    with h5py.File(folder / "run.mat", "w", userblock_size=512) as file:
        file["u"] = np.ones(5000)
    return folder / "run.mat"


def folder_of(**contents):
    def make(folder, *_):
        inside = folder / "dive"
        inside.mkdir()
        for name, content in contents.items():
            (inside / name.replace("__", ".")).write_text(content)
        return inside

    return make


refused, noted, spoilt = "refused", "noted", "spoilt"
MOOS = "%% LOGSTART 1000.5\n0.1 NAV_X pNav 1.5\n0.2 NAV_X pNav 1.6\n"
LONG = "t,u\n" + "0,1\n" * 70_000 + '1,"' + "x" * 140_000
FOUR = np.arange(4.0)

CORPUS = [
    # name, what it is, what becomes of it, what is said
    ("zeros", raw("a.csv", bytes(4096)), refused, "only zero bytes or blanks"),
    (
        "noise",
        raw("a.csv", np.random.default_rng(1).bytes(5000)),
        refused,
        "signature of text in columns",
    ),
    ("noise-bin", raw("a.bin", b"\x07\x01\x00\x02" * 99), refused, "signature of ArduPilot log"),
    (
        "noise-name",
        raw("a.xyz", b"\x07\x01\x00\x02" * 99),
        refused,
        "begins with .* Supported are: ",
    ),
    ("pickle", raw("a.pkl", b"\x80\x04\x95" + bytes(99)), refused, "a pickle"),
    ("telemetry", raw("a.tlog", b"\x00\x01\xfe\x03" * 9), refused, "signature of MAVLink log"),
    ("lsts", raw("Data.lsf", b"\x54\xfe\x00\x01" * 9), refused, "no maintained reader exists"),
    ("western-late", text("a.csv", TABLE * 1 + "0.4,é,1\n", "cp1252"), spoilt, "u: .*'é' in row 5"),
    ("gz-cut", raw("a.csv.gz", gzip.compress(TABLE.encode() * 99)[:60]), refused, "gzip -dc"),
    ("gz-noise", raw("a.csv.gz", b"\x1f\x8b\x08\x00" + bytes(range(60))), refused, "gzip"),
    ("utf16-cut", raw("a.csv", TABLE.encode("utf-16")[:-3]), spoilt, r"r: .*row 4 \(line 5\)"),
    ("bag1-cut", truncate(ros1, 0.6), noted, "messages before the cut"),
    ("bag1-head", truncate(ros1, 0.02), refused, "rosbag reindex"),
    ("bag1-zeroed", overwritten(ros1, 0.5, 400), noted, "damaged after message 5"),
    ("bag1-packed", packed(ros1), refused, "Unpack it with `gunzip FILE`"),
    ("mcap-packed", packed(ros2()), refused, "Unpack it with `gunzip FILE`"),
    ("mcap-half", truncate(ros2(), 0.7), noted, "messages before the cut"),
    ("mcap-magic", raw("a.mcap", b"\x89MCAP0\r\n"), refused, "mcap recover"),
    ("mcap-zeroed", overwritten(ros2(), 0.3), refused, "mcap recover"),
    ("db3-cut", truncate(ros2("SQLITE3"), 0.5), refused, "recover"),
    ("bag-no-metadata", no_metadata, "read", ""),
    ("bag-bad-metadata", broken_metadata, noted, "cut off or damaged; the whole messages"),
    ("bag-lost-storage", lost_storage, refused, "database files are missing"),
    ("bag-empty", ros2(messages=lambda _: []), refused, "no readable message"),
    ("bag-markers", ros2(messages=only_markers), refused, r"`/eye` \(.*/MarkerArray\) is no"),
    ("bag-two-types", ros2(messages=two_types), "read", ""),
    ("bin-cut", truncate(dataflash, 0.9), noted, r"truncated: its last \d+ bytes"),
    ("bin-zeroed", overwritten(dataflash, 0.8), noted, "bytes belong to no message, the first at"),
    ("bin-head", raw("a.bin", b"\xa3\x95\x01\x02"), refused, "0xA3 0x95 0x80"),
    ("ulg-cut", truncate(ulog(n=50), 0.7), noted, r"truncated or damaged at byte \d+ of \d+"),
    ("ulg-head", truncate(ulog(), 0.01), refused, "truncated or damaged|signature"),
    ("ulg-definitions", changed(ulog(), unknown_kind), refused, "at byte 59, in the defin"),
    ("ulg-dropout", ulog(dropout=True), noted, "dropped messages 1 times, 0.25 s in all"),
    ("ulg-long", ulog(), noted, "array `values` has more than"),
    ("parquet-cut", truncate(parquet, 0.8), refused, "truncated or damaged"),
    ("parquet-pages", overwritten(parquet, 0.01, 400), refused, "truncated or damaged"),
    ("parquet-zeroed", overwritten(parquet, 0.9, 200), refused, "truncated or damaged"),
    ("npz-cut", truncate(npz(time=FOUR, u=FOUR), 0.6), refused, "truncated or damaged"),
    ("npz-lengths", npz(time=FOUR, u=np.ones(3)), spoilt, "u: `u` has 3 values but `time` has 4"),
    ("npz-objects", npz(time=FOUR, log=np.array([{}, 1], object)), noted, "never loaded"),
    ("npz-scalars", npz(mass=np.array(12.0)), refused, "one value per sample"),
    ("npz-empty", npz(), refused, "one value per sample; found nothing"),
    (
        "mat-cut",
        truncate(mat(time=FOUR, u=np.ones((4, 300))), 0.3),
        refused,
        "truncated or damaged",
    ),
    ("mat-lengths", mat(time=FOUR, u=np.ones(3)), spoilt, "u: `u` has 3 values but `time` has 4"),
    ("mat73-cut", truncate(hdf5, 0.5), refused, "truncated or damaged"),
    ("long-cell", text("a.csv", 't,u\n0,1\n1,"' + "x" * 140_000), refused, "larger than"),
    ("long-cell-late", text("a.csv", LONG), refused, "line 70002: .*quotation mark"),
    ("bin-empty", truncate(dataflash, 0.05), refused, "no message with a value"),
    ("ulg-empty", raw("a.ulg", b"ULog\x01\x12\x35\x01" + bytes(8)), refused, "no message with"),
    ("folder-one", folder_of(a__csv="t,u\n0,1\n", b__csv="t,u\n1\n"), noted, r"b\.csv: line 2"),
    ("folder-empty", folder_of(readme__md="x"), refused, "the folder holds no log"),
    ("folder-mixed", folder_of(a__csv=TABLE, b__tsv=TABLE), refused, "logs of several formats"),
    ("folder-bad", folder_of(a__csv="t,u\n1\n", b__csv="t,u\n1\n"), refused, "2 faults"),
    (
        "folder-same",
        folder_of(a__alog=MOOS, b__alog=MOOS),
        refused,
        "2 files hold a topic `NAV_X`.*`read_logs`",
    ),
]


LISTED = json.loads(Path(__file__).with_suffix(".json").read_text("utf-8"))
CORPUS += [
    (name, text(file, content.replace("{TABLE}", TABLE).replace("{MOOS}", MOOS)), becomes, says)
    for name, file, content, becomes, says in LISTED
]
CASES = [pytest.param(True, *case[1:], id=case[0]) for case in CORPUS]
CASES += [
    pytest.param(False, *case[1:], id=f"{case[0]}-without-arrow")
    for case in CORPUS
    if case[1].__qualname__.startswith("raw.")
]


@pytest.mark.slow
@pytest.mark.parametrize(("arrow", "make", "becomes", "says"), CASES)
def test_corpus(tmp_path, bag, dive, write_ulog, monkeypatch, arrow, make, becomes, says):
    if not arrow:
        monkeypatch.setitem(sys.modules, "pyarrow.csv", None)
    path = make(tmp_path, bag, dive, write_ulog)
    if becomes == refused:
        with pytest.raises((LogError, FileError), match=says) as caught:
            files.read_files(path)
        assert path.name in str(caught.value)
        return
    recording = files.read_files(path)
    assert recording.topics
    if becomes == noted:
        assert any(re.search(says, note) for note in recording.notes), recording.notes
    if becomes == spoilt:
        faults = {name: fault for topic in recording.topics for name, fault in topic.faults.items()}
        assert any(re.search(says, f"{name}: {fault}") for name, fault in faults.items()), faults
    for topic in recording.topics:
        assert not set(topic.faults) & set(topic.fields)
        for fault in topic.faults.values():
            assert re.search("must hold numbers|keep one|values but", fault)
