"""Files of every format, written by the programs other people write them with."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

Write = Callable[..., Path]


class Dataflash:
    """An ArduPilot log made of messages that pymavlink packs."""

    def __init__(self) -> None:
        self.reader = pytest.importorskip("pymavlink.DFReader")
        self.formats: dict[str, Any] = {}
        self.content = bytearray()
        about = self.reader.DFFormat(128, "FMT", 89, "BBnNZ", "Type,Length,Name,Format,Columns")
        self.formats["FMT"] = about
        self.put("FMT", 128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns")

    def define(self, kind: int, name: str, letters: str, columns: str) -> None:
        sizes = "".join(self.reader.FORMAT_TO_STRUCT[letter][0] for letter in letters)
        length = 3 + struct.calcsize("<" + sizes)
        self.formats[name] = self.reader.DFFormat(kind, name, length, letters, columns)
        self.put("FMT", kind, length, name.encode(), letters.encode(), columns.encode())

    def put(self, name: str, *values: object) -> None:
        message = self.reader.DFMessage(self.formats[name], list(values), True, None)
        packed = message.get_msgbuf()
        assert packed is not None, (name, values)
        self.content += packed

    def save(self, path: Path) -> Path:
        path.write_bytes(self.content)
        return path

    def messages(self, path: Path) -> Iterator[Any]:
        """Yield the messages as pymavlink reads them."""
        log = self.reader.DFReader_binary(str(path))
        try:
            while (message := log.recv_msg()) is not None:
                yield message
        finally:
            log.close()


@pytest.fixture
def dataflash() -> Dataflash:
    """An empty ArduPilot log."""
    return Dataflash()


@pytest.fixture
def dive(dataflash: Dataflash) -> Dataflash:
    """A short ArduPilot log with units, two sensors of a kind, text, and every kind of number."""
    log = dataflash
    log.define(130, "UNIT", "QbZ", "TimeUS,Id,Label")
    log.define(131, "MULT", "Qbd", "TimeUS,Id,Mult")
    log.define(132, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds")
    log.define(140, "ATT", "QccC", "TimeUS,Roll,Pitch,Yaw")
    log.define(141, "IMU", "QBff", "TimeUS,I,GyrX,GyrZ")
    log.define(142, "MSG", "QZ", "TimeUS,Message")
    log.define(143, "ALL", "QbhiqBHIdfgcCeEL", "TimeUS,b,h,i,q,B,H,I,d,f,g,c,C,e,E,L")
    for letter, label in (("s", b"s"), ("d", b"deg"), ("#", b"instance"), ("E", b"rad/s")):
        log.put("UNIT", 0, ord(letter), label)
    for letter, scale in (("F", 1e-6), ("0", 1.0), ("-", 0.0), ("C", 1e-3)):
        log.put("MULT", 0, ord(letter), scale)
    log.put("FMTU", 0, 140, b"sddd", b"F000")
    log.put("FMTU", 0, 141, b"s#EE", b"F-0C")
    log.put("MSG", 900_000, "ArduSub V4.1 °".encode())
    for k in range(20):
        time = 1_000_000 + 100_000 * k
        log.put("ATT", time, 0.01 * k, -0.02 * k, 350 + 0.5 * k)
        log.put("IMU", time + 1, 0, 0.5 * k, 1.0)
        log.put("IMU", time + 2, 1, 0.25 * k, 2.0)
    whole = (-5, -500, -70_000, -(2**40), 250, 60_000, 2**31)
    scaled = (-1.25, 300.5, -70.01, 9e4, 58.1234567)
    log.put("ALL", 3_000_000, *whole, 1 / 3, 0.1, 0.25, *scaled)
    return log


@cache
def type_stores() -> tuple[Any, Any]:
    """What ROS 2 and ROS 1 define."""
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS2_HUMBLE), get_typestore(Stores.ROS1_NOETIC)


class RosBag:
    """A bag that rosbags writes."""

    def __init__(self) -> None:
        pytest.importorskip("rosbags")
        self.modern, self.noetic = type_stores()

    def stamp(self, second: float, store: Any) -> Any:
        whole = int(second)
        kind = store.types["builtin_interfaces/msg/Time"]
        return kind(sec=whole, nanosec=round((second - whole) * 1e9))

    def twist(self, second: float, speed: float, frame: str = "base", store: Any = None) -> Any:
        """A twist with a stamp."""
        store = store or self.modern
        types = store.types
        header = {"stamp": self.stamp(second, store), "frame_id": frame}
        if store is self.noetic:
            header["seq"] = 7
        vector = types["geometry_msgs/msg/Vector3"]
        return types["geometry_msgs/msg/TwistStamped"](
            header=types["std_msgs/msg/Header"](**header),
            twist=types["geometry_msgs/msg/Twist"](
                linear=vector(x=speed, y=-speed, z=0.5), angular=vector(x=0.0, y=0.0, z=0.1)
            ),
        )

    def joints(self, second: float, angles: list[float], names: list[str]) -> Any:
        types = self.modern.types
        header = types["std_msgs/msg/Header"](stamp=self.stamp(second, self.modern), frame_id="")
        return types["sensor_msgs/msg/JointState"](
            header=header,
            name=names,
            position=np.array(angles),
            velocity=np.array([]),
            effort=np.array([]),
        )

    def ros2(
        self, folder: Path, messages: list[tuple[str, str, float, Any]], kind: str = "MCAP"
    ) -> Path:
        """Write topic, type, time and message of each to a folder."""
        from rosbags.rosbag2 import StoragePlugin, Writer

        with Writer(folder, version=9, storage_plugin=StoragePlugin[kind]) as writer:
            self._write(writer, messages, self.modern, self.modern.serialize_cdr)
        return folder

    def ros1(self, path: Path, messages: list[tuple[str, str, float, Any]]) -> Path:
        """Write topic, type, time and message of each to a file."""
        from rosbags.rosbag1 import Writer

        with Writer(path) as writer:
            self._write(writer, messages, self.noetic, self.noetic.serialize_ros1)
        return path

    def _write(self, writer: Any, messages: Any, store: Any, pack: Any) -> None:
        connections: dict[tuple[str, str], Any] = {}
        for topic, name, second, message in messages:
            if (topic, name) not in connections:
                connections[topic, name] = writer.add_connection(topic, name, typestore=store)
            writer.write(connections[topic, name], round(second * 1e9), pack(message, name))

    def twists(self, n: int, topic: str = "/dvl", start: float = 100.0, old: bool = False) -> Any:
        """Topic, type, time and message of n twists at 10 Hz."""
        store = self.noetic if old else self.modern
        name = "geometry_msgs/msg/TwistStamped"
        return [
            (topic, name, start + 0.1 * k, self.twist(start + 0.1 * k, 0.01 * k, store=store))
            for k in range(n)
        ]


@pytest.fixture
def bag() -> RosBag:
    """What writes bags."""
    return RosBag()


def ulog(path: Path, n: int = 10, *, dropout: bool = False, instances: int = 1) -> Path:
    """Write a ULog as its published format says (docs.px4.io, ULog file format)."""
    content = bytearray(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 1_000_000))

    def message(kind: bytes, body: bytes) -> None:
        content.extend(struct.pack("<HB", len(body), kind[0]) + body)

    message(b"B", bytes(40))
    message(
        b"F", b"vehicle_attitude:uint64_t timestamp;float[4] q;uint8_t reset;uint8_t[3] _padding0;"
    )
    message(b"F", b"big:uint64_t timestamp;float[80] values;")
    for instance in range(instances):
        message(b"A", struct.pack("<BH", instance, instance) + b"vehicle_attitude")
    message(b"A", struct.pack("<BH", 0, 9) + b"big")
    for k in range(n):
        stamp = 1_000_000 + 100_000 * k
        for instance in range(instances):
            body = struct.pack("<HQ4fB", instance, stamp, 1.0, 0.1 * k, 0.0, instance, k)
            message(b"D", body)
        if dropout and k == 3:
            message(b"O", struct.pack("<H", 250))
    message(b"D", struct.pack("<HQ80f", 9, 1_000_000, *range(80)))
    path.write_bytes(content)
    return path


@pytest.fixture
def write_ulog() -> Write:
    """What writes ULogs."""
    return ulog
