"""A ROS 2 node that identifies damping online: it maps topics to samples, publishes estimates.

Parameters: ``vehicle``, ``model`` and ``mapping``, each a name or a file; ``method``
(ai-composite, rls or ai); ``checkpoint``, a file; ``output_interval``, the sample time between two
estimates [s]. It publishes each estimate on ``~/estimates``, as the JSON line of
``hydrodamp live``, and its status on ``/diagnostics``.
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
from hydrodamp.cli.inputs import find_model
from hydrodamp.errors import ProblemError
from hydrodamp.live.estimator import diagnostic_status
from hydrodamp.live.readers import BoundedQueue, subscribe_new_topics
from hydrodamp.live.runner import LiveRun
from hydrodamp.live.synchroniser import Message, MessageSynchroniser, stream_mapping

DISCOVERY_INTERVAL = 0.5  # s, between two searches for new topics
SETTINGS = {
    **dict.fromkeys(("vehicle", "model", "mapping", "checkpoint"), ""),
    "method": "ai-composite",
    "output_interval": 1.0,
}


class Live(Node):
    """Subscribes to the topics of the mapping; a thread estimates from their messages."""

    def __init__(self) -> None:
        super().__init__("hydrodamp")
        parameters = {
            name: self.declare_parameter(name, default).value for name, default in SETTINGS.items()
        }
        if missing := [name for name in ("vehicle", "model", "mapping") if not parameters[name]]:
            raise ProblemError(f"give the parameters {', '.join(missing)}: `-p NAME:=VALUE`.")
        self.estimates = self.create_publisher(String, "~/estimates", 10)
        self.diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        mapping = stream_mapping(hd.read_mapping(parameters["mapping"]), self.log_message)
        self.synchroniser = MessageSynchroniser(mapping, self.log_message)
        self.queue = BoundedQueue[Message]()
        self.run = LiveRun(
            hd.find_vehicle(parameters["vehicle"]),
            find_model(parameters["model"]).with_terms()[0],
            parameters["method"],
            self.publish,
            self.log_message,
            output_interval=parameters["output_interval"],
            checkpoint_path=Path(parameters["checkpoint"]) if parameters["checkpoint"] else None,
            source_counts=self.counts,
        )
        self.has_failed = False
        self.create_timer(
            DISCOVERY_INTERVAL,
            subscribe_new_topics(self, self.synchroniser.accepts, self.queue.put),
        )
        self.thread = Thread(target=self.process)
        self.thread.start()

    def process(self) -> None:
        """Process samples until the stream of messages ends; an error ends the node."""
        try:
            self.run.process_rows(self.synchroniser.synchronise(self.queue))
        except Exception as error:
            self.has_failed = rclpy.ok()  # not if the node ends before a first sample
            is_known = isinstance(error, hd.HydrodampError)
            self.get_logger().error(str(error) if is_known else f"{type(error).__name__}: {error}")
            rclpy.try_shutdown()

    def end(self) -> None:
        """End the stream; the thread saves the checkpoint."""
        self.queue.put(None)
        self.thread.join()
        self.destroy_node()

    def log_message(self, message: str) -> None:
        """Log a message."""
        self.get_logger().info(message)

    def counts(self) -> dict[str, int]:
        """Return the numbers of messages that did not become samples."""
        return {"dropped": self.queue.dropped, "passed over": self.synchroniser.n_discarded}

    def publish(self, line: dict[str, Any]) -> None:
        """Publish an estimate line and its diagnostic status."""
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
    """Run the node until it is shut down."""
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
