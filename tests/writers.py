"""Writers of bags and of the logs of autopilots, as others have them."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest


class Dataflash:
    """An ArduPilot log made of messages that pymavlink packs."""

    def __init__(self) -> None:
        self.reader = pytest.importorskip("pymavlink.DFReader")
        self.formats: dict[str, Any] = {}
        self.content = bytearray()
        about = self.reader.DFFormat(128, "FMT", 89, "BBnNZ", "Type,Length,Name,Format,Columns")
        self.formats["FMT"] = about
        self.write_message("FMT", 128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns")

    def define(self, kind: int, name: str, letters: str, columns: str) -> None:
        sizes = "".join(self.reader.FORMAT_TO_STRUCT[letter][0] for letter in letters)
        length = 3 + struct.calcsize("<" + sizes)
        self.formats[name] = self.reader.DFFormat(kind, name, length, letters, columns)
        self.write_message("FMT", kind, length, name.encode(), letters.encode(), columns.encode())

    def write_message(self, name: str, *values: object) -> None:
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


class Ulog:
    """A ULog as its published format says (docs.px4.io, ULog file format)."""

    def __init__(self, start: int = 0) -> None:
        self.content = bytearray(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", start))
        self.write_message("B", bytes(40))

    def write_message(self, kind: str, body: bytes) -> None:
        self.content += struct.pack("<HB", len(body), ord(kind)) + body

    def define(self, name: str, fields: str) -> None:
        self.write_message("F", f"{name}:uint64_t timestamp;{fields};".encode())

    def announce(self, number: int, name: str, instance: int = 0) -> None:
        self.write_message("A", struct.pack("<BH", instance, number) + name.encode())

    def send(self, number: int, microseconds: int, kinds: str, *values: object) -> None:
        self.write_message("D", struct.pack(f"<HQ{kinds}", number, microseconds, *values))

    def save(self, path: Path) -> Path:
        path.write_bytes(self.content)
        return path


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
        seconds_part = int(second)
        kind = store.types["builtin_interfaces/msg/Time"]
        return kind(sec=seconds_part, nanosec=round((second - seconds_part) * 1e9))

    def twist(self, second: float, speed: float, frame: str = "base", store: Any = None) -> Any:
        """A twist with a stamp."""
        store = store or self.modern
        types = store.types
        header = {"stamp": self.stamp(second, store), "frame_id": frame}
        if store is self.noetic:
            header["seq"] = 7
        vector = types["geometry_msgs/msg/Vector3"]
        moves = vector(x=speed, y=-speed, z=0.5), vector(x=0.0, y=0.0, z=0.1)
        return types["geometry_msgs/msg/TwistStamped"](
            types["std_msgs/msg/Header"](**header), types["geometry_msgs/msg/Twist"](*moves)
        )

    def joints(self, second: float, angles: list[float], names: list[str]) -> Any:
        types = self.modern.types
        header = types["std_msgs/msg/Header"](stamp=self.stamp(second, self.modern), frame_id="")
        values = {"position": np.array(angles), "velocity": np.array([]), "effort": np.array([])}
        return types["sensor_msgs/msg/JointState"](header=header, name=names, **values)

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
