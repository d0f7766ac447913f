"""Reader threads of live sources: lines, UDP datagrams, MAVLink and ROS 2, into a bounded queue.

Fields of a ROS message have the names of those in a bag.
"""

from __future__ import annotations

import csv
import json
import os
import socket
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from importlib import import_module
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Any, Generic, TypeVar
from urllib.parse import urlsplit

from hydrodamp.errors import ProblemError
from hydrodamp.ingest.formats.cells import parse_number
from hydrodamp.ingest.formats.mavlink import Decoder, split_packets
from hydrodamp.ingest.formats.rosbag import MAX_ARRAY_LENGTH
from hydrodamp.live.samples import Row
from hydrodamp.live.synchroniser import Message

Item = TypeVar("Item")

#: A row that cannot be read; it has no time.
UNREADABLE: Row = {}

POLL_INTERVAL = 0.2  # s, after which an idle source yields None; by choice
FULL_INTERVAL = 0.01  # s, between two looks at a full queue; by choice
JOIN_TIMEOUT = 5.0  # s, that the end of a reader may take; by choice
MAX_QUEUE_LENGTH = 10_000  # rows or messages; by choice
MAX_DATAGRAM_SIZE = 1 << 16  # bytes; UDP has no larger ones
MAX_SENDERS = 1000  # that are told apart; by choice
CHUNK_SIZE, MAX_LINE_LENGTH = 1 << 16, 1 << 20  # bytes; by choice
RECEIVE_BUFFER_SIZE = 1 << 22  # bytes of the kernel
SO_MEMINFO = 55  # Linux's asm-generic/socket.h: nine numbers, the last the datagrams dropped so far
DISCOVERY_INTERVAL = 0.5  # s, between two searches for new topics; by choice
QUEUE_DEPTH = 1000  # messages that the middleware queues; by choice


class SourceError(Exception):
    """A source that can no longer be read."""


@dataclass
class BoundedQueue(Generic[Item]):
    """A bounded queue from a reader thread to the run; it counts the items it drops."""

    blocks_when_full: bool = False  # instead of dropping the oldest item
    dropped: int = 0
    is_cancelled: bool = False  # by the consumer
    error: Exception | None = None  # of the reader
    thread: Thread | None = None
    items: SimpleQueue[Item | None] = field(default_factory=SimpleQueue)

    def put(self, item: Item | None) -> None:
        """Append an item; drop the oldest one where the queue is full. None ends the stream."""
        while self.blocks_when_full and self._is_full and not self.is_cancelled:
            time.sleep(FULL_INTERVAL)
        if item is not None and self._is_full:
            self.items.get()
            self.dropped += 1
        self.items.put(item)

    @property
    def _is_full(self) -> bool:
        return self.items.qsize() >= MAX_QUEUE_LENGTH

    def __iter__(self) -> Iterator[Item | None]:
        """Yield the items, and None after an interval without one."""
        while True:
            try:
                if (item := self.items.get(timeout=POLL_INTERVAL)) is None:
                    break
                yield item
            except Empty:
                yield None
        if self.error is not None:
            text = f"{type(self.error).__name__}: {self.error}"
            raise SourceError(f"the source can no longer be read: {text}") from self.error

    def start_reader(self, read: Callable[[BoundedQueue[Item]], None]) -> BoundedQueue[Item]:
        """Start a thread that fills the queue; the consumer receives its error."""

        def run() -> None:
            try:
                read(self)
            except Exception as error:
                self.error = error
            finally:
                self.put(None)

        self.thread = Thread(target=run, daemon=True)
        self.thread.start()
        return self

    def cancel(self) -> None:
        """Stop the reader and wait for its end; a reader of standard input may never end."""
        self.is_cancelled = True
        if self.thread is not None and not self.blocks_when_full:
            self.thread.join(JOIN_TIMEOUT)


Reader = Callable[[BoundedQueue[Any]], None]


def line_reader(descriptor: int = 0) -> Reader:
    """Return a reader of JSON lines or a canonical CSV, from standard input by default."""

    def read_lines(queue: BoundedQueue[Row]) -> None:
        parse, buffer, is_open = LineParser(), b"", True
        while is_open:
            # Python's own buffer would be locked by this thread when the program ends.
            is_open = bool(chunk := os.read(descriptor, CHUNK_SIZE))
            *lines, buffer = (buffer + (chunk or b"\n")).split(b"\n")
            if len(buffer) > MAX_LINE_LENGTH:
                lines, buffer = [*lines, buffer], b""
            for row in map(parse, lines):
                if row is not None:
                    queue.put(row)

    return read_lines


class LineParser:
    """Parse lines: JSON objects, or a CSV header and the lines below it."""

    header: list[str] | None = None

    def __call__(self, line: bytes) -> Row | None:
        """Return the row of a line; None for a header, a comment or an empty line."""
        text = line.decode("utf-8-sig", "replace").strip()
        if not text or text.startswith("#"):
            return None
        if text.startswith("{"):
            return parse_json(text)
        try:
            cells = next(csv.reader([text]))
        except csv.Error:
            return UNREADABLE
        if "time" in cells:
            self.header = [cell.strip() for cell in cells]
            return None
        if self.header is None or len(cells) != len(self.header):
            return UNREADABLE
        numbers = zip(self.header, cells, map(parse_number, cells), strict=True)
        return {name: cell if x is None else x for name, cell, x in numbers}


