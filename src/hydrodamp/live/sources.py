"""Sources of a live run: a log, standard input, UDP, MAVLink or ROS 2, as an iterator of samples.

A reader thread puts rows or messages into a bounded queue; the run takes them out.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

from hydrodamp.data.log import Log
from hydrodamp.errors import ProblemError
from hydrodamp.ingest.formats.mavlink import Decoder
from hydrodamp.ingest.mapping import read_mapping
from hydrodamp.ingest.read import read_log
from hydrodamp.live.readers import (
    POLL_INTERVAL,
    BoundedQueue,
    DatagramSocket,
    bind_socket,
    line_reader,
    packet_parser,
    parse_datagram,
    topic_reader,
)
from hydrodamp.live.samples import Row, read_number, rows_of
from hydrodamp.live.synchroniser import Message, MessageSynchroniser, stream_mapping

#: Preset mappings of the sources that need one.
PRESETS = {"mavlink": "ardusub-mavlink", "ros2": "rep103-odometry"}


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
    queue = BoundedQueue[Any](blocks_when_full=kind == "stdin")
    n_lost: Callable[[], dict[str, int]] = dict
    if kind == "ros2" and synchroniser is not None:
        reader = topic_reader(synchroniser.accepts)
    elif kind == "stdin":
        reader = line_reader()
    else:
        parse = packet_parser(_open_decoder(address)) if kind == "mavlink" else parse_datagram
        datagrams = DatagramSocket(bind_socket(address, allow_remote))
        on_message("listening at {}, port {}".format(*datagrams.socket.getsockname()[:2]))
        reader, n_lost = datagrams.reader(parse), datagrams.counts
    queue.start_reader(reader)

    def counts() -> dict[str, int]:
        n = {"dropped": queue.dropped, **n_lost()}
        if kind == "mavlink":  # which distinguishes vehicles by their system
            del n["other senders"]
        return n | ({"passed over": synchroniser.n_discarded} if synchroniser else {})

    rows: Iterable[Row | None] = queue
    if synchroniser is not None:
        rows = synchroniser.synchronise(queue if kind in PRESETS else map(_to_message, queue))
    return Source(rows, counts, close=queue.cancel)


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
