"""A node of ROS 2 that identifies damping on board: topics in through a mapping, estimates out.

Parameters: ``vehicle``, ``model`` and ``mapping``, each a name or a file; ``method`` (rls or ai);
``state``, the file that keeps what is known; ``every``, seconds of samples from estimate to
estimate. It publishes each estimate as the line of JSON that ``hydrodamp live`` prints, on
``~/estimates``, and how it fares on ``/diagnostics``.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from threading import Thread
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import String

import hydrodamp as hd
from hydrodamp.cli import resolve
from hydrodamp.live.diagnostics import diagnostic_status
from hydrodamp.live.ros import subscribe_new_topics
from hydrodamp.live.runner import LiveRun
from hydrodamp.live.sources import BoundedQueue
from hydrodamp.live.synchroniser import Message, MessageSynchroniser, stream_mapping

LOOK = 0.5  # s, between two looks for topics
SETTINGS = {"vehicle": "", "model": "", "mapping": "", "method": "rls", "state": "", "every": 1.0}


class Live(Node):
    """Hears the topics that the mapping names; a thread of its own makes estimates of them."""

    def __init__(self) -> None:
        super().__init__("hydrodamp")
        given = {name: self.declare_parameter(name, one).value for name, one in SETTINGS.items()}
        if absent := [name for name in ("vehicle", "model", "mapping") if not given[name]]:
            raise hd.ProblemError(f"give the parameters {', '.join(absent)}: `-p NAME:=VALUE`.")
        self.estimates = self.create_publisher(String, "~/estimates", 10)
        self.diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        mapping = stream_mapping(hd.read_mapping(given["mapping"]), self.say)
        self.gathering = MessageSynchroniser(mapping, self.say)
        self.waiting = BoundedQueue[Message]()
        self.run = LiveRun(
            resolve.find_vehicle(given["vehicle"]),
            resolve.find_model(given["model"])[0],
            given["method"],
            self.tell,
            self.say,
            output_interval=given["every"],
            checkpoint_path=Path(given["state"]) if given["state"] else None,
            source_counts=self.counts,
        )
        self.has_failed = False
        self.create_timer(
            LOOK, subscribe_new_topics(self, self.gathering.accepts, self.waiting.put)
        )
        self.thread = Thread(target=self.work)
        self.thread.start()

    def work(self) -> None:
        """Take samples until the stream of messages ends; an error ends the node."""
        try:
            self.run.process_rows(self.gathering.synchronise(self.waiting))
        except Exception as error:
            self.has_failed = rclpy.ok()  # not where the node ends before a first sample
            known = isinstance(error, hd.HydrodampError)
            self.get_logger().error(str(error) if known else f"{type(error).__name__}: {error}")
            rclpy.try_shutdown()

    def end(self) -> None:
        """End the stream; the state is kept before the thread ends."""
        self.waiting.put(None)
        self.thread.join()
        self.destroy_node()

    def say(self, sentence: str) -> None:
        """Log a sentence."""
        self.get_logger().info(sentence)

    def counts(self) -> dict[str, int]:
        """Count what did not become samples."""
        return {"dropped": self.waiting.dropped, "passed over": self.gathering.n_discarded}

    def tell(self, line: dict[str, Any]) -> None:
        """Publish an estimate, how it fares, and whether the vehicle has changed."""
        if not rclpy.ok():
            return
        self.estimates.publish(String(data=json.dumps(line)))
        status = DiagnosticStatus(name="hydrodamp", hardware_id=self.run.vehicle.name)
        level, status.message, values = diagnostic_status(line)
        status.level = DiagnosticStatus.WARN if level else DiagnosticStatus.OK
        status.values = [KeyValue(key=key, value=value) for key, value in values.items()]
        array = DiagnosticArray(status=[status])
        array.header.stamp = self.get_clock().now().to_msg()
        self.diagnostics.publish(array)


def main() -> int:
    """Run the node until it is told to end."""
    rclpy.init()
    try:
        node = Live()
    except hd.HydrodampError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.end()
        rclpy.try_shutdown()
    return 1 if node.has_failed else 0


if __name__ == "__main__":
    sys.exit(main())
