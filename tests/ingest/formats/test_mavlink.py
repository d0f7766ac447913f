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


def attitude(vehicle, boot, roll=0.0, yawspeed=0.0):
    """Return the packet of an attitude."""
    return vehicle.attitude_encode(boot, roll, 0, 0, 0, 0, yawspeed).pack(vehicle)


@pytest.fixture
def read(tmp_path):
    """What reads bytes from a file."""

    def read_bytes(content):
        path = tmp_path / "dive.tlog"
        path.write_bytes(content)
        return files.read_files(path)

    return read_bytes


@pytest.fixture
def vehicle():
    return dialect.MAVLink(None, srcSystem=3, srcComponent=1)


def test_a_log_holds_what_the_autopilot_said(read, vehicle):
    ground = dialect.MAVLink(None, srcSystem=255, srcComponent=190)
    sent = []
    for k in range(5):
        boot = 1000 + 100 * k
        sent += [
            (100_000 * k, attitude(vehicle, boot, 0.5, 0.25 * k)),
            (100_001 * k, vehicle.named_value_float_encode(boot, b"rpm", 7).pack(vehicle)),
            (100_002 * k, ground.heartbeat_encode(6, 8, 0, 0, 0).pack(ground)),
        ]
    recording = read(stamped(sent))
    assert recording.format == "MAVLink log"
    assert [topic.name for topic in recording.topics] == ["ATTITUDE", "NAMED_VALUE_FLOAT[rpm]"]
    topic = recording.topic("ATTITUDE")
    assert topic.fields["time_boot_ms"].tolist() == [1000, 1100, 1200, 1300, 1400]
    assert topic.fields["yawspeed"].tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert topic.units["yawspeed"] == "rad/s"
    assert topic.time.tolist() == [1.7e9 + 0.1 * k for k in range(5)]
    assert recording.notes == ("5 messages come from other senders than the autopilot; skipped",)


def test_the_clock_of_servo_outputs_runs_on_after_71_minutes(vehicle):
    decoder, times = mavlink.Decoder(), []
    for k in range(4):
        boot = 2_147_000 + 2_000_000 * k  # ms
        decoder(attitude(vehicle, boot))
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


def test_damage_is_noted_and_what_stands_before_it_is_read(read, vehicle):
    spoilt = bytearray(stamped([(k, attitude(vehicle, k)) for k in range(6)]))
    size = len(spoilt) // 6
    spoilt[2 * size + 20] ^= 1
    spoilt[5 * size + 8] = 0
    recording = read(spoilt)
    assert recording.topic("ATTITUDE").fields["time_boot_ms"].tolist() == [0, 1, 3, 4]
    assert recording.notes == (
        f"{2 * size} of {6 * size} bytes are damaged, the first at byte {2 * size};"
        " their packets were skipped",
    )


def test_a_damaged_byte_costs_its_packet_and_no_other(read, vehicle):
    n = 200
    sent = [
        attitude(vehicle, 50 * k, 0.1, 0.01 * k)
        if k % 2
        else vehicle.named_value_float_encode(50 * k, b"rpm", 7.5).pack(vehicle)
        for k in range(n)
    ]
    intact = stamped([(50_000 * k, packet) for k, packet in enumerate(sent)])
    start = sum(8 + len(packet) for packet in sent[:100])
    damaged = np.random.default_rng(34)
    for offset in [*range(6), *range(8, 20), *damaged.integers(20, 36, 8).tolist()]:
        broken = bytearray(intact)
        broken[start + offset] ^= 0xFF
        recording = read(broken)
        assert sum(topic.n for topic in recording.topics) == n - 1, offset
        assert len(recording.notes) == 1, recording.notes
    # Three bytes of the stamp's front, and one that is inserted or lost, shift what follows.
    for broken in (
        intact[: start + 5] + b"\xfd" + intact[start + 5 :],
        intact[: start + 15] + intact[start + 16 :],
    ):
        assert sum(topic.n for topic in read(broken).topics) == n - 1


def test_messages_that_no_dialect_defines_are_counted(read, vehicle):
    known = attitude(vehicle, 1)
    unknown = bytearray(known)
    if unknown[0] == 0xFD:
        unknown[7:10] = b"\xfe\xff\xfa"
    recording = read(stamped([(0, known), (1000, bytes(unknown)), (2000, known)]))
    assert recording.topic("ATTITUDE").n == 2
    if unknown[0] == 0xFD:
        assert recording.notes == ("1 packets have an unknown message type; skipped",)


def test_a_log_without_an_autopilot_is_refused(read, refused):
    ground = dialect.MAVLink(None, srcSystem=255, srcComponent=190)
    packet = ground.heartbeat_encode(6, 8, 0, 0, 0).pack(ground)
    refused(LogError, read, stamped([(0, packet)]))


def test_no_noise_is_more_than_an_error():
    decoder, random = mavlink.Decoder(), np.random.default_rng(5)
    for _ in range(5000):
        noise = random.bytes(int(random.integers(1, 300)))
        for packet in mavlink.split_packets(b"\xfd" + noise):
            with suppress(ValueError):
                assert decoder(packet) is None
