"""MAVLink packets decoded by pymavlink, and telemetry logs (``.tlog``) of stamped packets.

A packet counts only with a valid CRC; after damage the reader resynchronises at the next one.
"""

from __future__ import annotations

import math
import re
import struct
from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.content import read_bytes
from hydrodamp.progress import Step, progress

_TIMESTAMP_BYTES = 8  # big-endian microseconds since 1970, before each packet of a .tlog
_OVERHEAD_BYTES = {0xFE: 8, 0xFD: 12}  # header and CRC, by start byte
_SIGNATURE_BYTES = 13  # present where bit 0 of the third byte is set
_AUTOPILOT_COMPONENT = 1  # component number of the autopilot
_SERVO_CLOCK_PERIOD_US = 2.0**32  # time_usec of SERVO_OUTPUT_RAW wraps after it
# mavlink.io, "invalid".
_INVALID_VALUES = {"int16_t": 2**15 - 1, "uint16_t": 2**16 - 1, "int32_t": 2**31 - 1}
# A timestamp of the years 2005 to 2041, followed by a start byte.
_PACKET_START = re.compile(rb"(?=\0[\4-\7].{6}[\xfd\xfe])", re.DOTALL)
_MAX_DISORDER_STEPS = (
    10  # median steps; a larger deviation from the previous and the next stamp is damage
)


class MavlinkFields(NamedTuple):
    """Numeric fields of one message, and their units by the MAVLink definition."""

    topic: str
    fields: dict[str, float]
    units: Mapping[str, str]


class Decoder:
    """Decodes the packets of one vehicle's autopilot."""

    def __init__(self, system: int | None = None) -> None:
        """Decode the messages of a system number; by default, of the first autopilot received."""
        from pymavlink.dialects.v20 import all as dialect

        self.system, self._boot = system, 0.0
        self._link, self._failure = dialect.MAVLink(None), dialect.MAVError
        self._unknown = dialect.MAVLink_unknown

    def parse(self, packet: bytes) -> Any:
        """Return the message of a packet; None for an unknown message type.

        Raises ValueError for an invalid packet.
        """
        try:
            message = self._link.decode(bytearray(packet))
        except (self._failure, LookupError, struct.error) as error:
            raise ValueError(str(error)) from error
        return None if isinstance(message, self._unknown) else message

    def __call__(self, packet: bytes) -> MavlinkFields | None:
        """Return the fields of a packet; None for another sender or an unknown type."""
        message = self.parse(packet)
        return None if message is None else self.decode_message(message)

    def decode_message(self, message: Any) -> MavlinkFields | None:
        """Return the fields of a message; None for another sender."""
        if message.get_srcComponent() != _AUTOPILOT_COMPONENT:
            return None
        if self.system is None:
            self.system = message.get_srcSystem()
        return self._to_fields(message) if message.get_srcSystem() == self.system else None

    def _to_fields(self, message: Any) -> MavlinkFields:
        fields = dict(_numbers(message))
        topic = message.get_type()
        if topic in ("NAMED_VALUE_FLOAT", "NAMED_VALUE_INT"):
            topic = f"{topic}[{message.name}]"
        if "time_boot_ms" in fields:
            self._boot = 1000.0 * fields["time_boot_ms"]
        if topic == "SERVO_OUTPUT_RAW":
            turns = round((self._boot - fields["time_usec"]) / _SERVO_CLOCK_PERIOD_US)
            fields["time_usec"] += _SERVO_CLOCK_PERIOD_US * max(turns, 0)
        return MavlinkFields(topic, fields, message.fieldunits_by_name)


def _numbers(message: Any) -> Iterator[tuple[str, float]]:
    """Yield the numbers of a message; NaN for the integers that encode "invalid"."""
    for name, kind in zip(message.fieldnames, message.fieldtypes, strict=True):
        value, unknown = getattr(message, name), _INVALID_VALUES.get(kind)
        if isinstance(value, int | float):
            yield name, math.nan if value == unknown else float(value)
        elif isinstance(value, list):
            for index, element in enumerate(value):
                yield f"{name}[{index}]", math.nan if element == unknown else float(element)


def split_packets(data: bytes) -> Iterator[bytes]:
    """Yield the packets of a datagram; the last one holds any bytes that are no packet."""
    start = 0
    while start < len(data):
        end = _end_of_packet(data, start)
        yield data[start:end]
        if end is None:
            return
        start = end


def _end_of_packet(data: bytes, start: int) -> int | None:
    """Return the end offset of the packet at an offset by its header; None for no packet."""
    overhead = _OVERHEAD_BYTES.get(data[start]) if start + 3 <= len(data) else None
    if overhead is None:
        return None
    is_signed = overhead == 12 and data[start + 2] & 1
    return start + overhead + data[start + 1] + (_SIGNATURE_BYTES if is_signed else 0)


