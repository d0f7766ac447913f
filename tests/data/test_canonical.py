import sys
import tempfile
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from hydrodamp.data.canonical import write_log
from hydrodamp.data.channels import BLOCKS, RESERVED
from hydrodamp.data.concatenation import concatenate
from hydrodamp.data.log import Log, Segment
from hydrodamp.errors import FileError, LogError
from hydrodamp.ingest.mapping import LogMapping
from hydrodamp.ingest.read import read_log
from table_rows import rows


def assert_same(one, other):
    """Every number equal to the bit, every name equal."""
    for name in (*(block.name for block in BLOCKS), "commands"):
        mine, its = getattr(one, name), getattr(other, name)
        assert (mine is None) == (its is None), name
        if mine is not None:
            np.testing.assert_array_equal(mine, its, err_msg=name)
    assert one.segments == other.segments
    assert one.velocity_names == other.velocity_names
    assert one.command_names == other.command_names


def test_the_reserved_names_are_those_of_the_design():
    design = "time roll pitch yaw qw qx qy qz u v w p q r du dv dw dp dq dr eta segment X Y Z K M N"
    assert {*RESERVED} == {*design.split(), *["north", "east", "down", "fx", "fy", "fz"]}


@pytest.mark.parametrize("recorded", [6, 3])
@pytest.mark.parametrize("name", ["swim.csv", "swim.parquet"])
def test_a_written_log_is_read_to_the_bit(swim, tmp_path, recorded, name):
    if name.endswith(".parquet"):
        pytest.importorskip("pyarrow")
    rng, n = np.random.default_rng(4), swim.n
    log = replace(
        swim,
        acceleration=np.where(np.arange(6) < recorded, rng.normal(size=(n, 6)), np.nan),
        propulsion_ratio=rng.normal(size=n),
        wrench=rng.normal(size=(n, 6)),
        position=rng.normal(size=(n, 3)),
        specific_force=rng.normal(size=(n, 3)),
    )
    log = concatenate([log, log])
    write_log(log, tmp_path / name)
    assert_same(read_log(tmp_path / name), log)


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(
    arrays(np.float64, (6, 20), elements=st.floats(-1e6, 1e6)),
    st.lists(
        st.text(st.characters(exclude_categories=["Cc", "Cs"])).map(str.strip).filter(bool),
        min_size=2,
        max_size=2,
        unique=True,
    ),
)
def test_any_numbers_and_names_come_back(block, names):
    log = Log(
        time=[0.0, 0.1, 0.3, 0.0, 1 / 3, 0.7],
        velocity=block[:, :6] / 2e4,  # at most 50
        wrench=block[:, 6:12],
        acceleration=block[:, 12:18],
        propulsion_ratio=block[:, 18],
        command_names=("fin",),
        commands=block[:, 19:],
        segments=(Segment(names[0], 0, 3), Segment(names[1], 3, 6)),
    )
    with tempfile.TemporaryDirectory() as folder:
        write_log(log, Path(folder) / "log.csv")
        again = read_log(Path(folder) / "log.csv")
    assert_same(again, log)


@pytest.mark.parametrize("clean", [True, False], ids=["fast", "careful"])
@rows("cells, names")
def test_segments_are_called_as_they_are_written(csv_file, cells, names, clean):
    rows = "".join(f"{k},1,{cells[k // 3]}\n" for k in range(6))
    log = read_log(csv_file(f"time,u,segment\n{rows}{'' if clean else '# the end'}"))
    assert [part.name for part in log.segments] == names


def test_a_segment_of_numbers_may_be_asked_for_by_a_mapping(csv_file):
    path = csv_file("time,u,segment\n0,1,1\n1,2,1\n2,3,2\n3,4,2\n")
    only = {"column": "u", "where": {"segment": 2}}
    asked = LogMapping.from_dict({"time": "time", "velocity": {"u": only}})
    assert read_log(path, asked).velocity[:, 0].tolist() == [3, 4]


@rows("text")
def test_what_cannot_be_read_says_why(csv_file, text, refused):
    refused(LogError, lambda: read_log(csv_file(text)))


def test_all_faults_of_a_file_are_told_at_once(csv_file, refused):
    text = "time,u,v,uv,roll,pitch\n0,1,x,1,0,0\n2,1,1,1,0,0\n1,1,inf,1,0,0\n"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        refused(LogError, lambda: read_log(csv_file(text)))
    text = text.replace("x", "1").replace(",roll,pitch", ",a,b")
    refused(LogError, lambda: read_log(csv_file(text)))


@pytest.mark.parametrize(
    "angles",
    [
        np.column_stack((np.zeros(100), np.linspace(-20, 20, 100), np.zeros(100))),
        np.column_stack((np.zeros((100, 2)), np.arange(0, 1000, 10) % 360)),
    ],
    ids=["pitch", "wrap"],
)
def test_attitude_in_degrees_is_refused(csv_file, angles, refused):
    rows = "".join(f"{k},1,{a[0]},{a[1]},{a[2]}\n" for k, a in enumerate(angles))
    refused(LogError, lambda: read_log(csv_file("time,u,roll,pitch,yaw\n" + rows)))


def test_parquet_without_pyarrow_says_how_to_get_it(swim, tmp_path, monkeypatch, refused):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    refused(FileError, lambda: write_log(swim, tmp_path / "log.parquet"))


@pytest.mark.parametrize("name", ["log.npz", "log.csv.gz", "log.MAT"])
def test_a_log_is_not_written_under_the_name_of_another_format(swim, tmp_path, name, refused):
    refused(FileError, lambda: write_log(swim, tmp_path / name))
    assert not [*tmp_path.iterdir()]
