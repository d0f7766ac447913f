"""The colcon package: its XML and Python, the paths that it names, and its build where ROS 2 is."""

import runpy
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree

import numpy as np
import pytest
import typer

import hydrodamp as hd
from hydrodamp.cli.main import app
from hydrodamp.errors import MethodError
from hydrodamp.export.export import find_target
from hydrodamp.export.gazebo import GzSim
from hydrodamp.export.planar import complete_plant
from hydrodamp.export.plant import ExportedPlant
from hydrodamp.export.ros2_package import Ros2Package
from hydrodamp.files import load_yaml
from hydrodamp.live.synchroniser import Message, MessageSynchroniser, stream_mapping
from hydrodamp.simulation.problem import vehicle_stamp

from .conftest import accelerations_of, states, write_export
from .test_gazebo import DRIVEN, dart

COMMANDS = typer.main.get_command(app).commands
WAYS = "linear", "angular"
DAMPING = hd.Damping.from_dict(None, {"X_u": -5.0, "Y_v|v|": -40.0, "N_r": -2.0})
PLANT = ExportedPlant.of(DRIVEN, DAMPING)


class Action:
    """A stand-in for an action of a launch file."""

    def __init__(self, *given, **named):
        self.given, self.named = given, named


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ros2") / "package"
    return write_export(Ros2Package(), PLANT, folder)


@pytest.fixture
def launch(package, monkeypatch):
    """A function that returns the actions of a launch file of the package."""
    share = {"auv_bluerov2": str(package)}
    contents = {
        "ament_index_python.packages": {"get_package_share_directory": share.__getitem__},
        "launch": {"LaunchDescription": list},
        "launch.actions": {"ExecuteProcess": Action, "DeclareLaunchArgument": Action},
        "launch.substitutions": {"LaunchConfiguration": Action},
        "launch_ros.actions": {"Node": Action},
    }
    for name, values in contents.items():
        module = ModuleType(name)
        vars(module).update(values)
        monkeypatch.setitem(sys.modules, name, module)

    def run(name):
        scope = {}
        text = (package / f"launch/{name}.launch.py").read_text("utf-8")
        exec(compile(text, name, "exec"), scope)
        return scope["generate_launch_description"]()

    return run


def test_the_package_names_what_it_needs_and_installs_what_it_has(package):
    root = ElementTree.parse(package / "package.xml").getroot()
    assert root.get("format") == "3"
    asked = "name version description maintainer license"
    assert {each.tag for each in root} >= {*asked.split()}
    name = root.findtext("name")
    text = (package / "CMakeLists.txt").read_text("utf-8")
    assert name == "auv_bluerov2"
    assert f"project({name} NONE)" in text
    [folders] = [line.split()[1:-2] for line in text.splitlines() if line.startswith("install(")]
    assert {*folders} == {path.name for path in package.iterdir() if path.is_dir()}


def test_launch_files_start_what_the_package_has(package, launch):
    simulator, bridge = launch("simulate")
    *_, world = simulator.named["cmd"]
    assert ElementTree.parse(world).getroot().tag == "sdf"
    [parameters] = bridge.named["parameters"]
    assert load_yaml(parameters["config_file"])
    argument, live = launch("live")
    *call, mapping = live.named["cmd"]
    assert call[:4] == [sys.executable, "-m", "hydrodamp", "live"]
    assert mapping.given == argument.given == ("mapping",)
    options = dict(zip(call[4::2], [*call[5::2], argument.named["default_value"]], strict=True))
    assert set(options) == {"--source", "--vehicle", "--model", "--mapping"}
    assert set(options) <= {name for each in COMMANDS["live"].params for name in each.opts}
    assert hd.read_vehicle(options["--vehicle"]) == DRIVEN
    assert [model.labels for model in hd.read_models(options["--model"])] == [DAMPING.model.labels]
    assert hd.read_mapping(options["--mapping"]).commands
    *arguments, replay = launch("replay")
    python, script, *given = replay.named["cmd"]
    assert python == sys.executable
    assert Path(script).is_file()
    assert [x.given for x in given] == [x.given for x in arguments] == [("bag",), ("mapping",)]


