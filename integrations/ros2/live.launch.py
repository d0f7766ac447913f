"""``ros2 launch live.launch.py vehicle:=auv.yaml model:=prestero mapping:=mapping.yaml``."""

import sys
from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration

NEEDED = ("vehicle", "model", "mapping")
DEFAULTS = {"method": "ai-composite", "checkpoint": "", "output_interval": "1.0"}


def generate_launch_description():
    """Start the node with its parameters."""
    arguments = [DeclareLaunchArgument(name) for name in NEEDED]
    arguments += [
        DeclareLaunchArgument(name, default_value=value) for name, value in DEFAULTS.items()
    ]
    parameters = [
        argument
        for name in (*NEEDED, *DEFAULTS)
        for argument in ("-p", [f"{name}:=", LaunchConfiguration(name)])
    ]
    node = [sys.executable, str(Path(__file__).with_name("node.py"))]
    process = ExecuteProcess(cmd=[*node, "--ros-args", *parameters], output="screen")
    return LaunchDescription([*arguments, process])
