"""Files that reach outside themselves, that crash a library, or that unpack without end."""

import gzip
import io
import signal
import subprocess
import sys
import zipfile
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from hydrodamp.errors import LogError
from hydrodamp.ingest.formats import arrays, content, files
from strangers import write_columns
from table_rows import rows

TIME = np.arange(20.0)


@pytest.fixture
def secret(tmp_path):
    path = tmp_path / "secret.txt"
    path.write_bytes(b"root:x:0:0:" * 20)
    return path


@pytest.fixture
def h5py():
    return pytest.importorskip("h5py")


def write_linked_file(secret):
    """Return the path of another file that holds a column."""
    return str(write_columns(secret.with_name("other.h5"), {"u": TIME}))


def external_storage(h5py, file, secret):
    file.create_dataset("u", (20,), "f8", external=[(str(secret), 0, 160)])


def external_link(h5py, file, secret):
    file["u"] = h5py.ExternalLink(write_linked_file(secret), "/u")


def external_link_in_a_group(h5py, file, secret):
    file.create_group("nav")["u"] = h5py.ExternalLink(str(secret), "/u")


def virtual_dataset(h5py, file, secret):
    layout = h5py.VirtualLayout((20,), "f8")
    layout[:] = h5py.VirtualSource(write_linked_file(secret), "u", (20,))
    file.create_virtual_dataset("u", layout)


@pytest.mark.parametrize(
    "put", [external_storage, external_link, external_link_in_a_group, virtual_dataset]
)
def test_hdf5_that_names_other_files_is_refused(tmp_path, h5py, secret, put, refused):
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        file["time"] = TIME
        put(h5py, file, secret)
    refused(LogError, files.read_files, path)


def test_hdf5_with_links_within_itself_is_read(tmp_path, h5py):
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        file["time"], file["u"] = TIME, TIME
        file["same"] = h5py.SoftLink("/u")
    assert files.read_files(path).topics[0].fields["u"].tolist() == TIME.tolist()


def lines(line, start=b"", n=100_000):
    """A table of short lines, packed by gzip."""
    return packed(b"time,u\n".replace(b",", line[1:2]) + start + line * n)


def packed(data):
    return lambda path: path.write_bytes(gzip.compress(data))


def npz(values):
    return lambda path: np.savez_compressed(path, time=np.zeros(len(values), np.int8), u=values)


def hdf5(*arguments, **named):
    def put(path):
        with pytest.importorskip("h5py").File(path, "w") as file:
            file.create_dataset("u", *arguments, compression="gzip", **named)

    return put


def mat(path):
    scipy.io.savemat(path, {"u": BYTES}, do_compression=True)


def parquet(width):
    def put(path):
        arrow, to = (pytest.importorskip(f"pyarrow{tail}") for tail in ("", ".parquet"))
        column = arrow.array(BYTES)
        if width > 1:
            column = arrow.FixedSizeListArray.from_arrays(column, width)
        to.write_table(arrow.table({"u": column}), path, compression="gzip")

    return put


def npy(path):
    stream = io.BytesIO()
    np.save(stream, np.zeros(1 << 20))
    packed(stream.getvalue())(path)


BYTES = np.zeros(1 << 18, np.int8)
POSTINGS = b"%% LOGSTART 1\n" + b"1.0 A p 0\n" * 10_000


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "put"),
    [
        ("a.csv.gz", lines(b"0,0\n")),
        ("comment.csv.gz", lines(b"0,0\n", b"0,0\n# comment\n")),
        ("spaces.csv.gz", lines(b"0 0\n")),
        ("words.csv.gz", lines(b"0,a\n")),
        ("a.npy.gz", npy),  # for a library that seeks
        ("a.npz", npz(BYTES)),
        ("words.npz", npz(np.zeros(40_000, "U1"))),
        ("a.h5", hdf5(data=BYTES)),
        ("vast.h5", hdf5((1 << 40,), "f8", chunks=(1 << 16,))),
        ("a.mat", mat),
        ("a.parquet", parquet(1)),
        ("lists.parquet", parquet(64)),
        *((f"a.{ending}", packed(POSTINGS)) for ending in ("alog", "tlog", "bin", "ulg")),
    ],
)
def test_what_unpacks_out_of_proportion_is_refused(tmp_path, monkeypatch, name, put):
    """Cells count, not their bytes: each takes eight when it is read."""
    put(tmp_path / name)
    monkeypatch.setattr(content, "MAX_UNPACKED_BYTES", 1 << 20)
    monkeypatch.setattr(content, "MAX_UNPACKED_RATIO", 2)
    with pytest.raises(LogError, match="MB unpack to more than"):
        files.read_files(tmp_path / name)


def test_what_unpacks_in_proportion_is_read(tmp_path, monkeypatch):
    monkeypatch.setattr(content, "MAX_UNPACKED_BYTES", 1_600_000)
    lines(b"0,0\n")(tmp_path / "a.csv.gz")
    assert files.read_files(tmp_path / "a.csv.gz").topics[0].n == 100_000
    monkeypatch.setattr(content, "MAX_UNPACKED_BYTES", 1 << 10)
    (tmp_path / "a.alog").write_bytes(POSTINGS)
    assert content.read_bytes(tmp_path / "a.alog") == POSTINGS