def test_the_vehicle_of_a_package_has_its_damping(planar, tmp_path):
    """Of a boat with assumed values too."""
    boat, damping, _ = planar
    stamped = replace(damping, vehicle=vehicle_stamp(boat))
    plant, assumed = complete_plant(ExportedPlant.of(boat, stamped))
    assert assumed
    config = write_export(Ros2Package(), plant, tmp_path) / "config"
    vehicle = hd.read_vehicle(config / "vehicle.yaml")
    read = ExportedPlant.of(vehicle, hd.read_damping(config / "damping.json"))
    assert read.damping.as_dict() == plant.damping.as_dict()


def test_a_live_run_reads_the_topics_of_the_simulator(package):
    """Odometry has the stamp of the simulation, commands none: reception counts."""
    mapping = stream_mapping(hd.read_mapping(package / "config/simulator.yaml"), print)
    messages = []
    for k in range(40):
        fields = {f"twist.twist.{way}.{x}": 0.1 * k for way in WAYS for x in "xyz"}
        fields |= {f"pose.pose.orientation.{x}": float(x == "w") for x in "xyzw"}
        fields |= {"header.stamp.sec": 0.0, "header.stamp.nanosec": 2e7 * k}
        received = 1.7e9 + 0.05 * k
        for name in DRIVEN.commands:
            topic = f"/auv_bluerov2/command/{name}"
            messages.append(Message(topic, received - 0.01, {"data": float(k)}))
        messages.append(Message("/auv_bluerov2/odometry", received, fields))
    rows = [*filter(None, MessageSynchroniser(mapping, print).synchronise(messages))]
    assert len(rows) >= 39
    np.testing.assert_allclose(np.diff([row["time"] for row in rows]), 0.05, rtol=1e-3)
    for row in rows:
        np.testing.assert_allclose([row["v"], row["port"]], [-row["u"], 10.0 * row["u"]])


@pytest.mark.slow
def test_a_replay_sends_what_each_actuator_takes(package, tmp_path, monkeypatch, capsys):
    pytest.importorskip("rosbags")
    from rosbags.rosbag2 import Reader
    from rosbags.typesys import Stores, get_typestore

    n, names, sent = 5, DRIVEN.commands, {}
    sizes = {"port": 1.0, "pwm": 400.0, "rpm": 900.0, "rudder": 0.5, "flap": 0.1, "jet": 1.0}
    values = np.linspace(-1.0, 1.0, n)[:, None] * [sizes[name] for name in names]
    values[:, names.index("pwm")] += 1500.0
    log = hd.Log(0.5 * np.arange(n), np.zeros((n, 6)), commands=values, command_names=names)
    hd.write_log(log, tmp_path / "dive.csv")
    text = "{time: time, velocity: {u: u, v: v, w: w, p: p, q: q, r: r}, commands: {%s}}"
    for key, present in {"whole": names, "portless": [x for x in names if x != "port"]}.items():
        listed = ", ".join(f"{name}: {name}" for name in present)
        (tmp_path / f"{key}.yaml").write_text(text % listed)

    def play(command):
        store = get_typestore(Stores.ROS2_JAZZY)
        with Reader(Path(command[-1])) as bag:
            for connection, stamp, raw in bag.messages():
                value = store.deserialize_cdr(raw, connection.msgtype).data
                sent.setdefault(connection.topic, []).append((stamp, value))
        assert command[:-1] == ["ros2", "bag", "play"]
        return 7

    monkeypatch.setattr(subprocess, "call", play)
    main = runpy.run_path(str(package / "scripts/replay.py"))["main"]
    assert main(tmp_path / "dive.csv", tmp_path / "whole.yaml") == 7
    wanted = {f"command/{name}": column for name, column in zip(names, values.T, strict=True)}
    wanted |= {
        "port_1": [-32.0, -20.0, 0.0, 20.0, 32.0],  # 40 N per unit within its limit of 0.8
        "pwm_2": [-30.0, -15.0, 0.0, 20.0, 40.0],
        "rpm_3": [-900.0, -450.0, 0.0, 450.0, 900.0],
        "rudder_4": [-0.3, -0.25, 0.0, 0.25, 0.3],
    }
    assert set(sent) == {f"/auv_bluerov2/{name}" for name in wanted}
    for name, column in wanted.items():
        stamps, found = zip(*sent[f"/auv_bluerov2/{name}"], strict=True)
        assert stamps == tuple(500_000_000 * k for k in range(n))
        np.testing.assert_allclose(found, column, atol=1e-12)
    assert main(tmp_path / "dive.csv", tmp_path / "portless.yaml") == 2
    assert "there is no command 'port'" in capsys.readouterr().err


