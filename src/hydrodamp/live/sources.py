"""Where samples come from: a log, standard input, datagrams; each a stream of rows or messages."""

from __future__ import annotations

import csv
import json
import os
import socket
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar
from urllib.parse import urlsplit

from hydrodamp.data.log import Log
from hydrodamp.errors import ProblemError
from hydrodamp.ingest.formats.mavlink import Decoder, split_packets
from hydrodamp.live.samples import Row, rows_of
from hydrodamp.live.synchroniser import Message

Item = TypeVar("Item")

#: A row that could not be read; it has no time.
UNREADABLE: Row = {}

#: A message that could not be read.
NO_MESSAGE = Message("", 0.0, {})

_WAIT = 0.2  # s, after which a source that has nothing says so
_END = 5.0  # s
_ROOM = 10_000  # rows that may wait
_DATAGRAM = 8192  # bytes; of a larger one what stands behind them is lost
_CHUNK, _LONGEST = 1 << 16, 1 << 20  # bytes of a reading, and of a line
_SO_RXQ_OVFL = 40  # of Linux's asm-generic/socket.h: a message tells drops since the socket began


class SourceError(Exception):
    """A source that can no longer be read."""


@dataclass
class BoundedQueue(Generic[Item]):
    """What a thread has read and nobody has taken yet: a bounded queue, drops counted."""

    keeps_all: bool = False  # the reader waits where there is no room
    dropped: int = 0
    is_over: bool = False  # nobody waits any more
    has_ended: bool = False  # nothing more comes
    error: Exception | None = None  # that ended the reader
    thread: threading.Thread | None = None
    items: deque[Item] = field(default_factory=deque)
    changed: threading.Condition = field(default_factory=threading.Condition)

    def put(self, item: Item | None) -> None:
        """Add a row or a message, in place of the oldest where there is no room; None ends."""
        with self.changed:
            while self.keeps_all and len(self.items) >= _ROOM and not self.is_over:
                self.changed.wait(_WAIT)
            if item is None:
                self.has_ended = True
            else:
                if len(self.items) >= _ROOM:
                    self.items.popleft()
                    self.dropped += 1
                self.items.append(item)
            self.changed.notify_all()

    def __iter__(self) -> Iterator[Item | None]:
        """Yield what was read, and None where there was nothing for a while."""
        while True:
            with self.changed:
                if not self.items and not self.has_ended:
                    self.changed.wait(_WAIT)
                item = self.items.popleft() if self.items else None
                if item is None and self.has_ended:
                    break
                if len(self.items) == _ROOM - 1:
                    self.changed.notify_all()
            yield item
        if self.error is not None:
            text = f"{type(self.error).__name__}: {self.error}"
            raise SourceError(f"the source can no longer be read: {text}") from self.error

    def start_reader(self, read: Callable[[BoundedQueue[Item]], None]) -> BoundedQueue[Item]:
        """Start a thread that reads; its end is the stream's, and so is its error."""

        def run() -> None:
            try:
                read(self)
            except Exception as error:
                self.error = error
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


@dataclass
class LogRows:
    """The samples of a log, as fast as they are taken or at their own pace."""

    log: Log
    is_paced: bool = False
    first: int = 0  # the pace begins here; samples before it are passed over at once

    def __iter__(self) -> Iterator[Row | None]:
        """Yield samples, and None now and then in a pause between two."""
        elapsed, first, begun = self.log.elapsed, -1, 0.0
        for k, row in enumerate(rows_of(self.log)):
            if self.is_paced and k >= self.first:
                if first != self.first:
                    first, begun = self.first, time.monotonic() - elapsed[k]
                while (pause := begun + elapsed[k] - time.monotonic()) > 0.0:
                    time.sleep(min(pause, _WAIT))
                    yield None
            yield row

    def skip_to(self, first: int) -> None:
        """Let the pace begin at a sample."""
        self.first = first


def of_lines(descriptor: int = 0) -> Callable[[BoundedQueue[Row]], None]:
    """Return what reads JSON lines or a canonical CSV, from standard input by default."""

    def read(waiting: BoundedQueue[Row]) -> None:
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


class Datagrams:
    """Datagrams of a socket until nobody waits any more; then it is closed."""

    def __init__(self, one: socket.socket) -> None:
        """Ask the kernel to tell how many datagrams it drops."""
        self.socket, self.lost = one, 0
        one.settimeout(_WAIT)
        if sys.platform == "linux":
            with suppress(OSError):
                one.setsockopt(socket.SOL_SOCKET, _SO_RXQ_OVFL, 1)

    def until_over(self, waiting: BoundedQueue[Any]) -> Iterator[bytes]:
        """Yield what arrives."""
        with self.socket:
            while not waiting.is_over:
                with suppress(TimeoutError, ConnectionResetError):  # Windows tells of ICMP so
                    yield self._received()

    def _received(self) -> bytes:
        if sys.platform != "linux":
            return self.socket.recv(_DATAGRAM)
        data, ancillary, *_ = self.socket.recvmsg(_DATAGRAM, socket.CMSG_SPACE(4))
        for level, kind, count in ancillary:
            if (level, kind) == (socket.SOL_SOCKET, _SO_RXQ_OVFL):
                self.lost = int.from_bytes(count[:4], sys.byteorder)
        return data


def of_datagrams(datagrams: Datagrams) -> Callable[[BoundedQueue[Row]], None]:
    """Return what reads JSON objects from datagrams, one or several lines in each."""

    def read(waiting: BoundedQueue[Row]) -> None:
        for data in datagrams.until_over(waiting):
            for line in data.splitlines():
                if line.strip():
                    waiting.put(from_json(line))

    return read


def of_packets(datagrams: Datagrams, decoder: Decoder) -> Callable[[BoundedQueue[Message]], None]:
    """Return what reads MAVLink from datagrams, one or several packets in each."""

    def read(waiting: BoundedQueue[Message]) -> None:
        for data in datagrams.until_over(waiting):
            now = time.time()
            for packet in split_packets(data):
                try:
                    sent = decoder(packet)
                except ValueError:
                    waiting.put(NO_MESSAGE)
                else:
                    if sent is not None:
                        waiting.put(Message(sent.topic, now, sent.fields, sent.units))

    return read
