"""ArduPilot against pymavlink, PX4 against pyulog, MOOS against its published form."""

from pathlib import Path

import numpy as np
import pytest

from hydrodamp.ingest.formats import ardupilot, files, px4
from hydrodamp.ingest.formats.content import as_numbers

HERE = Path(__file__).parent


def test_dataflash_is_what_pymavlink_reads(tmp_path, dive):
    path = dive.save(tmp_path / "dive.bin")
    recording = ardupilot.read_file(path)
    rows = {}
    for message in dive.messages(path):
        kind = message.get_type()
        rows.setdefault(f"IMU[{message.I}]" if kind == "IMU" else kind, []).append(message)
    assert [topic.name for topic in recording.topics] == ["MSG", "ATT", "IMU[0]", "IMU[1]", "ALL"]
    for topic in recording.topics:
        expected = rows[topic.name]
        for name, values in topic.fields.items():
            assert values.tolist() == [getattr(message, name) for message in expected], name
        for name, words in topic.texts.items():
            assert list(words) == [getattr(message, name) for message in expected]
        assert topic.time.tolist() == [message.TimeUS / 1e6 for message in expected]
        units = {name: expected[0].fmt.get_unit(name) for name in topic.fields}
        assert topic.units == {
            name: unit for name, unit in units.items() if unit and unit != "instance"
        }


@pytest.mark.parametrize(
    ("letters", "columns", "length"),
    [("Qf", "TimeUS", 15), ("Q?", "TimeUS,x", 12), ("Qf", "TimeUS,x", 99), ("ff", "x,x", 11)],
)
def test_messages_that_break_their_own_format(tmp_path, dive, letters, columns, length):
    dive.write_message("FMT", 160, length, b"BAD", letters.encode(), columns.encode())
    dive.content += b"\xa3\x95\xa0" + bytes(length - 3)
    dive.write_message("ATT", 9_000_000, 1.0, 2.0, 3.0)
    recording = ardupilot.read_file(dive.save(tmp_path / "dive.bin"))
    assert recording.topic("ATT").n == 21
    assert "messages BAD do not match their FMT message; they were skipped" in recording.notes


def test_dataflash_in_text():
    recording = files.read_files(HERE / "dive.log")
    attitude = recording.topic("ATT")
    assert attitude.fields["Yaw"].tolist() == [270.5, 271.5]
    assert attitude.time.tolist() == [1.0, 1.1]
    assert recording.topic("MSG").texts["Message"] == ("ArduSub",)
    assert recording.topic("XKF1[0]").fields["VN"].tolist() == [1.0, 3.0]  # cores without units
    assert "line 9 and 1 more match no FMT message of the log; skipped" in recording.notes


def test_ulog_is_what_pyulog_reads(tmp_path, write_ulog):
    pyulog = pytest.importorskip("pyulog")
    path = write_ulog(tmp_path / "dive.ulg", instances=2)
    recording = files.read_files(path)
    with path.open("rb") as file:
        log = pyulog.ULog(file)
    for dataset in log.data_list:
        if dataset.name == "big":
            continue
        name = "vehicle_attitude" if dataset.multi_id == 0 else "vehicle_attitude[1]"
        topic = recording.topic(name)
        assert set(topic.fields) == set(dataset.data)
        for field, values in dataset.data.items():
            np.testing.assert_array_equal(topic.fields[field], values)
        np.testing.assert_allclose(topic.time, dataset.data["timestamp"] / 1e6)
    assert recording.topic("vehicle_attitude").time[0] == 1.0
    assert list(recording.topic("big").fields) == ["timestamp"]


@pytest.mark.parametrize("damage", [b"\xff" * 60, bytes(60), bytes(range(1, 61))])
def test_corruption_that_pyulog_passes_over_is_noted(tmp_path, write_ulog, damage, capsys):
    pytest.importorskip("pyulog")
    path = write_ulog(tmp_path / "dive.ulg", n=50)
    content = bytearray(path.read_bytes())
    content[900:960] = damage
    path.write_bytes(content)
    recording = px4.read_file(path)
    assert any("damaged at byte" in note for note in recording.notes)
    assert capsys.readouterr().out == ""


def test_what_pyulog_finds_damaged_is_noted(tmp_path, write_ulog):
    """A chain that holds, around messages too short for their format."""
    pytest.importorskip("pyulog")
    path = write_ulog(tmp_path / "dive.ulg")
    content = path.read_bytes()
    offset = content.rindex(b"big") + 3
    path.write_bytes(content[:offset] + b"\x02\x00D\xff\xff" + content[offset:])
    recording = px4.read_file(path)
    assert any("pyulog skipped" in note for note in recording.notes)


def test_moos():
    recording = files.read_files(HERE / "alpha.alog")
    speed = recording.topic("NAV_SPEED")
    assert speed.time.tolist() == [0.25, 0.5]
    assert speed.fields["value"].tolist() == [1.5, 1.75]
    assert speed.texts["source"] == ("pNav", "pNav")
    assert list(speed.lines) == [7, 10]
    assert recording.topic("NODE_REPORT").texts["value"][1] == "NAME=alpha,X=2.5,Y=-21"
    assert recording.topic("MODE").texts["value"] == ("PARK station keeping",)
    assert np.isnan(recording.topic("EMPTY").fields["value"]).all()
    assert recording.notes[0] == "times count from 1659009600.5 s since 1970"


@pytest.mark.parametrize(("bits", "kind"), [(0x7FA << 20, "4"), (0x7FF4 << 48, "8")])
def test_a_signalling_nan_is_a_nan_without_a_warning(bits, kind):
    with np.errstate(invalid="raise"):
        numbers = as_numbers(np.array([bits], f"u{kind}").view(f"f{kind}")) / 10.0
    assert numbers.dtype == np.float64
    assert np.isnan(numbers).all()
