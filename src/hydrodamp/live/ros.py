"""ROS 2 source: subscribe to the topics of a mapping; fields have the names of those in a bag."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from importlib import import_module
from typing import Any

from hydrodamp.ingest.formats.rosbag import MAX_ARRAY_LENGTH
from hydrodamp.live.bounded_queue import BoundedQueue
from hydrodamp.live.synchroniser import Message

DISCOVERY_INTERVAL = 0.5  # s, between two searches for new topics; by choice
QUEUE_DEPTH = 1000  # messages that the middleware queues; by choice


def message_fields(message: Any) -> dict[str, float]:
    """Return the numbers of a message by path; a time in seconds."""
    return dict(_walk_fields(message, ""))


def _walk_fields(value: Any, path: str) -> Iterator[tuple[str, float]]:
    if isinstance(value, int | float):
        yield path, float(value)
    elif hasattr(value, "get_fields_and_field_types"):
        names = tuple(value.get_fields_and_field_types())
        if names == ("sec", "nanosec"):
            yield path, value.sec + value.nanosec / 1e9
            return
        for name in names:
            yield from _walk_fields(getattr(value, name), f"{path}.{name}" if path else name)
    elif not isinstance(value, str | bytes) and len(value) <= MAX_ARRAY_LENGTH:
        items = value.tolist() if hasattr(value, "tolist") else value
        for index, item in enumerate(items):
            yield from _walk_fields(item, f"{path}[{index}]")


def subscribe_new_topics(
    node: Any, accepts: Callable[[str], bool], put: Callable[[Message], None]
) -> Callable[[], None]:
    """Return a function that subscribes a node to accepted topics that are new."""
    subscriptions: dict[str, Any] = {}

    def discover() -> None:
        for topic, kinds in node.get_topic_names_and_types():
            if topic not in subscriptions and accepts(topic):
                subscriptions[topic] = _subscribe(node, topic, kinds[0], put)

    return discover


def _subscribe(node: Any, topic: str, kind: str, put: Callable[[Message], None]) -> Any:
    from rclpy.qos import QoSProfile, ReliabilityPolicy

    package, _, name = kind.replace("/", ".").rpartition(".")
    publishers = node.get_publishers_info_by_topic(topic)
    is_reliable = {each.qos_profile.reliability for each in publishers} <= {
        ReliabilityPolicy.RELIABLE
    }
    policy = ReliabilityPolicy.RELIABLE if is_reliable else ReliabilityPolicy.BEST_EFFORT

    def receive(message: Any) -> None:
        put(Message(topic, time.time(), message_fields(message)))

    profile = QoSProfile(depth=QUEUE_DEPTH, reliability=policy)
    return node.create_subscription(getattr(import_module(package), name), topic, receive, profile)


def topic_reader(accepts: Callable[[str], bool]) -> Callable[[BoundedQueue[Message]], None]:
    """Return a reader that receives accepted topics with its own node."""
    import rclpy
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.signals import SignalHandlerOptions

    def read_topics(queue: BoundedQueue[Message]) -> None:
        context = rclpy.Context()
        rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
        node = rclpy.create_node("hydrodamp_live", context=context)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        discover = subscribe_new_topics(node, accepts, queue.put)
        node.create_timer(DISCOVERY_INTERVAL, discover)
        discover()
        while not queue.is_cancelled:
            executor.spin_once(timeout_sec=DISCOVERY_INTERVAL)
        executor.shutdown()
        node.destroy_node()
        context.try_shutdown()

    return read_topics
