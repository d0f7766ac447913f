"""The files of a plan: the table, the mission, the page."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.experiment_design.result import UNITS, commands_csv, mission_plan, plan_document
from hydrodamp.files import as_json
from hydrodamp.report.plan_report import write_plan

pytestmark = pytest.mark.slow


def test_the_table_has_a_row_for_each_waypoint_or_each_period(planned):
    rows = list(csv.DictReader(commands_csv(planned).splitlines()))
    assert [*rows[0]] == ["time", "north", "east", "speed"]  # a boat has no depth
    assert len(rows) == len(planned.waypoints)
    by_setpoints = replace(planned, waypoints=None)
    rows = list(csv.DictReader(commands_csv(by_setpoints).splitlines()))
    assert [*rows[0]] == ["time", *planned.setpoints]
    assert len(rows) == len(planned.time)
    assert float(rows[7]["rpm"]) == pytest.approx(planned.setpoints["rpm"][7], rel=1e-5)


def test_no_number_of_the_table_is_a_negative_zero(planned):
    zeros = replace(planned, waypoints=-0.0 * planned.waypoints)
    assert "-0" not in commands_csv(zeros)


def test_a_plan_states_whether_the_dive_is_worth_it(planned):
    rows = planned.predictions
    grades = {each.label: hd.Grade.NOT_DETERMINED for each in rows}
    better = sum(each.grade is not hd.Grade.NOT_DETERMINED for each in rows)
    today = f"Worth it: {better} of 5 coefficients get a grade above 'not determined'"
    assert str(planned).startswith(today)

    def worth(share, grades):
        std = [each.combined_std_error / share for each in rows]
        pairs = zip(rows, std, strict=True)
        known = tuple(replace(each, prior_std_error=today) for each, today in pairs)
        return replace(planned, predictions=known, grades=grades).worth

    assert worth(0.5, {}) == "Worth it: intervals become 50% as wide as today's, in the median."
    assert worth(0.9, {}).startswith("Not worth it: intervals become 90%")
    assert worth(0.9, grades).startswith(f"Worth it: {better} of 5 coefficients")
    best = dict.fromkeys(grades, hd.Grade.DETERMINED)
    assert worth(0.9, best).startswith("Not worth it: 0 of 5 coefficients get a better grade")
    assert "<td>combined_std_error</td>" in planned._repr_html_()


def mission_items(plan):
    mission = json.loads(mission_plan(plan))
    assert (mission["fileType"], mission["version"]) == ("Plan", 1)
    return mission["mission"]["items"]


def test_a_mission_runs_in_follows_the_waypoints_and_surfaces_at_the_start(planned):
    items = mission_items(planned)
    assert [item["doJumpId"] for item in items] == list(range(1, len(items) + 1))
    assert items[0]["command"] == 178  # speed before the first waypoint
    legs = [item["params"][4:] for item in items if item["command"] == 16]
    north, east = (np.array(legs)[:, :2] - (60.0, 5.0)).T * 111_320.0
    path = np.column_stack([north, east * np.cos(np.radians(60.0))])
    assert path[1:-1] == pytest.approx(planned.waypoints[:, 1:3], abs=0.01)
    run_in, first_leg = path[1] - path[0], path[2] - path[1]
    cosine = run_in @ first_leg / np.linalg.norm(run_in) / np.linalg.norm(first_leg)
    assert cosine == pytest.approx(1.0, abs=1e-6)
    assert path[-1] == pytest.approx([0.0, 0.0], abs=0.01)
    assert items[-1]["command"] == 21
    assert items[-1]["params"][4:] == [60.0, 5.0, 0.0]


def test_a_vehicle_that_dives_comes_and_goes_at_the_least_depth(planned):
    legs = planned.waypoints.copy()
    legs[:, 3] = 12.0
    diving = replace(planned, waypoints=legs, setpoints=planned.setpoints | {"depth": legs[:, 3]})
    depths = [-item["params"][6] for item in mission_items(diving) if item["command"] == 16]
    assert depths[0] == depths[-1] == planned.envelope.depth[0]
    assert depths[1:-1] == [12.0] * len(legs)


def test_a_mission_crosses_the_date_line(planned):
    envelope = planned.envelope.model_copy(update={"home": (0.0, 180.0)})
    east = [item["params"][5] for item in mission_items(replace(planned, envelope=envelope))[1:-1]]
    assert all(-180.0 <= item <= 180.0 for item in east if item)


def test_a_mission_is_of_waypoints_alone(planned):
    with pytest.raises(MethodError, match="plan with mode 'waypoints'"):
        mission_plan(replace(planned, waypoints=None))


def test_the_document_states_the_unit_of_every_number(planned):
    document = plan_document(planned)
    assert document["units"] == UNITS
    assert document["predictions"]["X_u|u|"]["unit"] == "N/(m/s)^2"
    assert document["segments"][0]["course"] == np.degrees(planned.segments[0].course) % 360.0
    named = " ".join(UNITS)
    numbers = ["duration", "feasibility_rate", "time_at_limits", "waypoints", "envelope"]
    numbers += [item for item in planned.envelope.model_dump() if item in "depth pitch home"]
    assert all(item in named for item in numbers)


def test_a_plan_is_written_whole(planned, tmp_path):
    assert write_plan(planned, tmp_path) == []
    assert write_plan(planned, tmp_path) == []  # in place of the first
    names = {file.name for file in tmp_path.iterdir()}
    assert {"plan.csv", "plan.json", "mission.plan", "track.csv", "plan.html"} <= names
    assert hd.read_log(tmp_path / "track.csv").n == planned.track.n
    document = json.loads(as_json(plan_document(planned)))
    assert document["predictions"]["X_u|u|"]["grade"] == planned.predictions[0].grade.word
    assert "X_u|u|" in (tmp_path / "plan.html").read_text("utf-8")
