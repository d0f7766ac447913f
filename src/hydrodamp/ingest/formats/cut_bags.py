"""Bags that are cut off: a copy with the whole messages before the cut, and an end."""

from __future__ import annotations

import bz2
import struct
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

_MCAP_MAGIC = b"\x89MCAP0\r\n"
_MCAP_FOOTER = b"\x02" + struct.pack("<Q", 20) + bytes(20) + _MCAP_MAGIC  # without a summary
_MCAP_CHUNK, _MCAP_END = 6, 15  # record kinds
_ROS1_MAGIC = b"#ROSBAG V2.0\n"
_MESSAGE, _CHUNK, _CONNECTION = 2, 5, 7  # record kinds of ROS 1


@contextmanager
def repaired_copies(path: Path) -> Iterator[list[Path]]:
    """Write the whole messages of a cut ROS 1 bag, MCAP file or folder of them to files."""
    with tempfile.TemporaryDirectory() as folder:
        copies = []
        for file in sorted(path.glob("*.mcap")) or [path]:
            data, copy = file.read_bytes(), Path(folder) / file.name
            if data.startswith(_ROS1_MAGIC):
                _write_ros1(data[len(_ROS1_MAGIC) :], copy)
            elif data.startswith(_MCAP_MAGIC):
                records = b"".join(_mcap_records(data[len(_MCAP_MAGIC) :]))
                copy.write_bytes(_MCAP_MAGIC + records + _MCAP_FOOTER)
            copies.append(copy)
        yield copies


def _mcap_records(data: bytes) -> Iterator[bytes]:
    """Yield the whole records, also those inside the chunk that is cut."""
    start = 0
    while start + 9 <= len(data) and data[start] != _MCAP_END:
        (size,) = struct.unpack_from("<Q", data, start + 1)
        end = start + 9 + size
        if end > len(data):
            if data[start] == _MCAP_CHUNK and start + 49 <= len(data):
                (length,) = struct.unpack_from("<I", data, start + 37)
                name = data[start + 41 : start + 41 + length].decode()
                yield from _mcap_records(_decompress(name, data[start + 49 + length :]))
            return
        yield data[start:end]
        start = end


def _decompress(compression: str, data: bytes) -> bytes:
    """Return what the beginning of a compressed chunk holds."""
    if compression == "bz2":
        return bz2.BZ2Decompressor().decompress(data)
    if compression == "lz4":
        return bytes(import_module("lz4.frame").LZ4FrameDecompressor().decompress(data))
    if compression == "zstd":
        zstd = import_module("rosbags.rosbag2.storage_mcap").zstd
        return bytes(zstd.ZstdDecompressor().decompress(data))
    return data


def _write_ros1(data: bytes, copy: Path) -> None:
    """Write the messages of the records of a ROS 1 bag."""
    from rosbags.rosbag1 import Writer

    connections: dict[bytes, Any] = {}
    with Writer(copy) as bag:
        for header, content in _ros1_records(data):
            kind, number = header["op"][0], header.get("conn", b"")
            if kind == _CONNECTION and number not in connections:
                fields = _ros1_header(content)
                connections[number] = bag.add_connection(
                    header["topic"].decode(),
                    fields["type"].decode().replace("/", "/msg/"),
                    msgdef=fields["message_definition"].decode(),
                    md5sum=fields["md5sum"].decode(),
                    callerid=number.hex(),  # else publishers of one topic look the same
                )
            elif kind == _MESSAGE and number in connections:
                seconds, nanoseconds = struct.unpack("<II", header["time"])
                bag.write(connections[number], seconds * 10**9 + nanoseconds, content)


def _ros1_records(data: bytes) -> Iterator[tuple[dict[str, bytes], bytes]]:
    """Yield header and content of the whole records, also of those inside chunks."""
    start = 0
    while start + 4 <= len(data):
        (length,) = struct.unpack_from("<I", data, start)
        content_start = start + 8 + length
        if content_start > len(data):
            return
        header = _ros1_header(data[start + 4 : start + 4 + length])
        (size,) = struct.unpack_from("<I", data, content_start - 4)
        content = data[content_start : content_start + size]
        if header["op"][0] == _CHUNK:
            yield from _ros1_records(_decompress(header["compression"].decode(), content))
        elif len(content) == size:
            yield header, content
        start = content_start + size


def _ros1_header(data: bytes) -> dict[str, bytes]:
    """Return the fields of the header of a record."""
    fields: dict[str, bytes] = {}
    start = 0
    while start + 4 <= len(data):
        (length,) = struct.unpack_from("<I", data, start)
        name, _, value = data[start + 4 : start + 4 + length].partition(b"=")
        fields[name.decode()] = value
        start += 4 + length
    return fields
