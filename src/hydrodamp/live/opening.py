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
from hydrodamp.live.gathering import Gathering, Message, for_streams
from hydrodamp.live.rows import Row, number
from hydrodamp.live.sources import Waiting

Say = Callable[[str], None]


@dataclass(frozen=True)
class Source:
    """Samples, and what is counted besides them."""

    rows: Iterable[Row | None]
    counts: Callable[[], dict[str, int]] = lambda: {"dropped": 0}
    log: Log | None = None


def opened(
    address: str, mapping: str | Path | None, *, allow: bool, paced: bool, say: Say
) -> Source:
    """Return the samples of `stdin`, of an address or of a log."""
    kind = urlsplit(address).scheme
    if address != "stdin" and kind not in ("udp", "mavlink"):
        log = read_log(address, mapping)
        return Source(sources.of_log(log, paced), log=log)
    given = None if mapping is None else for_streams(read_mapping(mapping), say)
    if kind == "mavlink":
        return _of_mavlink(address, given, allow, say)
    rows = Waiting[Row](keeps_all=address == "stdin")
    if address == "stdin":
        rows.fed_by(sources.of_lines())
    else:
        rows.fed_by(sources.of_datagrams(_bound(address, allow, say)))
    if given is None:
        return Source(rows, lambda: {"dropped": rows.dropped})
    return _gathered(rows, map(_message, rows), given, say)


def _of_mavlink(address: str, mapping: LogMapping | None, allow: bool, say: Say) -> Source:
    if mapping is None:
        raise ProblemError(
            f"`--source {address}` needs `--mapping`, which says what is what: a file, or the"
            " preset ardusub-mavlink."
        )
    asked = parse_qs(urlsplit(address).query).get("system", [""])[0]
    if asked and not asked.isdecimal():
        raise ProblemError(f"`system` of `--source {address}` must be a number; got '{asked}'.")
    try:
        decoder = Decoder(int(asked) if asked else None)
    except ModuleNotFoundError as error:
        raise ProblemError(
            'MAVLink is read by pymavlink, which is not installed: pip install "hydrodamp[live]"'
        ) from error
    messages = Waiting[Message]()
    messages.fed_by(sources.of_packets(_bound(address, allow, say), decoder))
    return _gathered(messages, messages, mapping, say)


def _gathered(
    waiting: Waiting[Row] | Waiting[Message],
    messages: Iterable[Message | None],
    mapping: LogMapping,
    say: Say,
) -> Source:
    gathering = Gathering(mapping, say)
    return Source(
        gathering.over(messages),
        lambda: {"dropped": waiting.dropped, "passed over": gathering.passed_over},
    )


def _message(row: Row | None) -> Message | None:
    """Return an object of JSON as what its `topic` says; a table's where it names none."""
    if row is None:
        return None
    fields = {name: number(row, name) for name in row if name != "topic"}
    return Message(str(row.get("topic", "")), time.time(), fields)


def _bound(address: str, allow: bool, say: Say) -> socket.socket:
    bound = sources.bound_socket(address, allow)
    say("listening at {}, port {}".format(*bound.getsockname()))
    return bound
