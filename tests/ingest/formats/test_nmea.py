"""Sentences of NMEA 0183, with checksums, from two talkers and over midnight."""

from __future__ import annotations

from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import LogError

YAW = 0.5 * np.sin(0.2 * np.arange(0.0, 60.0, 0.2))
RATE = 0.1 * np.cos(0.2 * np.arange(0.0, 60.0, 0.2))


def sentence(body: str) -> str:
    return f"${body}*{reduce(xor, body.encode()):02X}"


def write_sentences(path: Path, prefix: str = "") -> Path:
    lines = []
    for k, (yaw, rate) in enumerate(zip(np.degrees(YAW), np.degrees(RATE), strict=True)):
        time = (86370.0 + 0.2 * k) % 86400.0
        clock = f"{time // 3600:02.0f}{time // 60 % 60:02.0f}{time % 60:05.2f}"
        date = "310524" if k < 150 else "010624"
        lines += [
            f"GNRMC,{clock},A,5924.{k:04},S,01030.0000,W,4.137,{yaw % 360:.3f},{date},3.4,W,A",
            f"HEHDT,{yaw % 360:.4f},T",
            f"HEROT,{60 * rate:.3f},A",
            "GPGSV,1,1,00",
        ]
    text = "\r\n".join(prefix + sentence(line) for line in lines)
    path.write_text(text + "\r\n$GPHDT,999.0,T*00\r\n", encoding="ascii")
    return path


@pytest.mark.parametrize("prefix", ["", "12:00:01.5 ", "2024-05-31T12:00:00Z,"])
def test_sentences_are_topics_with_units(tmp_path: Path, prefix: str) -> None:
    recording = hd.read_recording(write_sentences(tmp_path / "nav.txt", prefix))
    assert recording.format == "NMEA 0183"
    assert recording.notes == (
        "1 lines are no NMEA sentence with a valid checksum; skipped",
        "sentences GSV are not read",
    )
    fixes = recording.topic("RMC")
    assert fixes.time is not None
    np.testing.assert_allclose(np.diff(fixes.time), 0.2, atol=1e-6)
    assert fixes.time[0] == 1717199970.0  # 2024-05-31 23:59:30
    assert fixes.fields["latitude"][299] == pytest.approx(-(59.0 + 24.0299 / 60.0))
    assert fixes.fields["longitude"][0] == -10.5
    assert fixes.units == {"latitude": "deg", "longitude": "deg", "sog": "kn", "cog": "deg"}
    draft = hd.probe(recording).draft.text
    assert "heading: {column: HDT.heading, unit: deg}" in draft
    log = hd.read_log(tmp_path / "nav.txt", hd.probe(recording).mapping())
    np.testing.assert_allclose(log.velocity[:, 5], RATE, atol=1e-5)


def test_other_sentences_are_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "nav.txt"
    path.write_text(sentence("GPGSV,1,1,00") + "\n", encoding="ascii")
    with pytest.raises(LogError, match=r"found GSV. Convert the file to CSV, .* pynmea2"):
        hd.read_recording(path)
