"""MAVLink: packets as the fields of messages, and telemetry logs (``.tlog``) of them."""

from __future__ import annotations

import math
import re
import struct
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.content import content
from hydrodamp.progress import Step, progress

_STAMP = 8  # bytes, microseconds since 1970, before each packet of a telemetry log
_OVERHEAD = {0xFE: 8, 0xFD: 12}  # bytes of a packet besides its payload, by how it begins
_SIGNATURE = 13  # bytes, where the first flag of the third byte says so
_AUTOPILOT = 1  # number of the component
_TURN = 2.0**32  # microseconds, after which the clock of servo outputs begins anew
_UNKNOWN = {
    "int16_t": 2**15 - 1,
    "uint16_t": 2**16 - 1,
    "int32_t": 2**31 - 1,
}  # mavlink.io, "invalid"
# A stamp of the years 2005 to 2041, and how a packet begins.
_STAMPED = re.compile(rb"\0[\4-\7].{6}[\xfd\xfe]", re.DOTALL)
_STAMPED_ANYWHERE = re.compile(rb"(?=\0[\4-\7].{6}[\xfd\xfe])", re.DOTALL)
_STAMP_REACH = 10  # median steps between packets, by which a stamp may precede its neighbours


class Sent(NamedTuple):
    """What one message says: numbers by their names, and the units that MAVLink states."""

    topic: str
    fields: dict[str, float]
    units: Mapping[str, str]


class Decoder:
    """Turns packets of one vehicle's autopilot into what they say."""

    def __init__(self, system: int | None = None) -> None:
        """Listen to a system by its number; to the first autopilot that speaks by default."""
        from pymavlink.dialects.v20 import all as dialect

        self.system, self._boot = system, 0.0
        self._link, self._failure = dialect.MAVLink(None), dialect.MAVError
        self._unknown = dialect.MAVLink_unknown

    def message(self, packet: bytes) -> Any:
        """Return the message of a packet with a valid CRC, None for one that no dialect defines.

        Raises ValueError for any other.
        """
        try:
            message = self._link.decode(bytearray(packet))
        except (self._failure, LookupError, struct.error) as error:
            raise ValueError(str(error)) from error
        return None if isinstance(message, self._unknown) else message

    def __call__(self, packet: bytes) -> Sent | None:
        """Return what a packet says, None for one of somebody else; or raise ValueError."""
        message = self.message(packet)
        return None if message is None else self.sent(message)

    def sent(self, message: Any) -> Sent | None:
        """Return what a message says, None for one of somebody else."""
        if message.get_srcComponent() != _AUTOPILOT:
            return None
        if self.system is None:
            self.system = message.get_srcSystem()
        return self._sent(message) if message.get_srcSystem() == self.system else None

    def _sent(self, message: Any) -> Sent:
        fields = dict(_numbers(message))
        topic = message.get_type()
        if topic in ("NAMED_VALUE_FLOAT", "NAMED_VALUE_INT"):
            topic = f"{topic}[{message.name}]"
        if "time_boot_ms" in fields:
            self._boot = 1000.0 * fields["time_boot_ms"]
        if topic == "SERVO_OUTPUT_RAW":
            turns = round((self._boot - fields["time_usec"]) / _TURN)
            fields["time_usec"] += _TURN * max(turns, 0)
        return Sent(topic, fields, message.fieldunits_by_name)


def _numbers(message: Any) -> Iterator[tuple[str, float]]:
    """Yield the numbers of a message; NaN for the integers that stand for "unknown"."""
    for name, kind in zip(message.fieldnames, message.fieldtypes, strict=True):
        value, unknown = getattr(message, name), _UNKNOWN.get(kind)
        if isinstance(value, int | float):
            yield name, math.nan if value == unknown else float(value)
        elif isinstance(value, list):
            for index, element in enumerate(value):
                yield f"{name}[{index}]", math.nan if element == unknown else float(element)


def packets(data: bytes) -> Iterator[bytes]:
    """Yield the packets of a datagram; at last what begins as none."""
    start = 0
    while start < len(data):
        end = _end_of_packet(data, start)
        yield data[start:end]
        if end is None:
            return
        start = end


def _end_of_packet(data: bytes, start: int) -> int | None:
    """Return where the packet at a place ends by its header; None where none begins."""
    overhead = _OVERHEAD.get(data[start]) if start + 3 <= len(data) else None
    if overhead is None:
        return None
    is_signed = overhead == 12 and data[start + 2] & 1
    return start + overhead + data[start + 1] + (_SIGNATURE if is_signed else 0)


