"""The node of ROS 2, with stand-ins for ROS: what an error in its thread does."""

import runpy
import sys
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest

import hydrodamp as hd

NODE = Path(__file__).parents[2] / "integrations" / "ros2" / "node.py"
ROS = ("rclpy", "rclpy.executors", "rclpy.node", "diagnostic_msgs", "diagnostic_msgs.msg")


@pytest.mark.parametrize(
    ("error", "text"),
    [(hd.FileError("s.json: in use"), "s.json: in use"), (ValueError("odd"), "ValueError: odd")],
)
@pytest.mark.parametrize("is_running", [True, False])
def test_an_error_is_logged_and_ends_the_node(monkeypatch, error, text, is_running):
    for name in (*ROS, "std_msgs", "std_msgs.msg"):
        monkeypatch.setitem(sys.modules, name, MagicMock(Node=object))
    rclpy = sys.modules["rclpy"]
    rclpy.ok.return_value = is_running
    node, logger = SimpleNamespace(queue=[], synchroniser=MagicMock(), run=MagicMock()), MagicMock()
    node.get_logger, node.run.process_rows.side_effect = lambda: logger, error
    runpy.run_path(str(NODE))["Live"].process(node)
    logger.error.assert_called_once_with(text)
    rclpy.try_shutdown.assert_called_once_with()
    assert node.has_failed == is_running
