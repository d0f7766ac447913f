"""Sources of a live run: a log, standard input, UDP, MAVLink or ROS 2, as an iterator of samples.

A reader thread puts rows or messages into a bounded queue; the run takes them out.
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
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

from hydrodamp.data.log import Log
from hydrodamp.errors import ProblemError
from hydrodamp.ingest.formats.mavlink import Decoder, split_packets
from hydrodamp.ingest.mapping import read_mapping
from hydrodamp.ingest.read import read_log
from hydrodamp.live.bounded_queue import POLL_INTERVAL, BoundedQueue
from hydrodamp.live.samples import Row, read_number, rows_of
from hydrodamp.live.synchroniser import Message, MessageSynchroniser, stream_mapping

#: A row that cannot be read; it has no time.
UNREADABLE: Row = {}

#: A message that cannot be read.
UNREADABLE_MESSAGE = Message("", 0.0, {})

#: Preset mappings of the sources that need one.
PRESETS = {"mavlink": "ardusub-mavlink", "ros2": "rep103-odometry"}

MAX_DATAGRAM_SIZE = 8192  # bytes; the end of a larger one is lost
CHUNK_SIZE, MAX_LINE_LENGTH = 1 << 16, 1 << 20  # bytes; by choice
RECEIVE_BUFFER_SIZE = 1 << 22  # bytes of the kernel
SO_RXQ_OVFL = 40  # Linux's asm-generic/socket.h: ancillary count of datagrams dropped so far


@dataclass
class LogRows:
    """The samples of a log, at full speed or in real time."""

    log: Log
    is_real_time: bool = False
    first: int = 0  # index of the sample from which real time counts

    def __iter__(self) -> Iterator[Row | None]:
        """Yield the samples, and None at intervals while waiting for the next one."""
        elapsed, first, origin = self.log.elapsed, -1, 0.0
        for k, row in enumerate(rows_of(self.log)):
            if self.is_real_time and k >= self.first:
                if first != self.first:
                    first, origin = self.first, time.monotonic() - elapsed[k]
                while (pause := origin + elapsed[k] - time.monotonic()) > 0.0:
                    time.sleep(min(pause, POLL_INTERVAL))
                    yield None
            yield row

    def skip_to(self, first: int) -> None:
        """Yield the samples before ``first`` without waiting."""
        self.first = first


def line_reader(descriptor: int = 0) -> Callable[[BoundedQueue[Row]], None]:
    """Return a reader of JSON lines or a canonical CSV, from standard input by default."""

    def read_lines(queue: BoundedQueue[Row]) -> None:
        parse, buffer = LineParser(), b""
        # Python's own buffer would be locked by this thread when the program ends.
        while chunk := os.read(descriptor, CHUNK_SIZE):
            *lines, buffer = (buffer + chunk).split(b"\n")
            if len(buffer) > MAX_LINE_LENGTH:
                lines, buffer = [*lines, buffer], b""
            for line in lines:
                if (row := parse(line)) is not None:
                    queue.put(row)
        if (row := parse(buffer)) is not None:
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
        return {name: _parse_cell(cell) for name, cell in zip(self.header, cells, strict=True)}


def parse_json(text: str | bytes) -> Row:
    """Return the row of a JSON object."""
    try:
        content: Any = json.loads(text)
    except (ValueError, RecursionError):
        return UNREADABLE
    return content if isinstance(content, dict) else UNREADABLE


def _parse_cell(text: str) -> float | str:
    try:
        return float(text) if text else float("nan")
    except ValueError:
        return text


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
    """A UDP socket that counts, on Linux, the datagrams the kernel drops."""

    def __init__(self, receiver: socket.socket) -> None:
        self.socket, self.n_kernel_drops = receiver, 0
        receiver.settimeout(POLL_INTERVAL)
        if sys.platform == "linux":
            with suppress(OSError):
                receiver.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)

    def receive(self, queue: BoundedQueue[Any]) -> Iterator[bytes]:
        """Yield datagrams until the queue is cancelled, and close the socket."""
        with self.socket:
            while not queue.is_cancelled:
                with suppress(TimeoutError, ConnectionResetError):  # Windows reports ICMP like this
                    yield self._receive_one()

    def _receive_one(self) -> bytes:
        if sys.platform != "linux":
            return self.socket.recv(MAX_DATAGRAM_SIZE)
        data, ancillary, *_ = self.socket.recvmsg(MAX_DATAGRAM_SIZE, socket.CMSG_SPACE(4))
        for level, kind, count in ancillary:
            if (level, kind) == (socket.SOL_SOCKET, SO_RXQ_OVFL):
                self.n_kernel_drops = int.from_bytes(count[:4], sys.byteorder)
        return data


def datagram_reader(datagrams: DatagramSocket) -> Callable[[BoundedQueue[Row]], None]:
    """Return a reader of JSON objects from datagrams, one or several lines in each."""

    def read_datagrams(queue: BoundedQueue[Row]) -> None:
        for data in datagrams.receive(queue):
            for line in data.splitlines():
                if line.strip():
                    queue.put(parse_json(line))

    return read_datagrams


def packet_reader(
    datagrams: DatagramSocket, decoder: Decoder
) -> Callable[[BoundedQueue[Message]], None]:
    """Return a reader of MAVLink from datagrams, one or several packets in each."""

    def read_packets(queue: BoundedQueue[Message]) -> None:
        for data in datagrams.receive(queue):
            now = time.time()
            for packet in split_packets(data):
                try:
                    decoded = decoder(packet)
                except ValueError:
                    queue.put(UNREADABLE_MESSAGE)
                else:
                    if decoded is not None:
                        queue.put(Message(decoded.topic, now, decoded.fields, decoded.units))

    return read_packets


@dataclass(frozen=True)
class Source:
    """The samples of a source, and the counts of what did not become samples."""

    rows: Iterable[Row | None]
    counts: Callable[[], dict[str, int]] = lambda: {"dropped": 0}
    log: Log | None = None
    close: Callable[[], None] = lambda: None
    skip_to: Callable[[int], None] = lambda first: None  # samples before it are in the checkpoint


def open_source(
    address: str,
    mapping: str | Path | None,
    *,
    allow_remote: bool,
    real_time: bool,
    on_message: Callable[[str], None],
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
        log_rows = LogRows(log, real_time)
        return Source(log_rows, log=log, skip_to=log_rows.skip_to)
    synchroniser = None
    if mapping is not None:
        stream = stream_mapping(read_mapping(mapping), on_message)
        synchroniser = MessageSynchroniser(stream, on_message)
    elif kind in PRESETS:
        raise ProblemError(
            f"`--source {address}` needs `--mapping`, which assigns fields to channels: a file,"
            f" or a preset such as {PRESETS[kind]}."
        )
    queue, datagrams = BoundedQueue[Any](blocks_when_full=kind == "stdin"), None
    decoder = _open_decoder(address) if kind == "mavlink" else None
    if kind in ("udp", "mavlink"):
        datagrams = DatagramSocket(bind_socket(address, allow_remote))
        on_message("listening at {}, port {}".format(*datagrams.socket.getsockname()[:2]))
    reader: Callable[[BoundedQueue[Any]], None]
    if kind == "ros2" and synchroniser is not None:
        reader = _open_ros(synchroniser)
    elif datagrams is None:
        reader = line_reader()
    else:
        reader = packet_reader(datagrams, decoder) if decoder else datagram_reader(datagrams)
    queue.start_reader(reader)

    def counts() -> dict[str, int]:
        n = {"dropped": queue.dropped}
        n |= {"kernel drops": datagrams.n_kernel_drops} if datagrams else {}
        return n | ({"passed over": synchroniser.n_discarded} if synchroniser else {})

    rows: Iterable[Row | None] = queue
    if synchroniser is not None:
        rows = synchroniser.synchronise(queue if kind in PRESETS else map(_to_message, queue))
    return Source(rows, counts, close=queue.cancel)


def _open_ros(synchroniser: MessageSynchroniser) -> Callable[[BoundedQueue[Message]], None]:
    try:
        from hydrodamp.live.ros import topic_reader

        return topic_reader(synchroniser.accepts)
    except ModuleNotFoundError as error:
        raise ProblemError(
            "ROS 2 needs rclpy, which is not installed: source the setup file of ROS first."
        ) from error


def _open_decoder(address: str) -> Decoder:
    system = parse_qs(urlsplit(address).query).get("system", [""])[0]
    if system and not system.isdecimal():
        raise ProblemError(f"`system` of `--source {address}` must be a number; got '{system}'.")
    try:
        return Decoder(int(system) if system else None)
    except ModuleNotFoundError as error:
        raise ProblemError(
            'MAVLink needs pymavlink, which is not installed: pip install "hydrodamp[live]"'
        ) from error


def _to_message(row: Row | None) -> Message | None:
    """Return a JSON object as a message of its `topic`; that of a table where it has none."""
    if row is None:
        return None
    fields = {name: read_number(row, name) for name in row if name != "topic"}
    return Message(str(row.get("topic", "")), time.time(), fields)
