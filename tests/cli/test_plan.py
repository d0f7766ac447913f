"""`hydrodamp plan`: refusals before work, and what a plan prints and writes."""

import json
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.experiment_design import context, optimise
from hydrodamp.files import as_json
from hydrodamp.report.documents import fit_document

BOAT = """\
name: boat
axes: [X, Y, N]
mass_matrix: [[30, 0, 0], [0, 45, 0], [0, 0, 8]]
weight: 300
buoyancy: 300
actuators:
  - {kind: fin, command: rudder, force: {Y: 6, N: -5}, limit: 0.4}
  - {kind: propeller, command: rpm, thrust: 2.0e-5}
"""
CALL = "plan --vehicle boat.yaml --model mine.yaml --duration 60 --out plan --envelope band.yaml"


@pytest.fixture
def home(folder, monkeypatch):
    monkeypatch.setattr(optimise, "MAX_GENERATIONS", 1)
    monkeypatch.setattr(context, "N_MEMBERS", 10)
    (folder / "boat.yaml").write_text(BOAT, "utf-8")
    (folder / "mine.yaml").write_text("{name: mine, terms: {X: u|u|, Y: v uv, N: r ur}}", "utf-8")
    (folder / "band.yaml").write_text("speed: [0.8, 1.6]", "utf-8")
    return folder


@pytest.mark.slow
def test_a_plan_is_printed_and_written(home, call):
    known = {"X_u|u|": -8.0, "Y_v": -30.0, "Y_uv": -20.0, "N_r": -4.0, "N_ur": -8.0}
    hd.write_damping(hd.Damping.from_dict(None, known), home / "known.json")
    done = call(f"{CALL} --damping known.json --json")
    document = json.loads(done.stdout)
    assert document["goal"] == ""  # a damping without fit
    assert list(document["predictions"]) == [*known]
    assert document["feasibility_rate"] >= 0.95
    assert "mission.plan is not written" in done.stderr
    assert (home / "plan" / "plan.csv").is_file()


def test_wrong_calls_are_refused_before_any_work(home, call):
    (home / "empty.yaml").write_text("", "utf-8")
    for line, says in (
        (CALL.replace("band.yaml", "empty.yaml"), "the envelope is empty"),
        (CALL.replace("mine.yaml", "sparse"), "`--model sparse` needs a whole log"),
        (CALL.replace("60", "6"), "`duration` must be from 60 s to 86400 s"),
        (CALL.replace("60", "1e9"), "to 86400 s (24 h); got 1000000000.0"),
        (CALL + " --mode swim", "Invalid value for '--mode'"),
    ):
        assert says in " ".join(call(line, 2).stderr.split())
    assert not (home / "plan").exists()


@pytest.mark.slow
def test_a_plan_of_a_saved_fit_states_its_goal(home, call):
    known = {"X_u|u|": -8.0, "Y_v": -30.0, "Y_uv": -20.0, "N_r": -4.0, "N_ur": -8.0}
    damping = hd.Damping.from_dict(None, known)
    loose = replace(damping, covariance=np.diag([0.01, 0.01, 0.01, 0.01, 1e4]))
    ranges = {"u": (0.8, 1.6), "v": (-0.3, 0.3), "r": (-0.3, 0.3)}
    fit = hd.Fit(loose, "oe", hd.Status.OK, training_range=ranges)
    (home / "fit.json").write_text(as_json(fit_document(fit)), "utf-8")
    call(f"{CALL} --damping fit.json --json", 0)
    document = json.loads((home / "plan" / "plan.json").read_text("utf-8"))
    goal = "Goal: heading steps at 0.8 m/s, where the model is not to be trusted."
    assert document["goal"] == goal
    assert goal in (home / "plan" / "plan.html").read_text("utf-8")
