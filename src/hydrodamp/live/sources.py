"""Where samples come from: a log, standard input, datagrams; each a stream of rows or messages."""

from __future__ import annotations

import csv
import json
import os
import queue
import socket
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar
from urllib.parse import urlsplit

from hydrodamp.data.log import Log
from hydrodamp.errors import ProblemError
from hydrodamp.ingest.formats.mavlink import Decoder, packets
from hydrodamp.live.gathering import Message
from hydrodamp.live.rows import Row, rows_of

Item = TypeVar("Item")

#: A row that could not be read; it has no time.
UNREADABLE: Row = {}

#: A message that could not be read.
NO_MESSAGE = Message("", 0.0, {})

_WAIT = 0.2  # s, after which a source that has nothing says so
_END = 5.0  # s
_PAUSE = 0.01  # s, in which a reader waits for room
_ROOM = 10_000  # rows that may wait
_DATAGRAM = 8192  # bytes; of a larger one what stands behind them is lost
_CHUNK, _LONGEST = 1 << 16, 1 << 20  # bytes of a reading, and of a line


@dataclass
class Waiting(Generic[Item]):
    """What a thread has read and nobody has taken yet: a bounded queue, drops counted."""

    keeps_all: bool = False  # the reader waits where there is no room
    dropped: int = 0
    is_over: bool = False  # nobody waits any more
    thread: threading.Thread | None = None
    items: queue.SimpleQueue[Item | None] = field(default_factory=queue.SimpleQueue)

    def put(self, item: Item | None) -> None:
        """Add a row or a message; None ends the stream."""
        while self.keeps_all and self.items.qsize() >= _ROOM:
            time.sleep(_PAUSE)
        if item is None or self.items.qsize() < _ROOM:
            self.items.put(item)
        else:
            self.dropped += 1

    def __iter__(self) -> Iterator[Item | None]:
        """Yield what was read, and None where there was nothing for a while."""
        while True:
            try:
                item = self.items.get(timeout=_WAIT)
            except queue.Empty:
                yield None
                continue
            if item is None:
                return
            yield item

    def fed_by(self, read: Callable[[Waiting[Item]], None]) -> Waiting[Item]:
        """Start a thread that reads; its end is the stream's."""

        def run() -> None:
            try:
                read(self)
            finally:
                self.put(None)

        self.thread = threading.Thread(target=run, daemon=True)
        self.thread.start()
        return self

    def end(self) -> None:
        """Tell the reader that it may end, and wait until it has."""
        self.is_over = True
        if self.thread is not None:
            self.thread.join(_END)


def of_log(log: Log, paced: bool = False) -> Iterator[Row]:
    """Yield the samples of a log, as fast as they are taken or at their own pace."""
    begun, elapsed = time.monotonic(), log.elapsed
    for k, row in enumerate(rows_of(log)):
        if paced:
            time.sleep(max(0.0, begun + elapsed[k] - time.monotonic()))
        yield row


def of_lines(descriptor: int = 0) -> Callable[[Waiting[Row]], None]:
    """Return what reads JSON lines or a canonical CSV, from standard input by default."""

    def read(waiting: Waiting[Row]) -> None:
        row_of, rest = Lines(), b""
        # Python's own buffer would be locked by this thread when the program ends.
        while chunk := os.read(descriptor, _CHUNK):
            *lines, rest = (rest + chunk).split(b"\n")
            if len(rest) > _LONGEST:
                lines, rest = [*lines, rest], b""
            for line in lines:
                if (row := row_of(line)) is not None:
                    waiting.put(row)
        if (row := row_of(rest)) is not None:
            waiting.put(row)

    return read


class Lines:
    """Turns lines into rows: JSON objects, or a header and what stands below it."""

    header: list[str] | None = None

    def __call__(self, line: bytes) -> Row | None:
        """Return the row of a line; None where it holds none, such as a header."""
        text = line.decode("utf-8-sig", "replace").strip()
        if not text or text.startswith("#"):
            return None
        if text.startswith("{"):
            return from_json(text)
        try:
            cells = next(csv.reader([text]))
        except csv.Error:
            return UNREADABLE
        if "time" in cells:
            self.header = [cell.strip() for cell in cells]
            return None
        if self.header is None or len(cells) != len(self.header):
            return UNREADABLE
        return {name: _cell(cell) for name, cell in zip(self.header, cells, strict=True)}


def from_json(text: str | bytes) -> Row:
    """Return the row of a JSON object."""
    try:
        content: Any = json.loads(text)
    except (ValueError, RecursionError):
        return UNREADABLE
    return content if isinstance(content, dict) else UNREADABLE


def _cell(text: str) -> float | str:
    try:
        return float(text) if text else float("nan")
    except ValueError:
        return text


def bound_socket(address: str, allow: bool) -> socket.socket:
    """Return the socket of an address, open to this machine alone unless allowed."""
    parts = urlsplit(address)
    kind = parts.scheme
    try:
        host, port = parts.hostname or "127.0.0.1", parts.port
    except ValueError:
        port = None
    if port is None:
        raise ProblemError(
            f"`--source {address}` must be {kind}://HOST:PORT, such as {kind}://:14660."
        )
    check_host(host, allow)
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    one = socket.socket(family, socket.SOCK_DGRAM)
    one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
    try:
        one.bind((host, port))
    except OSError as error:
        one.close()
        raise ProblemError(f"`--source {address}` cannot be bound: {error.strerror}.") from error
    return one


def check_host(host: str, allow: bool) -> None:
    """Refuse an address that others on the network reach."""
    if not allow and host not in ("127.0.0.1", "::1", "localhost"):
        raise ProblemError(
            f"{host} is no address of this machine alone: whoever reaches it can send samples, "
            "without a password, and so spoil the estimate. Say `--allow` if only those whom you "
            "trust can reach it, or bind to 127.0.0.1."
        )


def of_datagrams(one: socket.socket) -> Callable[[Waiting[Row]], None]:
    """Return what reads JSON objects from datagrams, one or several lines in each."""

    def read(waiting: Waiting[Row]) -> None:
        while True:
            for line in one.recv(_DATAGRAM).splitlines():
                waiting.put(from_json(line))

    return read


def of_packets(one: socket.socket, decoder: Decoder) -> Callable[[Waiting[Message]], None]:
    """Return what reads MAVLink from datagrams, one or several packets in each."""

    def read(waiting: Waiting[Message]) -> None:
        while True:
            data, now = one.recv(_DATAGRAM), time.time()
            for packet in packets(data):
                try:
                    sent = decoder(packet)
                except ValueError:
                    waiting.put(NO_MESSAGE)
                else:
                    if sent is not None:
                        waiting.put(Message(sent.topic, now, sent.fields, sent.units))

    return read
