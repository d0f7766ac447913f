from collections.abc import Callable
from pathlib import Path

import pytest

from hydrodamp.errors import FileError, LogError
from hydrodamp.ingest.mapping import LogMapping
from hydrodamp.ingest.read import read_log, read_logs, read_recording

Write = Callable[..., Path]
GOOD = "time,u\n0,1\n1,2\n"


def test_a_mapping_may_be_a_value_or_a_file(csv_file):
    path = csv_file("t,s\n0,1\n1,2\n")
    text = "time: t\nvelocity: {u: s}\n"
    for mapping in (
        LogMapping.from_dict({"time": "t", "velocity": {"u": "s"}}),
        csv_file(text, "map.yaml"),
        str(csv_file(text, "map.yaml")),
    ):
        assert read_log(path, mapping).velocity[:, 0].tolist() == [1, 2]
        assert read_logs([path, path], mapping).n == 4


def test_a_mapping_of_steps_alone_serves_the_canonical_form(csv_file):
    path = csv_file("time,u,r\n" + "".join(f"{k / 10},{k // 5},{k}\n" for k in range(50)))
    log = read_log(path, csv_file("steps: [interpolate_sample_and_hold]\n", "steps.yaml"))
    assert log.velocity[7, 0] == pytest.approx(1.4)
    assert log.notes[-1].startswith("held: ")


def test_several_files_are_one_log(csv_file):
    log = read_logs([csv_file(GOOD, "a.csv"), csv_file(GOOD, "b.csv")])
    assert [segment.name for segment in log.segments] == ["a", "b"]
    assert read_logs(csv_file(GOOD, "a.CSV")).n == 2


def test_the_faults_of_every_file_are_told(csv_file, refused):
    bad = csv_file("time,u\n0,x\n1,2\n", "bad.csv")
    worse = csv_file("u,uv\n0,1\n1,2\n", "worse.csv")
    refused(LogError, read_logs, [bad, csv_file(GOOD), worse])
    refused(LogError, read_logs, [bad, csv_file(GOOD)])


def test_runs_of_one_file_name_are_named_by_their_folder(tmp_path):
    paths = [tmp_path / run / "log.csv" for run in ("monday", "tuesday")]
    for path in paths:
        path.parent.mkdir()
        path.write_text(GOOD)
    assert [segment.name for segment in read_logs(paths).segments] == ["monday", "tuesday"]


def test_nested_folders_are_named(tmp_path, refused):
    for topic, columns in {"imu": "time,r\n0,1\n1,2\n", "dvl": GOOD}.items():
        (tmp_path / topic).mkdir()
        (tmp_path / topic / "data.csv").write_text(columns)
    refused(FileError, read_recording, tmp_path)
    both = read_recording([tmp_path / topic / "data.csv" for topic in ("imu", "dvl")])
    assert [topic.name for topic in both.topics] == ["imu", "dvl"]
    (tmp_path / "top.csv").write_text(GOOD)
    assert f"logs in {tmp_path / 'dvl'}, {tmp_path / 'imu'}" in read_recording(tmp_path).notes[-1]


def test_a_wild_row_is_named_by_its_column(csv_file, refused):
    path = csv_file("t,speed\n0,1\n1,2e3\n2,1\n")
    mapping = LogMapping.from_dict({"time": "t", "velocity": {"u": "speed"}})
    refused(LogError, read_log, path, mapping)