def test_the_bridge_has_the_topics_of_the_model(package):
    entries = {each["ros_topic_name"]: each for each in load_yaml(package / "config/bridge.yaml")}
    model = ElementTree.parse(package / "models/auv_bluerov2/model.sdf").getroot()[0]
    sent = {name for name, each in entries.items() if each["direction"] == "ROS_TO_GZ"}
    used = {entries[name]["gz_topic_name"].split("/")[4] for name in sent}
    assert used == {joint.get("name") for joint in model.iter("joint")}
    assert sent == {f"/auv_bluerov2/{name}" for name in ("port_1", "pwm_2", "rpm_3", "rudder_4")}


def test_actuators_of_one_command_have_a_topic_each(tmp_path):
    pair = (hd.Thruster("ahead", (0.0, y, 0.0), (1, 0, 0), gain=20.0) for y in (-0.2, 0.2))
    plant = ExportedPlant.of(replace(DRIVEN, actuators=tuple(pair)), DAMPING)
    write_export(Ros2Package(), plant, tmp_path)
    topics = {each["ros_topic_name"] for each in load_yaml(tmp_path / "config/bridge.yaml")}
    assert topics >= {"/auv_bluerov2/ahead_1", "/auv_bluerov2/ahead_2"}


def test_settings_that_the_manifest_cannot_have_are_refused(refused):
    for text in ("", "ada", "a@b", "a b@c.org", "é@b.org", "a@b.org\n"):
        refused(MethodError, Ros2Package, email=text)
    refused(MethodError, Ros2Package, maintainer="")
    refused(MethodError, Ros2Package, license=" ")
    refused(MethodError, Ros2Package, step=0.0)


def test_settings_are_those_of_the_package(tmp_path):
    form = replace(find_target("ros2-package"), maintainer="A & B", license="MIT")
    root = ElementTree.parse(write_export(form, PLANT, tmp_path) / "package.xml").getroot()
    assert [root.findtext(tag) for tag in ("maintainer", "license")] == ["A & B", "MIT"]


@pytest.mark.slow
@dart
def test_it_moves_as_the_target_gz_sim(package, tmp_path):
    write_export(GzSim(), PLANT, tmp_path)
    at = states(PLANT, 5)
    moved = accelerations_of(Ros2Package(), package, PLANT, at)
    np.testing.assert_array_equal(moved, accelerations_of(GzSim(), tmp_path, PLANT, at))


@pytest.mark.slow
def test_colcon_builds_it(package, tmp_path):
    if shutil.which("colcon") is None:
        pytest.skip("colcon is not installed")
    call = ["colcon", "build", "--base-paths", str(package)]
    subprocess.run(call, cwd=tmp_path, check=True, capture_output=True)
    share = tmp_path / "install/auv_bluerov2/share/auv_bluerov2"
    sources = {path.relative_to(package) for path in package.rglob("*.*") if path.is_file()}
    assert {path for path in sources if path.parts[1:]} <= {
        path.relative_to(share) for path in share.rglob("*.*")
    }
