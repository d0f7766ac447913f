"""`hydrodamp plan`: refusals before work, and what a plan prints and writes."""

import json

import pytest

import hydrodamp as hd
from hydrodamp.experiment_design import context, optimise

CALL = "plan --vehicle boat.yaml --model mine.yaml --duration 60 --out plan --envelope band.yaml"


@pytest.fixture
def home(boat, monkeypatch):
    monkeypatch.setattr(optimise, "MAX_GENERATIONS", 1)
    monkeypatch.setattr(context, "N_MEMBERS", 10)
    (boat / "mine.yaml").write_text("{name: mine, terms: {X: u|u|, Y: v uv, N: r ur}}", "utf-8")
    (boat / "band.yaml").write_text("speed: [0.8, 1.6]", "utf-8")
    return boat


@pytest.mark.slow
def test_a_plan_is_printed_and_written(home, call):
    done = call(f"{CALL} --damping boat.json --json")
    document = json.loads(done.stdout)
    assert document["verdict"].partition(":")[0] in ("Worth it", "Not worth it")
    assert list(document["predictions"]) == [*hd.read_damping(home / "boat.json").as_dict()]
    assert document["feasibility_rate"] >= 0.95
    assert "mission.plan is not written" in done.stderr
    assert (home / "plan" / "plan.csv").is_file()
