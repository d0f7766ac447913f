"""The node of ROS 2, with stand-ins for ROS: what an error in its thread does."""

import runpy
import sys
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest

import hydrodamp as hd
from hydrodamp.errors import FileError

NODE = Path(__file__).parents[2] / "integrations" / "ros2" / "node.py"
ROS = ("rclpy", "rclpy.executors", "rclpy.node", "diagnostic_msgs", "diagnostic_msgs.msg")
PARAMETERS = {"vehicle": "vt690", "model": "linear", "mapping": "rep103-odometry"}


class StubNode:
    """A node whose parameters are those of ``PARAMETERS``, else their defaults."""

    def __init__(self, name):
        self.name = name

    def declare_parameter(self, name, default):
        return SimpleNamespace(value=PARAMETERS.get(name, default))

    def __getattr__(self, name):
        return MagicMock()


def load_node(monkeypatch, base):
    """Return the class of the node, above a stub of ROS."""
    for name in (*ROS, "std_msgs", "std_msgs.msg"):
        monkeypatch.setitem(sys.modules, name, MagicMock(Node=base))
    return runpy.run_path(str(NODE))["Live"]


def test_a_node_starts_with_its_parameters_and_ends(monkeypatch):
    live = load_node(monkeypatch, StubNode)
    sys.modules["rclpy"].ok.return_value = False
    node = live()
    node.end()
    assert node.run.vehicle == hd.fleet["vt690"]
    assert node.run.model == hd.catalog["linear"]
    assert not node.has_failed


@pytest.mark.parametrize(
    ("error", "text"),
    [(FileError("s.json: in use"), "s.json: in use"), (ValueError("odd"), "ValueError: odd")],
)
@pytest.mark.parametrize("is_running", [True, False])
def test_an_error_is_logged_and_ends_the_node(monkeypatch, error, text, is_running):
    live = load_node(monkeypatch, object)
    rclpy = sys.modules["rclpy"]
    rclpy.ok.return_value = is_running
    node, logger = SimpleNamespace(queue=[], synchroniser=MagicMock(), run=MagicMock()), MagicMock()
    node.get_logger, node.run.process_rows.side_effect = lambda: logger, error
    live.process(node)
    logger.error.assert_called_once_with(text)
    rclpy.try_shutdown.assert_called_once_with()
    assert node.has_failed == is_running
