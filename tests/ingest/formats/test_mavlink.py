"""Telemetry logs of MAVLink, packed by pymavlink."""

from contextlib import suppress

import numpy as np
import pytest

from hydrodamp.errors import LogError
from hydrodamp.ingest.formats import files, mavlink

dialect = pytest.importorskip("pymavlink.dialects.v20.common")
START = 1_700_000_000_000_000  # us


def stamped(packets):
    return b"".join((START + at).to_bytes(8) + packet for at, packet in packets)


@pytest.fixture
def vehicle():
    return dialect.MAVLink(None, srcSystem=3, srcComponent=1)


def test_a_log_holds_what_the_autopilot_said(tmp_path, vehicle):
    ground = dialect.MAVLink(None, srcSystem=255, srcComponent=190)
    sent = []
    for k in range(5):
        boot = 1000 + 100 * k
        sent += [
            (100_000 * k, vehicle.attitude_encode(boot, 0.5, 0, 0, 0, 0, 0.25 * k).pack(vehicle)),
            (100_001 * k, vehicle.named_value_float_encode(boot, b"rpm", 7).pack(vehicle)),
            (100_002 * k, ground.heartbeat_encode(6, 8, 0, 0, 0).pack(ground)),
        ]
    path = tmp_path / "dive.tlog"
    path.write_bytes(stamped(sent))
    recording = files.read_files(path)
    assert recording.format == "MAVLink log"
    assert [topic.name for topic in recording.topics] == ["ATTITUDE", "NAMED_VALUE_FLOAT[rpm]"]
    attitude = recording.topic("ATTITUDE")
    assert attitude.fields["time_boot_ms"].tolist() == [1000, 1100, 1200, 1300, 1400]
    assert attitude.fields["yawspeed"].tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert attitude.units["yawspeed"] == "rad/s"
    assert attitude.time.tolist() == [1.7e9 + 0.1 * k for k in range(5)]
    assert recording.notes == ("5 messages come from other senders than the autopilot; skipped",)


def test_the_clock_of_servo_outputs_runs_on_after_71_minutes(vehicle):
    decoder, times = mavlink.Decoder(), []
    for k in range(4):
        boot = 2_147_000 + 2_000_000 * k  # ms
        decoder(vehicle.attitude_encode(boot, 0, 0, 0, 0, 0, 0).pack(vehicle))
        servo = vehicle.servo_output_raw_encode(boot * 1000 % 2**32, 0, *[1500] * 8)
        times.append(decoder(servo.pack(vehicle)).fields["time_usec"] / 1e3)
    assert times == [2_147_000 + 2_000_000 * k for k in range(4)]


def test_the_largest_integer_of_a_type_is_unknown(vehicle):
    packet = vehicle.global_position_int_encode(
        1, 369200000, 2**31 - 1, 0, -7000, 2**15 - 1, -5, 9, 2**16 - 1
    ).pack(vehicle)
    fields = mavlink.Decoder()(packet).fields
    assert [name for name, value in fields.items() if np.isnan(value)] == ["lon", "vx", "hdg"]
    assert (fields["lat"], fields["vy"]) == (369200000.0, -5.0)
    cells = vehicle.battery_status_encode(0, 0, 0, 2000, [3900] + [2**16 - 1] * 9, 0, 0, 0, 50)
    fields = mavlink.Decoder()(cells.pack(vehicle)).fields
    assert fields["voltages[0]"] == 3900.0
    assert np.isnan(fields["voltages[1]"])


def test_arrays_of_a_message_are_numbered(vehicle):
    packet = vehicle.actuator_output_status_encode(1, 2, [0.5] * 32).pack(vehicle)
    fields = mavlink.Decoder()(packet).fields
    assert (fields["actuator[0]"], fields["actuator[31]"]) == (0.5, 0.5)


def test_damage_is_noted_and_what_stands_before_it_is_read(tmp_path, vehicle):
    packets = [(k, vehicle.attitude_encode(k, 0, 0, 0, 0, 0, 0).pack(vehicle)) for k in range(6)]
    spoilt = bytearray(stamped(packets))
    size = len(spoilt) // 6
    spoilt[2 * size + 20] ^= 1
    spoilt[5 * size + 8] = 0
    path = tmp_path / "dive.tlog"
    path.write_bytes(spoilt)
    recording = files.read_files(path)
    assert recording.topic("ATTITUDE").fields["time_boot_ms"].tolist() == [0, 1, 3, 4]
    assert recording.notes == (
        f"{2 * size} of {6 * size} bytes are damaged, the first at byte {2 * size};"
        " their packets were skipped",
    )


def test_a_damaged_byte_costs_its_packet_and_no_other(tmp_path, vehicle):
    n = 200
    sent = [
        vehicle.attitude_encode(50 * k, 0.1, 0, 0, 0, 0, 0.01 * k).pack(vehicle)
        if k % 2
        else vehicle.named_value_float_encode(50 * k, b"rpm", 7.5).pack(vehicle)
        for k in range(n)
    ]
    intact = stamped([(50_000 * k, packet) for k, packet in enumerate(sent)])
    starts = np.cumsum([0, *(8 + len(packet) for packet in sent)]).tolist()
    path = tmp_path / "dive.tlog"
    damaged = np.random.default_rng(34)
    for offset in [*range(6), *range(8, 20), *damaged.integers(20, 36, 8).tolist()]:
        broken = bytearray(intact)
        broken[starts[100] + offset] ^= 0xFF
        path.write_bytes(broken)
        recording = files.read_files(path)
        assert sum(topic.n for topic in recording.topics) == n - 1, offset
        assert len(recording.notes) == 1, recording.notes
    # Three bytes of the stamp's front, and one that is inserted or lost, shift what follows.
    for broken in (
        intact[: starts[100] + 5] + b"\xfd" + intact[starts[100] + 5 :],
        intact[: starts[100] + 15] + intact[starts[100] + 16 :],
    ):
        path.write_bytes(broken)
        assert sum(topic.n for topic in files.read_files(path).topics) == n - 1


def test_messages_that_no_dialect_defines_are_counted(tmp_path, vehicle):
    known = vehicle.attitude_encode(1, 0, 0, 0, 0, 0, 0).pack(vehicle)
    unknown = bytearray(known)
    if unknown[0] == 0xFD:
        unknown[7:10] = b"\xfe\xff\xfa"
    path = tmp_path / "dive.tlog"
    path.write_bytes(stamped([(0, known), (1000, bytes(unknown)), (2000, known)]))
    recording = files.read_files(path)
    assert recording.topic("ATTITUDE").n == 2
    if unknown[0] == 0xFD:
        assert recording.notes == ("1 packets have an unknown message type; skipped",)


def test_a_log_without_an_autopilot_is_refused(tmp_path, refused):
    ground = dialect.MAVLink(None, srcSystem=255, srcComponent=190)
    path = tmp_path / "dive.tlog"
    path.write_bytes(stamped([(0, ground.heartbeat_encode(6, 8, 0, 0, 0).pack(ground))]))
    refused(LogError, files.read_files, path)


def test_no_noise_is_more_than_an_error():
    decoder, random = mavlink.Decoder(), np.random.default_rng(5)
    for _ in range(5000):
        noise = random.bytes(int(random.integers(1, 300)))
        for packet in mavlink.split_packets(b"\xfd" + noise):
            with suppress(ValueError):
                assert decoder(packet) is None
