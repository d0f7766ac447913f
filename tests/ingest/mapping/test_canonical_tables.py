"""Canonical names need no mapping in any flat format."""

import numpy as np
import pytest

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.read import canonical_record, read_log, read_recording
from strangers import write_columns
from table_rows import rows

TIME = np.arange(0, 5, 0.1)
COLUMNS = {
    "time": TIME,
    "roll": 0 * TIME,
    "pitch": 0 * TIME,
    "yaw": 0.1 * np.sin(TIME),
    "u": 1 + 0 * TIME,
    "r": 0.1 * np.cos(TIME),
    "rudder": np.sign(np.sin(TIME)),
}


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".csv", ".tsv", ".parquet", ".npz", ".mat"])
def test_canonical_names_need_no_mapping(tmp_path, suffix):
    log = read_log(write_columns(tmp_path / f"dive{suffix}", COLUMNS))
    assert log.time.tolist() == TIME.tolist()
    assert log.velocity_names == ("u", "r")
    assert log.velocity[:, 5].tolist() == COLUMNS["r"].tolist()
    assert log.command_names == ("rudder",)
    assert [segment.name for segment in log.segments] == ["dive"]


def test_topics_need_a_mapping(tmp_path, refused):
    topics = tuple(Topic(f"/t{k}", [0.0, 1.0], {"u": [1.0, 1.0]}) for k in range(10))
    refused(LogError, lambda: canonical_record(Recording(topics, "dive.bag", "a test")))
    table = Topic("", [0.0, 1.0], {"u": [1.0, 1.0], "segment": [1.0, 2.0]})
    record = canonical_record(Recording((table,), "dive.npz", "a test", ("one note",)))
    assert record.labels == ("1", "2")
    assert record.notes == ("one note",)
    words = Topic("", None, {"time": [0.0, 1.0], "u": [1.0, 1.0]}, {"mode": ("a", "b")})
    refused(LogError, lambda: canonical_record(Recording((words,), "dive.mat", "a test")))


@pytest.mark.parametrize(
    ("clock", "tick", "speed", "factor"),
    [
        ("ms", 1e-3, "km/h", 1 / 3.6),
        ("msec", 1e-3, "kts", 1852 / 3600),
        ("usec", 1e-6, "KM/H", 1 / 3.6),
        ("µs", 1e-6, "CM/S", 0.01),
    ],
)
@rows("line")
def test_units_in_the_header_are_turned_into_si(csv_file, clock, tick, speed, factor, line):
    rows = f"0,1,90,1,0,0,200,5\n{round(0.5 / tick)},2,0,1,0,0,300,6\n"
    record = canonical_record(read_recording(csv_file(line.format(clock, speed) + rows)))
    np.testing.assert_allclose(record.time, [0.0, 0.5])
    np.testing.assert_allclose(record.blocks["velocity"][:, 0], [factor, 2 * factor])
    np.testing.assert_allclose(record.blocks["velocity"][:, 5], [np.pi / 2, 0.0])
    assert record.blocks["position"][:, 2].tolist() == [2.0, 3.0]
    assert record.blocks["commands"].tolist() == [[5.0], [6.0]]  # commands may be anything


def test_units_in_the_header_that_do_not_fit_are_all_told(csv_file, refused):
    refused(
        LogError, lambda: read_log(csv_file("time [s],u [deg],v [furlong]\n0,3.6,9\n1,7.2,0\n"))
    )


def test_two_whole_runs_are_sent_to_read_logs(tmp_path):
    runs = [write_columns(tmp_path / f"run{number}.csv", COLUMNS) for number in (1, 2)]
    with pytest.raises(LogError) as caught:
        read_log(runs)
    (fault,) = caught.value.faults
    assert fault.startswith("each of run1, run2 is a complete log in the canonical form")
    assert "`read_logs`" in fault
