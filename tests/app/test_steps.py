"""The states of the steps of a project, the action of each, and changes of whole projects."""

import json

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.app.commands import compare_command, format_command
from hydrodamp.app.project import find_project
from hydrodamp.app.steps import STEPS, find_blocker, step_states
from hydrodamp.experiment_design.envelope import read_envelope

from .conftest import open_log


def states(project):
    """Return the state of each step."""
    return [step.state for step in step_states(project)]


def finish(project):
    """Write results as the command of the project does."""
    folder = project.path("results")
    folder.mkdir(exist_ok=True)
    command = format_command(compare_command(project))
    document = {"provenance": {"command": command}, "verdict": {"text": "Use it.\nWhy."}}
    (folder / "comparison.json").write_text(json.dumps(document), "utf-8")
    (folder / "damping.json").write_text("{}", "utf-8")
    (folder / "report.html").write_text("<p>", "utf-8")


@pytest.fixture
def chosen(server, canonical):
    """A project with all choices."""
    server.post(f"{open_log(server, canonical)}/split", train="0:100", test="120:220")
    project = find_project(server.root, "dive")
    project.update(project.version, vehicle="vt690")
    return project


@pytest.mark.slow
def test_steps_follow_the_choices(server, canonical):
    address = open_log(server, canonical)
    project = find_project(server.root, "dive")
    assert states(project) == ["done", "done", "needs", "needs", "waits", "waits", "waits"]
    assert find_blocker(step_states(project), "run").name == "vehicle"
    assert find_blocker(step_states(project), "channels") is None
    page = server.get(f"{address}/run")
    assert "First, Vehicle: choose a vehicle." in page
    assert f'{address}/vehicle">Go to Vehicle' in page
    server.post(f"{address}/vehicle", source="fleet", name="vt690")
    page = server.post(f"{address}/split", train="0:100", test="120:220")
    assert 'hx-swap-oob="true"' in page
    assert states(project)[3:] == ["done", "ready", "waits", "waits"]
    assert "Run 4 fits" in server.get(f"{address}/run")
    page = server.post(f"{address}/run/choice", method="weak")
    assert "Choose a model and a method" in page
    assert states(project)[4] == "needs"


def test_results_of_other_choices_are_outdated(chosen):
    finish(chosen)
    assert states(chosen)[4:] == ["done", "done", "ready"]
    card = chosen.path("exported/python/fidelity.json")
    card.parent.mkdir(parents=True)
    card.write_text("{}", "utf-8")
    assert states(chosen)[4:] == ["done", "done", "done"]
    chosen.update(chosen.version, models=("fossen",))
    assert states(chosen)[4:] == ["outdated", "outdated", "outdated"]


def test_a_mapping_without_a_velocity_needs_the_user(server):
    (server.root / "odd.csv").write_text("t_s,a\n0,1\n1,2\n2,4\n", "utf-8")
    address = open_log(server, "odd.csv")
    assert step_states(find_project(server.root, "odd"))[1].note == "no column is a velocity"
    for screen in [*STEPS][1:]:
        status, _, page = server.request("GET", f"{address}/{screen}")
        assert status == 200 or b"Go to Channels" in page, screen


def test_a_renamed_project_keeps_its_results_and_a_copy_has_them(server, chosen):
    finish(chosen)
    _, headers, _ = server.request("POST", "/p/dive/project/rename", {"name": "sea trial, 2 m"})
    assert headers["HX-Redirect"].endswith("/p/sea-trial-2-m/channels")
    renamed = find_project(server.root, "sea-trial-2-m")
    assert states(renamed)[4:6] == ["done", "done"]
    server.post("/p/sea-trial-2-m/project/duplicate")
    copy = find_project(server.root, "sea-trial-2-m-copy")
    assert states(copy)[4:6] == ["done", "done"]
    server.post("/p/sea-trial-2-m/project/delete")
    assert not renamed.folder.exists()
    assert copy.path("results/comparison.json").is_file()
    assert (server.root / "dive.csv").is_file()


@pytest.mark.slow
def test_the_example_is_a_log_with_a_project(server, monkeypatch):
    monkeypatch.setattr("hydrodamp.app.start.EXAMPLE_SECONDS", 5.0)
    _, headers, _ = server.request("POST", "/example", {})
    assert headers["HX-Redirect"].endswith("/p/example-auv/channels")
    assert len(hd.read_log(server.root / "logs/example-auv.csv").segments) == 4


