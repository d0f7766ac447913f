"""MAVLink: packets as the fields of messages, and telemetry logs (``.tlog``) of them."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.content import content
from hydrodamp.progress import progress

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
_AT_ONCE = 10_000  # packets between two moves of the bar


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

    def __call__(self, packet: bytes) -> Sent | None:
        """Return what a packet says, None for one of somebody else; or raise ValueError."""
        try:
            message = self._link.decode(bytearray(packet))
        except self._failure as error:
            raise ValueError(str(error)) from error
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


def packets(data: bytes, between: int = 0) -> Iterator[bytes]:
    """Yield packets, so many bytes before each among them; at last what begins as none."""
    place = 0
    while place < len(data):
        begun = place + between
        overhead = _OVERHEAD.get(data[begun]) if begun + 3 <= len(data) else None
        if overhead is None:
            yield data[place:]
            return
        is_signed = overhead == 12 and data[begun + 2] & 1
        end = begun + overhead + data[begun + 1] + (_SIGNATURE if is_signed else 0)
        yield data[place:end]
        place = end


def read(path: str | Path) -> Recording:
    """Read a telemetry log: what the first autopilot in it says."""
    data, decoder, broken, foreign = content(path), Decoder(), 0, 0
    said: dict[str, list[tuple[float, Sent]]] = defaultdict(list)
    with progress(f"reading {Path(path).name}", len(data)) as step:
        for packet in packets(data, _STAMP):
            step(len(packet))
            try:
                sent = decoder(packet[_STAMP:])
            except ValueError:
                broken += 1
                continue
            if sent is None:
                foreign += 1
            else:
                said[sent.topic].append((int.from_bytes(packet[:_STAMP]) / 1e6, sent))
    if not said:
        raise LogError("the log holds no message of an autopilot", source=str(path))
    notes = [f"{broken} packets are damaged; left out"] if broken else []
    notes += [f"{foreign} messages are of others than the autopilot; left out"] if foreign else []
    topics = tuple(topic_of(name, messages) for name, messages in said.items())
    return Recording(topics, str(path), "MAVLink log", tuple(notes))


def topic_of(name: str, messages: list[tuple[float, Sent]]) -> Topic:
    """Return messages of one kind, with the times at which they were received, as a topic."""
    names = dict.fromkeys(name for _, sent in messages for name in sent.fields)
    columns = {
        name: np.array([sent.fields.get(name, np.nan) for _, sent in messages]) for name in names
    }
    units = {name: unit for name, unit in messages[0][1].units.items() if name in names}
    return Topic(name, np.array([time for time, _ in messages]), columns, units=units)
