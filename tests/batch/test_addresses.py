"""Which logs an address matches, the vehicle and the group of each, and the order of groups."""

from __future__ import annotations

import os

import pytest

from hydrodamp.batch.discovery import ResolvedMapping, digest_files, expand_addresses
from hydrodamp.batch.groups import assign_group, assign_vehicle, group_order, sort_groups
from hydrodamp.errors import FileError, MethodError

FILES = """\
files: {pose: "*_pose.csv", cmd: "*_cmd.csv"}
time: t
velocity: {u: pose.u}
commands: {rpm: cmd.rpm}
"""


@pytest.fixture
def logs(tmp_path, monkeypatch):
    """A folder `logs` with logs on three levels, which is the working directory's."""
    monkeypatch.chdir(tmp_path)
    for name in ("a.csv", "deep/b.csv", "deep/er/c.parquet", "deep/note.md"):
        path = tmp_path / "logs" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("x", "utf-8")
    return tmp_path / "logs"


def names(*addresses, **options):
    return [path.replace(os.sep, "/") for path in expand_addresses(addresses, **options)]


def test_two_stars_match_on_all_levels(logs):
    assert names("logs/**.csv") == names("logs/**/*.csv") == ["logs/a.csv", "logs/deep/b.csv"]
    memory = pytest.importorskip("fsspec").filesystem("memory")
    memory.put(str(logs), "/fleet", recursive=True)
    found = names("memory://fleet/**.csv")
    paths = [path.removeprefix("memory://") for path in found]
    assert paths == ["/fleet/a.csv", "/fleet/deep/b.csv"]


def test_a_log_at_two_addresses_is_listed_once_and_links_are_followed(logs):
    (logs.parent / "link").symlink_to(logs, target_is_directory=True)
    (logs / "loop").symlink_to(logs, target_is_directory=True)
    assert names("link") == ["link/a.csv", "link/deep/b.csv", "link/deep/er/c.parquet"]
    assert names("logs/a.csv", "./logs/a.csv", "link/a.csv", str(logs / "a.csv")) == ["logs/a.csv"]


def test_results_in_the_folder_of_logs_are_no_logs(logs, refused):
    (logs / "season").mkdir()
    (logs / "season" / "coefficients.csv").write_text("x", "utf-8")
    assert "logs/season/coefficients.csv" in names("logs")
    assert "logs/season/coefficients.csv" not in names("logs", exclude="logs/season")
    refused(FileError, names, "logs/season", exclude="logs/season")


def test_files_of_one_recording_are_one_log(tmp_path, refused):
    for run in ("1", "2"):
        for part in ("pose", "cmd"):
            (tmp_path / f"run{run}_{part}.csv").write_text(f"{run} {part}", "utf-8")
    (tmp_path / "mapping.yaml").write_text(FILES, "utf-8")
    mapping = ResolvedMapping.of(str(tmp_path / "mapping.yaml"))
    found = expand_addresses([str(tmp_path)], mapping)
    assert [path.rpartition("/")[2] for path in found] == ["run1_cmd.csv", "run2_cmd.csv"]
    before = digest_files(found[0], mapping)
    (tmp_path / "run1_pose.csv").write_text("other", "utf-8")  # the one that is not named
    assert digest_files(found[0], mapping) != before
    joint = f"{tmp_path}/run1_pose.csv+{tmp_path}/run1_cmd.csv"
    assert expand_addresses([joint]) == [joint]
    refused(FileError, expand_addresses, [f"{tmp_path}/run1_pose.csv+{tmp_path}/run9_cmd.csv"])


def test_a_folder_with_a_file_for_each_topic_is_one_log(tmp_path):
    mapping = ResolvedMapping.of("avl690")
    for dive in ("dive1", "dive2"):
        (tmp_path / dive).mkdir()
        for topic in ("share_depth_node.depth", "share_pid_attitude_control_node.fins", "extra"):
            (tmp_path / dive / f"{topic}.dat").write_text("x", "utf-8")
    found = expand_addresses([str(tmp_path)], mapping)
    assert found == [str(tmp_path / "dive1"), str(tmp_path / "dive2")]
    assert len(expand_addresses([str(tmp_path)])) == 6


@pytest.mark.parametrize("address", ["zzz://bucket/*.csv", "ftp://127.0.0.1:1/a.csv"])
def test_a_store_that_cannot_be_reached_is_a_sentence(address, refused):
    pytest.importorskip("fsspec")
    refused(FileError, expand_addresses, [address])


def test_the_path_holds_the_name_of_the_vehicle_as_a_word(refused):
    assert assign_vehicle("gray/ray_1/a.csv", ["ray", "gray-seal"]) == "ray"
    assert assign_vehicle("ray-heavy/2026.csv", ["ray", "ray-heavy"]) == "ray-heavy"
    for path in ("gray/a.csv", "ray2/a.csv", "skate/a.csv"):
        refused(MethodError, assign_vehicle, path, ["ray", "ray-heavy"])
    refused(MethodError, assign_vehicle, "ray/skate.csv", ["ray", "skate"])


def test_a_date_is_a_day_of_the_calendar(refused):
    assert assign_group(["day"], "2026-13-45/dive_20260501.csv", "v", 0.0) == ("2026-05-01",)
    for path in ("2026-13-45.csv", "2026-02-30.csv", "serial120260501.csv"):
        refused(MethodError, assign_group, ["day"], path, "v", 0.0)
    refused(MethodError, assign_group, ["day"], "2026-05-01.csv", "v", 1.7e18)  # nanoseconds


@pytest.mark.parametrize("pattern", ["(zzz)|(.)", "(zzz)?x", "nothing", "x*?"])
def test_a_pattern_without_a_group_is_refused(pattern, refused):
    refused(MethodError, assign_group, [pattern], "x.csv", "v", 0.0)


def test_groups_are_in_the_order_of_their_dates_whatever_the_clock():
    starts = {("2026-05-03",): 5.0, ("2026-05-01",): 900.0, ("2026-05-02",): 1.7e9}
    assert sort_groups(["day"], starts) == sorted(starts)
    assert sort_groups(["folder"], {("b",): 1.0, ("a",): 2.0}) == [("a",), ("b",)]
    assert sort_groups(["folder"], {("b",): 1.7e9, ("a",): 1.8e9}) == [("b",), ("a",)]
    assert group_order(["folder"], [1.0, 1.7e9]) == "name"
    assert group_order(["folder"], [1.6e9, 1.7e9]) == "clock"
    assert group_order(["month", "dive"], [1.0]) == "date"