@pytest.mark.slow
def test_the_next_dive_asks_for_limits(server, chosen):
    finish(chosen)
    page = server.get("/p/dive/files")
    assert "Use it." in page
    form = {"duration": "600", "slowest": "2", "fastest": "2.5", "shallowest": "2"}
    server.post("/p/dive/files/plan", **form, deepest="20", side="300")
    envelope = read_envelope(chosen.path("envelope.yaml"))
    assert envelope.speed == (2.0, 2.5)
    assert envelope.depth == (2.0, 20.0)
    assert envelope.area.north == (-150.0, 150.0)
    assert 'name="side" inputmode="decimal" size="8" value="300"' in server.get("/p/dive/files")


@pytest.mark.slow
def test_actuators_take_mixed_commands_of_the_log_or_are_left_out(server):
    time = np.arange(0.0, 60.0, 0.1)
    rng = np.random.default_rng(1)
    fins = {name: 0.1 * rng.standard_normal(len(time)) for name in ("top", "bottom", "port")}
    motion = {"u": 1.0 + 0.1 * np.sin(time), "r": np.cos(time)}
    log = hd.Log.from_arrays(time, motion, commands=fins)
    hd.write_log(log, server.root / "dive.csv")
    address = open_log(server, "dive.csv")
    project = find_project(server.root, "dive")
    server.post(f"{address}/vehicle", source="fleet", name="vt690")
    assert "Actuators that the log does not command" in server.get(f"{address}/vehicle")
    form = {"first-rudder": "bottom", "sign-rudder": "-1", "second-rudder": "top"}
    form |= {"first-elevator": "port", "sign-elevator": "-1", "second-elevator": ""}
    server.post(f"{address}/vehicle/actuators", **form)
    mapped = hd.read_log(server.root / "dive.csv", mapping=str(project.path("mapping.yaml")))
    expected = 0.5 * (fins["bottom"] - fins["top"])
    np.testing.assert_allclose(mapped.command("rudder"), expected, atol=1e-12)
    np.testing.assert_allclose(mapped.command("elevator"), -fins["port"], atol=1e-12)
    assert hd.read_vehicle(project.path("vehicle.yaml")).commands == ("rudder", "elevator")
    assert "does not command" not in server.get(f"{address}/vehicle")
    gains = ["top|N", "bottom|N", "rudder|N"]
    refusal = server.post(f"{address}/vehicle/gains", 422, gain=gains)
    assert "rudder is determined by top and bottom" in refusal


@pytest.mark.slow
def test_entered_sizes_stay_and_a_planar_log_proposes_a_boat(server):
    time = np.arange(0.0, 60.0, 0.1)
    log = hd.Log.from_arrays(time, {"u": np.sin(time), "v": np.cos(time), "r": np.sin(2 * time)})
    hd.write_log(log, server.root / "boat.csv")
    address = open_log(server, "boat.csv")
    assert 'value="boat" checked' in server.get(f"{address}/vehicle")
    project = find_project(server.root, "boat")
    sizes = {"length": "1.35", "beam": "0.98", "draft": "0.11", "mass": "28"}
    form = {"source": "sizes", "kind": "catamaran", "height": "", **sizes}
    server.post(f"{address}/vehicle", **form)
    assert hd.read_vehicle(project.path("vehicle.yaml")).axes == ("X", "Y", "N")
    server.post(f"{address}/vehicle", source="fleet", name="otter")
    page = server.get(f"{address}/vehicle")
    assert 'value="catamaran" checked' in page
    assert 'name="beam" inputmode="decimal" size="8" value="0.98"' in page


@pytest.mark.slow
def test_each_correction_of_an_issue_changes_the_mapping(server, canonical):
    address = open_log(server, canonical)
    project = find_project(server.root, "dive")
    for kind, step, channel in [
        ("sign", "-1", "rudder"), ("delay", "0.25", "rudder"), ("omit", "rpm", "rpm rudder"),
        ("option", "subtract_current", "u v w"), ("unit", "deg", "elevator"),
    ]:  # fmt: skip
        server.post(f"{address}/channels/step", kind=kind, step=step, channel=channel)
    content = hd.files.load_yaml(project.path("mapping.yaml"))
    assert content["commands"]["rudder"] == {"column": "rudder", "sign": -1, "delay": 0.25}
    assert content["commands"]["elevator"]["unit"] == "deg"
    assert "rpm" not in content["commands"]
    assert content["steps"] == ["subtract_current"]