class _Packets:
    """Complete packets of a telemetry log, and the count of damaged bytes."""

    def __init__(self, data: bytes, decoder: Decoder, step: Step) -> None:
        self.data, self.decoder, self.step = data, decoder, step
        self.n_damaged = self.first_damaged = self.n_unknown = 0

    def __iter__(self) -> Iterator[tuple[float, MavlinkFields | None]]:
        """Yield timestamps [us] and messages; resynchronise after damage."""
        start = 0
        while start < len(self.data):
            end, message = self._parse(start)
            if message is not None:
                stamp = float(int.from_bytes(self.data[start : start + _TIMESTAMP_BYTES]))
                yield stamp, self.decoder.decode_message(message)
            # The CRC of an unknown type cannot be checked; a packet that follows confirms it.
            elif end and (end == len(self.data) or _PACKET_START.match(self.data, end)):
                self.n_unknown += 1
            else:
                starts = (match.start() for match in _PACKET_START.finditer(self.data, start + 1))
                valid = (k for k in starts if self._parse(k)[1] is not None)
                end = next(valid, len(self.data))
                self.first_damaged = self.first_damaged if self.n_damaged else start
                self.n_damaged += end - start
            self.step(end - start)
            start = end

    def _parse(self, start: int) -> tuple[int, Any]:
        """Return end offset (0 for no packet) and message (None for an unknown type)."""
        end = self._end(start)
        try:
            packet = self.data[start + _TIMESTAMP_BYTES : end]
            return end, self.decoder.parse(packet) if end else None
        except ValueError:
            return 0, None

    def _end(self, start: int) -> int:
        """Return the end offset of a stamped packet by its header; 0 for no complete packet."""
        if not _PACKET_START.match(self.data, start):
            return 0
        end = _end_of_packet(self.data, start + _TIMESTAMP_BYTES) or 0
        return end if end <= len(self.data) else 0


def _are_timestamps_consistent(stamps: FloatArray) -> BoolArray:
    """Return which timestamps agree with adjacent ones; the CRC does not cover timestamps."""
    consistent = np.ones(len(stamps), dtype=np.bool_)
    if len(stamps) < 3:
        return consistent
    before, stamp, after = stamps[:-2], stamps[1:-1], stamps[2:]
    tolerance = _MAX_DISORDER_STEPS * np.median(np.abs(np.diff(stamps)))
    low, high = np.minimum(before, after) - tolerance, np.maximum(before, after) + tolerance
    consistent[1:-1] = (low <= stamp) & (stamp <= high) | (np.abs(after - before) > tolerance)
    return consistent


def read_file(path: str | Path) -> Recording:
    """Read the messages of the first autopilot in a telemetry log."""
    data, decoder, n_foreign = read_bytes(path), Decoder(), 0
    messages: list[tuple[float, MavlinkFields]] = []
    with progress(f"reading {Path(path).name}", len(data)) as step:
        packets = _Packets(data, decoder, step)
        for stamp, message in packets:
            if message is None:
                n_foreign += 1
            else:
                messages.append((stamp / 1e6, message))
    if not messages:
        raise LogError("the log holds no message of an autopilot (component 1)", source=str(path))
    in_order = _are_timestamps_consistent(np.array([1e6 * time for time, _ in messages]))
    by_topic: dict[str, list[tuple[float, MavlinkFields]]] = defaultdict(list)
    for stamped, keep in zip(messages, in_order.tolist(), strict=True):
        if keep:
            by_topic[stamped[1].topic].append(stamped)
    n_inconsistent = int(np.count_nonzero(~in_order))
    notes = {
        f"{packets.n_damaged} of {len(data)} bytes are damaged, the first at byte"
        f" {packets.first_damaged}; their packets were skipped": packets.n_damaged,
        f"{n_inconsistent} packets have a timestamp inconsistent with adjacent ones; skipped": (
            n_inconsistent
        ),
        f"{packets.n_unknown} packets have an unknown message type; skipped": packets.n_unknown,
        f"{n_foreign} messages come from other senders than the autopilot; skipped": n_foreign,
    }
    topics = tuple(make_topic(name, group) for name, group in by_topic.items())
    return Recording(topics, str(path), "MAVLink log", tuple(filter(notes.get, notes)))


def make_topic(name: str, messages: list[tuple[float, MavlinkFields]]) -> Topic:
    """Return messages of one type, with their times of reception [s], as a topic."""
    names = dict.fromkeys(name for _, message in messages for name in message.fields)
    columns = {
        name: np.array([message.fields.get(name, np.nan) for _, message in messages])
        for name in names
    }
    units = {name: unit for name, unit in messages[0][1].units.items() if name in names}
    return Topic(name, np.array([time for time, _ in messages]), columns, units=units)
