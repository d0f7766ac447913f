"""ROS 2 as a source: the topics of a mapping heard, each message with the fields of a bag's."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from importlib import import_module
from typing import Any

from hydrodamp.ingest.formats.message_layout import MAX_ARRAY_LENGTH
from hydrodamp.live.sources import BoundedQueue
from hydrodamp.live.synchroniser import Message

_LOOK = 0.5  # s, between two looks for topics that are new
_DEPTH = 1000  # messages that the middleware keeps


def fields_of(message: Any) -> dict[str, float]:
    """Return the numbers of a message by their paths; a time in seconds."""
    return dict(_fields(message, ""))


def _fields(value: Any, path: str) -> Iterator[tuple[str, float]]:
    if isinstance(value, int | float):
        yield path, float(value)
    elif hasattr(value, "get_fields_and_field_types"):
        names = tuple(value.get_fields_and_field_types())
        if names == ("sec", "nanosec"):
            yield path, value.sec + value.nanosec / 1e9
            return
        for name in names:
            yield from _fields(getattr(value, name), f"{path}.{name}" if path else name)
    elif not isinstance(value, str | bytes) and len(value) <= MAX_ARRAY_LENGTH:
        items = value.tolist() if hasattr(value, "tolist") else value
        for place, item in enumerate(items):
            yield from _fields(item, f"{path}[{place}]")


def hear(
    node: Any, is_wanted: Callable[[str], bool], put: Callable[[Message], None]
) -> Callable[[], None]:
    """Return what subscribes a node to the topics that are wanted and new; call it now and then."""
    heard: dict[str, Any] = {}

    def look() -> None:
        for topic, kinds in node.get_topic_names_and_types():
            if topic not in heard and is_wanted(topic):
                heard[topic] = _subscribed(node, topic, kinds[0], put)

    return look


def _subscribed(node: Any, topic: str, kind: str, put: Callable[[Message], None]) -> Any:
    from rclpy.qos import QoSProfile, ReliabilityPolicy

    package, _, name = kind.replace("/", ".").rpartition(".")
    offers = {one.qos_profile.reliability for one in node.get_publishers_info_by_topic(topic)}
    is_reliable = offers <= {ReliabilityPolicy.RELIABLE}
    policy = ReliabilityPolicy.RELIABLE if is_reliable else ReliabilityPolicy.BEST_EFFORT

    def take(message: Any) -> None:
        put(Message(topic, time.time(), fields_of(message)))

    quality = QoSProfile(depth=_DEPTH, reliability=policy)
    return node.create_subscription(getattr(import_module(package), name), topic, take, quality)


def of_topics(is_wanted: Callable[[str], bool]) -> Callable[[BoundedQueue[Message]], None]:
    """Return what hears topics by a node of its own, until nobody waits any more."""
    import rclpy
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.signals import SignalHandlerOptions

    def read(waiting: BoundedQueue[Message]) -> None:
        context = rclpy.Context()
        rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
        node = rclpy.create_node("hydrodamp_live", context=context)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        look = hear(node, is_wanted, waiting.put)
        node.create_timer(_LOOK, look)
        look()
        while not waiting.is_over:
            executor.spin_once(timeout_sec=_LOOK)
        executor.shutdown()
        node.destroy_node()
        context.try_shutdown()

    return read
