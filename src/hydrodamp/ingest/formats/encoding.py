"""Which characters the bytes of a text file stand for."""

from __future__ import annotations

import codecs
import re
from pathlib import Path

from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.content import opened

_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_CONTROL = re.compile(rb"[\x01-\x08\x0e-\x1a\x1c-\x1f]")
_SHARE = 0.003
_CHUNK = 1 << 20
WESTERN = "cp1252"
"""What text that is no Unicode is taken for."""
_WESTERN_NOTE = "the text is not UTF-8; its letters were read as Windows-1252"


def encoding_of(begin: bytes, source: str) -> tuple[str, list[str]]:
    """Find the encoding of a text from its first bytes."""
    for mark, encoding in _MARKS:
        if begin.startswith(mark):
            return encoding, []
    if wide := _wide(begin):
        return wide, []
    _check_text(begin.rstrip(b"\0"), source)
    decoder = codecs.getincrementaldecoder("utf-8")()
    try:
        decoder.decode(begin)
    except UnicodeDecodeError:
        return WESTERN, [_WESTERN_NOTE]
    return "utf-8", []


def encoding_throughout(path: str | Path, encoding: str) -> tuple[str, list[str]]:
    """Check that the encoding found at the start holds to the end."""
    if encoding != "utf-8":
        return encoding, []
    decoder = codecs.getincrementaldecoder(encoding)()
    with opened(path) as file:
        try:
            while chunk := file.read(_CHUNK):
                decoder.decode(chunk)
        except UnicodeDecodeError:
            return WESTERN, [_WESTERN_NOTE]
    return encoding, []


def _wide(begin: bytes) -> str:
    """Tell UTF-16 without a mark by its zero bytes at every other place."""
    even, odd = begin[0::2], begin[1::2]
    if len(odd) < 2:
        return ""
    if odd.count(0) > 0.4 * len(odd) and even.count(0) < 0.1 * len(even):
        return "utf-16-le"
    if even.count(0) > 0.4 * len(even) and odd.count(0) < 0.1 * len(odd):
        return "utf-16-be"
    return ""


def _check_text(begin: bytes, source: str) -> None:
    """Tell noise by its control characters; zeros alone may be a gap in a text."""
    first = _CONTROL.search(begin)
    if first is None or len(_CONTROL.findall(begin)) <= max(2, _SHARE * len(begin)):
        return
    line = begin.count(b"\n", 0, first.start()) + 1
    raise LogError(
        f"this is no text: byte {first.start()} (line {line}) is"
        f" 0x{begin[first.start()]:02x}. If the file is a log of another format, give it the name"
        " that format has; if a fault has overwritten part of a text file, cut that part out",
        source=source,
    )