class _Packets:
    """The packets of a telemetry log that are whole, and the bytes that belong to none."""

    def __init__(self, data: bytes, decoder: Decoder, step: Step) -> None:
        self.data, self.decoder, self.step = data, decoder, step
        self.n_damaged = self.first_damaged = self.n_unknown = 0

    def __iter__(self) -> Iterator[tuple[float, Sent | None]]:
        """Yield stamps [us] and messages; after damage go on at the next packet with a CRC."""
        start = 0
        while start < len(self.data):
            end, is_whole, sent = self._decode(start)
            if is_whole:
                yield float(int.from_bytes(self.data[start : start + _STAMP])), sent
            elif not end:
                end = self._resynchronise(start)
                self.first_damaged = self.first_damaged if self.n_damaged else start
                self.n_damaged += end - start
            self.step(end - start)
            start = end

    def _decode(self, start: int) -> tuple[int, bool, Sent | None]:
        """Return where a packet ends, 0 for none; whether it has a valid CRC; and what it says."""
        end = self._end(start)
        if not end:
            return 0, False, None
        try:
            message = self.decoder.message(self.data[start + _STAMP : end])
        except ValueError:
            return 0, False, None
        if message is not None:
            return end, True, self.decoder.sent(message)
        # Without a definition there is no CRC to compute: what follows vouches for the length.
        if end < len(self.data) and not _STAMPED.match(self.data, end):
            return 0, False, None
        self.n_unknown += 1
        return end, False, None

    def _end(self, start: int) -> int:
        """Return where a stamped packet ends by its header, 0 where none is whole."""
        if not _STAMPED.match(self.data, start):
            return 0
        end = _end_of_packet(self.data, start + _STAMP) or 0
        return end if end <= len(self.data) else 0

    def _resynchronise(self, start: int) -> int:
        """Return where the next packet with a valid CRC begins after a damaged one."""
        for found in _STAMPED_ANYWHERE.finditer(self.data, start + 1):
            end = self._end(found.start())
            with suppress(ValueError):
                if end and self.decoder.message(self.data[found.start() + _STAMP : end]):
                    return found.start()
        return len(self.data)


def _are_stamps_in_order(stamps: FloatArray) -> BoolArray:
    """Return which stamps fit those before and after them; damage in a stamp has no CRC."""
    fit = np.ones(len(stamps), dtype=np.bool_)
    if len(stamps) < 3:
        return fit
    before, stamp, after = stamps[:-2], stamps[1:-1], stamps[2:]
    reach = _STAMP_REACH * np.median(np.abs(np.diff(stamps)))
    low, high = np.minimum(before, after) - reach, np.maximum(before, after) + reach
    fit[1:-1] = (low <= stamp) & (stamp <= high) | (np.abs(after - before) > reach)
    return fit


def read(path: str | Path) -> Recording:
    """Read a telemetry log: what the first autopilot in it says."""
    data, decoder, foreign = content(path), Decoder(), 0
    messages: list[tuple[float, Sent]] = []
    with progress(f"reading {Path(path).name}", len(data)) as step:
        found = _Packets(data, decoder, step)
        for stamp, sent in found:
            if sent is None:
                foreign += 1
            else:
                messages.append((stamp / 1e6, sent))
    if not messages:
        raise LogError("the log holds no message of an autopilot", source=str(path))
    is_kept = _are_stamps_in_order(np.array([1e6 * time for time, _ in messages]))
    by_topic: dict[str, list[tuple[float, Sent]]] = defaultdict(list)
    for message, keep in zip(messages, is_kept.tolist(), strict=True):
        if keep:
            by_topic[message[1].topic].append(message)
    notes = []
    if found.n_damaged:
        notes.append(
            f"{found.n_damaged} of {len(data)} bytes are damaged, the first at byte"
            f" {found.first_damaged}; the packets that they belong to were left out"
        )
    if odd := int(np.count_nonzero(~is_kept)):
        notes.append(f"{odd} packets carry a time that contradicts their neighbours; left out")
    if found.n_unknown:
        notes.append(f"{found.n_unknown} packets are of messages that no dialect defines; left out")
    notes += [f"{foreign} messages are of others than the autopilot; left out"] if foreign else []
    topics = tuple(topic_of(name, each) for name, each in by_topic.items())
    return Recording(topics, str(path), "MAVLink log", tuple(notes))


def topic_of(name: str, messages: list[tuple[float, Sent]]) -> Topic:
    """Return messages of one kind, with the times at which they were received, as a topic."""
    names = dict.fromkeys(name for _, sent in messages for name in sent.fields)
    columns = {
        name: np.array([sent.fields.get(name, np.nan) for _, sent in messages]) for name in names
    }
    units = {name: unit for name, unit in messages[0][1].units.items() if name in names}
    return Topic(name, np.array([time for time, _ in messages]), columns, units=units)