def parse_json(text: str | bytes) -> Row:
    """Return the row of a JSON object."""
    try:
        content: Any = json.loads(text)
    except (ValueError, RecursionError):
        return UNREADABLE
    return content if isinstance(content, dict) else UNREADABLE


def parse_datagram(data: bytes) -> list[Row]:
    """Return the rows of a datagram, one or several lines of JSON."""
    return [parse_json(line) for line in data.splitlines() if line.strip()]


def bind_socket(address: str, allow_remote: bool) -> socket.socket:
    """Return a UDP socket bound to an address; by default only loopback is allowed."""
    url = urlsplit(address)
    try:
        host, port = url.hostname or "127.0.0.1", url.port
    except ValueError:
        port = None
    if port is None:
        raise ProblemError(
            f"`--source {address}` must be {url.scheme}://HOST:PORT, such as {url.scheme}://:14660."
        )
    if not allow_remote and host not in ("127.0.0.1", "::1", "localhost"):
        raise ProblemError(
            f"{host} is reachable from the network and the protocol is unauthenticated: anyone can "
            "send samples and spoil the estimate. Bind to 127.0.0.1, or pass `--allow-remote`."
        )
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    receiver = socket.socket(family, socket.SOCK_DGRAM)
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_SIZE)
    try:
        receiver.bind((host, port))
    except OSError as error:
        receiver.close()
        raise ProblemError(f"`--source {address}` cannot be bound: {error.strerror}.") from error
    return receiver


class DatagramSocket:
    """A UDP socket that counts its senders and, on Linux, the datagrams the kernel drops."""

    def __init__(self, receiver: socket.socket) -> None:
        self.socket, self._n_kernel_drops = receiver, 0
        self.senders: set[Any] = set()  # addresses
        receiver.settimeout(POLL_INTERVAL)

    def counts(self) -> dict[str, int]:
        """Return the counts of what was lost, or came from others, until the socket is closed."""
        if sys.platform == "linux":
            with suppress(OSError):
                numbers = self.socket.getsockopt(socket.SOL_SOCKET, SO_MEMINFO, 36)
                self._n_kernel_drops = int.from_bytes(numbers[32:], sys.byteorder)
        n_senders = max(1, len(self.senders))
        return {"kernel drops": self._n_kernel_drops, "other senders": n_senders - 1}

    def reader(self, parse: Callable[[bytes], Iterable[Any]] = parse_datagram) -> Reader:
        """Return a reader of datagrams, of which ``parse`` returns the items."""

        def read_datagrams(queue: BoundedQueue[Any]) -> None:
            with self.socket:
                while not queue.is_cancelled:
                    # Windows reports an ICMP error as a reset connection.
                    with suppress(TimeoutError, ConnectionResetError):
                        data, sender = self.socket.recvfrom(MAX_DATAGRAM_SIZE)
                        if len(self.senders) < MAX_SENDERS:
                            self.senders.add(sender)
                        for item in parse(data):
                            queue.put(item)

        return read_datagrams


def packet_parser(decoder: Decoder) -> Callable[[bytes], Iterator[Message]]:
    """Return a parser of datagrams of MAVLink, with one or several packets in each."""

    def parse_packets(data: bytes) -> Iterator[Message]:
        now = time.time()
        for packet in split_packets(data):
            try:
                if (decoded := decoder(packet)) is not None:
                    yield Message(decoded.topic, now, decoded.fields, decoded.units)
            except ValueError:
                yield Message("", 0.0, {})

    return parse_packets


def message_fields(message: Any) -> dict[str, float]:
    """Return the numbers of a ROS message by path; a time in seconds."""
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
        for index, item in enumerate(value.tolist() if hasattr(value, "tolist") else value):
            yield from _walk_fields(item, f"{path}[{index}]")


def subscribe_new_topics(
    node: Any, accepts: Callable[[str], bool], put: Callable[[Message], None]
) -> Callable[[], None]:
    """Return a function that subscribes a ROS node to accepted topics that are new."""
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
    policies = {each.qos_profile.reliability for each in publishers}
    is_reliable = policies <= {ReliabilityPolicy.RELIABLE}
    policy = ReliabilityPolicy.RELIABLE if is_reliable else ReliabilityPolicy.BEST_EFFORT

    def receive(message: Any) -> None:
        put(Message(topic, time.time(), message_fields(message)))

    profile = QoSProfile(depth=QUEUE_DEPTH, reliability=policy)
    return node.create_subscription(getattr(import_module(package), name), topic, receive, profile)


def topic_reader(accepts: Callable[[str], bool]) -> Reader:
    """Return a reader that receives accepted topics of ROS 2 with its own node."""
    try:
        import rclpy
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.signals import SignalHandlerOptions
    except ModuleNotFoundError as error:
        raise ProblemError(
            "ROS 2 needs rclpy, which is not installed: source the setup file of ROS first."
        ) from error

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
