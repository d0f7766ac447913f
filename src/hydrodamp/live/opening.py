"""What `--source` names, opened: a stream of samples, and what it counts."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

from hydrodamp.data.log import Log
from hydrodamp.errors import ProblemError
from hydrodamp.ingest.formats.mavlink import Decoder
from hydrodamp.ingest.mapping import LogMapping, read_mapping
from hydrodamp.ingest.read import read_log
from hydrodamp.live import sources
from hydrodamp.live.samples import Row, read_number
from hydrodamp.live.sources import BoundedQueue, DatagramSocket
from hydrodamp.live.synchroniser import Message, MessageSynchroniser, stream_mapping

Say = Callable[[str], None]

# For sources whose messages only a mapping can tell apart.
_PRESETS = {"mavlink": "ardusub-mavlink", "ros2": "rep103-odometry"}


@dataclass(frozen=True)
class Source:
    """Samples, and what is counted besides them."""

    rows: Iterable[Row | None]
    counts: Callable[[], dict[str, int]] = lambda: {"dropped": 0}
    log: Log | None = None
    close: Callable[[], None] = lambda: None
    skip_to: Callable[[int], None] = lambda first: None  # samples before it were taken already


def open_source(
    address: str,
    mapping: str | Path | None,
    *,
    allow_remote: bool,
    real_time: bool,
    on_message: Say,
) -> Source:
    """Return the samples of `stdin`, `ros2`, an address or a log."""
    kind = urlsplit(address).scheme or address
    if "://" in address and kind not in ("udp", "mavlink"):
        raise ProblemError(
            f"`--source {address}` is not supported: name `stdin`, `ros2`, udp://HOST:PORT,"
            " mavlink://HOST:PORT, or the file of a log."
        )
    if kind not in ("stdin", "udp", "mavlink", "ros2"):
        log = read_log(address, mapping)
        rows_of_log = sources.LogRows(log, real_time)
        return Source(rows_of_log, log=log, skip_to=rows_of_log.skip_to)
    given = None if mapping is None else stream_mapping(read_mapping(mapping), on_message)
    if kind in _PRESETS:
        if given is None:
            raise ProblemError(
                f"`--source {address}` needs `--mapping`, which says what is what: a file, or a"
                f" preset such as {_PRESETS[kind]}."
            )
        return (
            _of_ros(given, on_message)
            if kind == "ros2"
            else _of_mavlink(address, given, allow_remote, on_message)
        )
    rows, datagrams = BoundedQueue[Row](blocks_when_full=address == "stdin"), None
    if address == "stdin":
        rows.start_reader(sources.line_reader())
    else:
        datagrams = sources.DatagramSocket(_bound(address, allow_remote, on_message))
        rows.start_reader(sources.datagram_reader(datagrams))
    if given is not None:
        return _gathered(
            rows, map(_message, rows), MessageSynchroniser(given, on_message), datagrams
        )
    return Source(rows, lambda: _drops(rows, datagrams), close=lambda: _end(rows))


def _of_ros(mapping: LogMapping, say: Say) -> Source:
    try:
        from hydrodamp.live.ros import topic_reader

        gathering, messages = MessageSynchroniser(mapping, say), BoundedQueue[Message]()
        messages.start_reader(topic_reader(gathering.accepts))
    except ModuleNotFoundError as error:
        raise ProblemError(
            "ROS 2 is heard by rclpy, which is not found: source the setup file of ROS first."
        ) from error
    return _gathered(messages, messages, gathering)


def _of_mavlink(address: str, mapping: LogMapping, allow: bool, say: Say) -> Source:
    asked = parse_qs(urlsplit(address).query).get("system", [""])[0]
    if asked and not asked.isdecimal():
        raise ProblemError(f"`system` of `--source {address}` must be a number; got '{asked}'.")
    try:
        decoder = Decoder(int(asked) if asked else None)
    except ModuleNotFoundError as error:
        raise ProblemError(
            'MAVLink is read by pymavlink, which is not installed: pip install "hydrodamp[live]"'
        ) from error
    messages, datagrams = (
        BoundedQueue[Message](),
        sources.DatagramSocket(_bound(address, allow, say)),
    )
    messages.start_reader(sources.packet_reader(datagrams, decoder))
    return _gathered(messages, messages, MessageSynchroniser(mapping, say), datagrams)


def _gathered(
    waiting: BoundedQueue[Row] | BoundedQueue[Message],
    messages: Iterable[Message | None],
    gathering: MessageSynchroniser,
    datagrams: DatagramSocket | None = None,
) -> Source:
    return Source(
        gathering.synchronise(messages),
        lambda: _drops(waiting, datagrams) | {"passed over": gathering.n_discarded},
        close=lambda: _end(waiting),
    )


def _end(waiting: BoundedQueue[Row] | BoundedQueue[Message]) -> None:
    """Wait for a reader of a socket or of topics; one of standard input may never return."""
    if waiting.blocks_when_full:
        waiting.is_cancelled = True
    else:
        waiting.cancel()


def _drops(
    waiting: BoundedQueue[Row] | BoundedQueue[Message], datagrams: DatagramSocket | None
) -> dict[str, int]:
    """Return what was dropped for want of room, here and, where it tells, in the kernel."""
    return {"dropped": waiting.dropped} | (
        {"kernel drops": datagrams.n_kernel_drops} if datagrams else {}
    )


def _message(row: Row | None) -> Message | None:
    """Return an object of JSON as what its `topic` says; a table's where it names none."""
    if row is None:
        return None
    fields = {name: read_number(row, name) for name in row if name != "topic"}
    return Message(str(row.get("topic", "")), time.time(), fields)


def _bound(address: str, allow: bool, say: Say) -> socket.socket:
    bound = sources.bind_socket(address, allow)
    say("listening at {}, port {}".format(*bound.getsockname()))
    return bound
