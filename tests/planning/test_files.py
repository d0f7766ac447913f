"""The files of a plan: the table, the mission, the bag, the page."""

import csv
import json

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.files import as_json
from hydrodamp.planning.files import orders_csv, plan_document, waypoints
from hydrodamp.report.dive import write_plan


def test_the_table_has_what_to_tell_at_every_sample(planned):
    rows = list(csv.DictReader(orders_csv(planned).splitlines()))
    assert [*rows[0]] == ["time", *planned.orders]
    assert len(rows) == len(planned.time)
    assert float(rows[7]["rpm"]) == pytest.approx(planned.orders["rpm"][7], rel=1e-5)


def test_a_mission_goes_along_the_track(planned):
    mission = json.loads(waypoints(planned))
    assert (mission["fileType"], mission["version"]) == ("Plan", 1)
    ways = [one["params"] for one in mission["mission"]["items"] if one["command"] == 16]
    north = (np.array([one[4] for one in ways]) - 60.0) * 111_320.0
    assert north == pytest.approx(planned.track.position[:: round(10 / 0.1), 0], abs=0.01)
    numbers = [one["doJumpId"] for one in mission["mission"]["items"]]
    assert numbers == list(range(1, len(numbers) + 1))


def test_a_plan_is_written_whole(planned, tmp_path):
    pytest.importorskip("rosbags")
    assert write_plan(planned, tmp_path) == []
    assert write_plan(planned, tmp_path) == []  # in place of the first
    found = {path.name for path in tmp_path.iterdir()}
    assert {"plan.csv", "plan.json", "mission.plan", "track.csv", "bag", "plan.html"} <= found
    bag = hd.read_recording(tmp_path / "bag")
    assert {topic.name for topic in bag.topics} == {f"/plan/{name}" for name in planned.orders}
    assert hd.read_log(tmp_path / "track.csv").n == planned.track.n
    document = json.loads(as_json(plan_document(planned)))
    assert document["predictions"]["X_u|u|"]["grade"] == planned.predictions[0].grade.word
    assert "X_u|u|" in (tmp_path / "plan.html").read_text("utf-8")