@pytest.mark.slow
@pytest.mark.parametrize("line", [b"0,0\n", b"0 0\n", b"0\t0\n", b"0,a\n"])
def test_little_memory_is_an_error(tmp_path, line):
    pytest.importorskip("resource")
    pytest.importorskip("pyarrow")
    if not Path("/proc/self/statm").exists():
        pytest.skip("the size of this process is not known")
    path = tmp_path / "a.csv"
    path.write_bytes(b"time,u\n".replace(b",", line[1:2]) + line * 2_000_000)
    code = f"""
import pyarrow.csv
from hydrodamp.ingest.formats import arrays, content, delimited, files
arrays._limit_memory(content._FREE_BYTES + (16 << 20))
files.read_files({str(path)!r})
"""
    command, done = [sys.executable, "-c", code], None
    for _ in range(3):  # a thread of Arrow that finds no memory waits for ever, or aborts: rare
        with suppress(subprocess.TimeoutExpired):
            done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
            if done.returncode != -signal.SIGABRT:
                break
    assert done.returncode == 1, done.stderr
    assert "needs more memory than is free" in done.stderr


@pytest.mark.parametrize(("depth", "is_read"), [(31, True), (32, False), (2000, False)])
def test_nested_groups_are_bounded(tmp_path, h5py, depth, is_read, refused):
    path = tmp_path / "deep.h5"
    with h5py.File(path, "w") as file:
        group = file
        for _ in range(depth):
            group = group.create_group("g")
        group["time"] = TIME
    if is_read:
        assert files.read_files(path).topics[0].n == 20
        return
    refused(LogError, files.read_files, path)


@pytest.mark.slow
def test_many_spaces_are_read_alike_in_blocks(tmp_path):
    pytest.importorskip("pyarrow")
    rng = np.random.default_rng(3)
    gaps = rng.choice([" ", "  ", "\t ", "     "], (60_000, 3))
    values = rng.integers(0, 10**6, (60_000, 2))
    rows = (f"{a}{x}{b}{y}{c}" for (a, b, c), (x, y) in zip(gaps, values.tolist(), strict=True))
    path = tmp_path / "a.dat"
    path.write_text("time u\n" + "\r\n".join(rows), newline="")
    topic = files.read_files(path).topics[0]
    np.testing.assert_array_equal(np.column_stack([*topic.fields.values()]), values)


@pytest.mark.parametrize("delimiter", [",", ";", "\t", " "])
def test_a_table_of_very_many_columns_is_refused(tmp_path, delimiter, refused):
    path = tmp_path / "wide.csv"
    n = content.MAX_COLUMNS + 1
    rows = (delimiter.join(f"{cell}{k}" for k in range(n)) for cell in ("c", "1", "2"))
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    refused(LogError, files.read_files, path)


@pytest.mark.parametrize(
    "crash", ["import os; os.abort()", "import sys; sys.exit('ValueError: odd')"]
)
def test_a_file_that_crashes_its_reader_costs_itself(tmp_path, monkeypatch, crash, refused):
    path = tmp_path / "log.mat"
    scipy.io.savemat(path, {"time": TIME, "u": TIME})
    monkeypatch.setattr(arrays, "_CHILD_CODE", f"{crash} # {{path}} {{module}} {{bound}}")
    refused(LogError, files.read_files, path)


@pytest.mark.slow
def test_a_mat_file_that_unpacks_without_end_is_refused(tmp_path):
    pytest.importorskip("resource")
    path = tmp_path / "log.mat"
    scipy.io.savemat(path, {"time": np.zeros(1 << 20)}, do_compression=True)
    columns = dict(arrays._read_matlab(path, []))
    assert columns["time"].size == 1 << 20
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(content, "MAX_UNPACKED_BYTES", 1 << 18)
        with pytest.raises(LogError, match="MB unpack to more than"):
            files.read_files(path)


@pytest.mark.slow
def test_no_file_of_the_working_folder_is_imported_for_a_mat_file(tmp_path, monkeypatch):
    scipy.io.savemat(tmp_path / "log.mat", {"time": TIME, "u": TIME})
    (tmp_path / "numpy.py").write_text("raise SystemExit('imported')", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert files.read_files("log.mat").topics[0].n == 20


@rows("module, name, begin")
@pytest.mark.parametrize("error", [IndexError("out of range"), KeyError("u")])
def test_whatever_a_reader_raises_names_the_file(
    tmp_path, monkeypatch, module, name, begin, error, refused
):
    def fail(_):
        raise error

    path = tmp_path / name
    path.write_bytes(begin.encode("latin-1"))
    monkeypatch.setattr(f"hydrodamp.ingest.formats.{module}.read_file", fail)
    refused(LogError, files.read_files, path)


def test_an_archive_of_other_things_than_arrays_is_named(tmp_path):
    path = tmp_path / "a.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("u.npy", b"\x93NUMPY\x01\x00\xff\xff")
    with pytest.raises(LogError, match=r"a\.npz: the file is truncated or damaged"):
        files.read_files(path)
