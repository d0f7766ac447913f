"""Sentences of NMEA 0183, with checksums, from two talkers and over midnight."""

from functools import reduce
from operator import xor

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import LogError
from table_rows import rows

YAW = 0.5 * np.sin(0.2 * np.arange(0.0, 60.0, 0.2))
RATE = 0.1 * np.cos(0.2 * np.arange(0.0, 60.0, 0.2))


def sentence(body):
    return f"${body}*{reduce(xor, body.encode()):02X}"


def write_sentences(path, prefix=""):
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
def test_sentences_are_topics_with_units(tmp_path, prefix):
    recording = hd.read_recording(write_sentences(tmp_path / "nav.txt", prefix))
    assert recording.format == "NMEA 0183"
    assert recording.notes == (
        "1 lines are no NMEA sentence with a valid checksum; skipped",
        "sentences GSV are not read",
    )
    fixes = recording.topic("RMC")
    np.testing.assert_allclose(np.diff(fixes.time), 0.2, atol=1e-6)
    assert fixes.time[0] == 1717199970.0  # 2024-05-31 23:59:30
    assert fixes.fields["latitude"][299] == pytest.approx(-(59.0 + 24.0299 / 60.0))
    assert fixes.fields["longitude"][0] == -10.5
    assert fixes.units == {"latitude": "deg", "longitude": "deg", "sog": "kn", "cog": "deg"}
    draft = hd.probe(recording).draft.text
    assert "heading: {column: HDT.heading, unit: deg}" in draft
    log = hd.read_log(tmp_path / "nav.txt", hd.probe(recording).mapping())
    np.testing.assert_allclose(log.velocity[:, 5], RATE, atol=1e-5)


def test_other_sentences_are_refused_by_name(tmp_path, refused):
    path = tmp_path / "nav.txt"
    path.write_text(sentence("GPGSV,1,1,00") + "\n", encoding="ascii")
    refused(LogError, hd.read_recording, path)


def read_topics(path, *bodies):
    path.write_text("\n".join(map(sentence, bodies)), encoding="ascii")
    return hd.read_recording(path)


def test_only_positions_have_minutes_and_a_hemisphere(tmp_path):
    speeds = "GPVTG,054.7,T,034.4,M,005.5,N,010.2,K", "IIVHW,245.1,T,245.1,M,006.0,N,010.9,K"
    recording = read_topics(tmp_path / "a.nmea", *speeds)
    assert recording.topic("VTG").fields["sog"].tolist() == [5.5]
    assert recording.topic("VHW").fields["stw"].tolist() == [6.0]


@rows("body, field, is_valid")
def test_an_invalid_status_gives_no_numbers(tmp_path, body, field, is_valid):
    values = read_topics(tmp_path / "a.nmea", body).topics[0].fields[field]
    assert bool(np.isfinite(values).all()) == is_valid


def test_sentences_that_begin_after_midnight_share_the_clock(tmp_path):
    bodies = ["GPGGA,235957.00,5330.0000,N,00830.0000,E,1,08,1.0,0.0,M,,M,,"]
    for clock, date in (("235958", "310524"), ("000002", "010624"), ("010000", "030624")):
        bodies.append(f"GPRMC,{clock}.00,A,5330.0000,N,00830.0000,E,5.5,054.7,{date},,")
    recording = read_topics(tmp_path / "a.nmea", *bodies, "HEHDT,100.0,T", "HEHDM,101.0,M")
    midnight = 1717200000.0  # 2024-06-01
    times = {topic.name: np.asarray(topic.time) - midnight for topic in recording.topics}
    assert times["GGA"].tolist() == [-3.0]
    assert times["RMC"].tolist() == [-2.0, 2.0, 2 * 86400.0 + 3600.0]
    assert times["HDT"].tolist() == times["HDM"].tolist() == [2 * 86400.0 + 3600.0]


def test_a_draft_prefers_the_true_heading(tmp_path):
    text = write_sentences(tmp_path / "nav.txt").read_text("ascii").replace("\r", "")
    for k, yaw in enumerate(np.degrees(YAW)):
        true = sentence(f"HEHDT,{yaw % 360:.4f},T") + "\n"
        magnetic = sentence(f"HCHDM,{(yaw + 5.0) % 360:.4f},M") + "\n"
        text = text.replace(true, magnetic + true) if k % 2 else text.replace(true, magnetic * 2)
    path = tmp_path / "magnetic.txt"
    path.write_text(text, encoding="ascii")
    draft = hd.probe(hd.read_recording(path)).draft.text
    assert "heading: {column: HDT.heading, unit: deg}" in draft
