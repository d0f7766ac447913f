"""The colcon package: its XML and Python, the paths that it names, and its build where ROS 2 is."""

from __future__ import annotations

import shutil
import subprocess
import sys
from dataclasses import replace
from types import ModuleType
from xml.etree import ElementTree

import pytest

import hydrodamp as hd
from hydrodamp.export.export import find_target
from hydrodamp.files import load_yaml

from .test_gazebo import DRIVEN

DAMPING = hd.Damping.from_dict(None, {"X_u": -5.0, "Y_v|v|": -40.0, "N_r": -2.0})


class Action:
    """A stand-in for an action of a launch file."""

    def __init__(self, *given, **named):
        self.given, self.named = given, named

    def perform(self, context):
        return context[self.given[0]]


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ros2") / "package"
    hd.export(DAMPING, DRIVEN, "ros2-package", folder)
    return folder


@pytest.fixture
def launch(package, monkeypatch):
    """A function that returns the actions of a launch file of the package."""
    share = {"auv_bluerov2": str(package)}
    contents = {
        "ament_index_python.packages": {"get_package_share_directory": share.__getitem__},
        "launch": {"LaunchDescription": list},
        "launch.actions": dict.fromkeys(
            ("ExecuteProcess", "DeclareLaunchArgument", "OpaqueFunction"), Action
        ),
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
    assert {each.tag for each in root} >= {
        "name",
        "version",
        "description",
        "maintainer",
        "license",
    }
    name = root.findtext("name")
    text = (package / "CMakeLists.txt").read_text("utf-8")
    assert name == "auv_bluerov2"
    assert f"project({name})" in text
    for folder in ("config", "launch", "models"):
        assert folder in text
        assert any((package / folder).iterdir())


def test_launch_files_start_what_the_package_has(package, launch):
    simulator, bridge = launch("simulate")
    *_, world = simulator.named["cmd"]
    assert ElementTree.parse(world).getroot().tag == "sdf"
    [parameters] = bridge.named["parameters"]
    assert load_yaml(parameters["config_file"])
    _, live = launch("live")
    command = live.named["cmd"]
    vehicle, damping = (command[command.index(each) + 1] for each in ("--vehicle", "--damping"))
    assert hd.read_vehicle(vehicle) == DRIVEN
    assert hd.read_damping(damping).as_dict() == DAMPING.as_dict()


def test_a_bag_is_replayed_into_the_topics_of_commands(package, launch):
    *_, play = launch("replay")
    context = {"bag": "dive", "remap": "/thrust:=/auv_bluerov2/port"}
    [process] = play.named["function"](context)
    topics = "--topics", "/thrust", "--remap", "/thrust:=/auv_bluerov2/port"
    assert process.named["cmd"] == ["ros2", "bag", "play", "dive", *topics]
    [whole] = play.named["function"]({"bag": "dive", "remap": ""})
    assert whole.named["cmd"] == ["ros2", "bag", "play", "dive"]


def test_the_bridge_has_the_topics_of_the_model(package):
    entries = {each["ros_topic_name"]: each for each in load_yaml(package / "config/bridge.yaml")}
    model = ElementTree.parse(package / "models/auv_bluerov2/model.sdf").getroot()[0]
    joints = {joint.get("name") for joint in model.iter("joint")}
    commands = {name: each for name, each in entries.items() if each["direction"] == "ROS_TO_GZ"}
    used = {each["gz_topic_name"].split("/")[4] for each in commands.values()}
    assert used == joints
    assert set(commands) == {f"/auv_bluerov2/{name}" for name in ("port", "pwm", "rpm", "rudder")}


def test_settings_are_those_of_the_package(tmp_path):
    form = replace(find_target("ros2-package"), maintainer="A & B", license="MIT")
    hd.export(DAMPING, DRIVEN, form, tmp_path / "package")
    root = ElementTree.parse(tmp_path / "package/package.xml").getroot()
    assert [root.findtext(tag) for tag in ("maintainer", "license")] == ["A & B", "MIT"]


@pytest.mark.slow
def test_colcon_builds_it(package):
    if shutil.which("colcon") is None:
        pytest.skip("colcon is not installed")
    call = ["colcon", "build", "--base-paths", "."]
    subprocess.run(call, cwd=package, check=True, capture_output=True)
    assert (package / "install").is_dir()
