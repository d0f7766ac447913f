"""Presets, each on messages as their standard or firmware writes them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hydrodamp.data.attitude import euler_from_quaternion, rotation_vectors
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import GapWarning, LogError
from hydrodamp.ingest.mapping import LogMapping, read_mapping
from hydrodamp.ingest.read import read_log
from strangers import FLIP, imu, name_columns, twist

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "bluerov2" / "mapping.yaml"


@pytest.mark.parametrize("topic", ["/odom", "/my/odometry"])
def test_odometry_of_rep_103(topic, odometry, dive, refused):
    recording = odometry(topic)
    given = {"extends": "rep103-odometry"}
    if topic != "/odom":
        refused(LogError, lambda: LogMapping.from_dict(given).log(recording))
        given["topics"] = {"odometry": topic}
    log = LogMapping.from_dict(given).log(recording)
    dive.check(log)
    assert log.time.tolist() == dive.time.tolist()
    assert log.position is not None


def test_a_bag_beside_mavros(dive):
    pulses = np.tile([1500, 1900.0], (len(dive.time), 1))
    position = name_columns("pose.position.x pose.position.y pose.position.z", dive.enu)
    topics = {"imu/data": imu(dive), "rc/out": name_columns("channels[0] channels[1]", pulses)}
    topics["local_position/velocity_body"] = twist(dive.body * FLIP)
    topics["local_position/pose"] = position
    bag = (Topic(f"/mavros/{name}", dive.time, fields) for name, fields in topics.items())
    log = read_mapping("mavros").log(Recording(tuple(bag), "dive.bag", "a test"))
    dive.check(log)
    assert log.position is not None
    assert log.command_names == ("servo1", "servo2")
    np.testing.assert_allclose(log.commands[0], [0, 1])
    np.testing.assert_allclose(log.specific_force, dive.force)


@pytest.mark.parametrize("core", ["XKF1[0]", "NKF1"])
def test_a_dataflash_log_of_ardusub(core, ardusub, dive):
    attitude, ekf, imu, servos = ardusub.topics
    rates = Topic("RATE", dive.time, dict(zip("RPY", np.degrees(dive.rates).T, strict=True)))
    moved = {name: values + 9 for name, values in ekf.fields.items()}
    second_core = Topic("XKF1[1]", dive.time, moved)
    topics = (attitude, rates, replace(ekf, name=core), second_core, imu, servos)
    log = read_mapping("ardusub").log(replace(ardusub, topics=topics))
    dive.check(log)
    assert log.position is not None
    assert log.command_names == ("servo1",)
    np.testing.assert_allclose(log.command("servo1"), 0.25 * dive.rudder, atol=1e-12)


def test_a_log_of_px4(px4, dive):
    log = read_mapping("px4-uuv").log(px4)
    dive.check(log)
    assert log.position is not None
    assert log.command_names == ("thrust_x",)
    assert log.command("thrust_x").tolist() == dive.rudder.tolist()


def test_the_preset_of_the_tank_runs_is_the_mapping_of_the_example():
    ours, theirs = read_mapping("bluerov2-kth"), read_mapping(EXAMPLE)
    assert (ours.entries, ours.frame, ours.world) == (theirs.entries, theirs.frame, theirs.world)


@pytest.mark.slow
def test_the_tanker_moves_as_its_position_says(measured_logs):
    """Every zigzag: u v r against differences of position and heading at 20 Hz."""
    for path in sorted(measured_logs("kvlcc2_hsva").glob("HSVA_*.dat")):
        log = read_log(path, "kvlcc2-hsva")
        assert log.velocity_names == ("u", "v", "r")
        mean = (log.velocity[1:] + log.velocity[:-1]) / 2
        step = np.diff(log.time)[:, np.newaxis]
        yaw = euler_from_quaternion(log.attitude)[:, 2]
        middle = np.unwrap(yaw)[:-1] + np.diff(np.unwrap(yaw)) / 2
        north, east = (np.diff(log.position, axis=0) / step)[:, :2].T
        along = north * np.cos(middle) + east * np.sin(middle)
        across = east * np.cos(middle) - north * np.sin(middle)
        yawing = rotation_vectors(log.attitude[:-1], log.attitude[1:])[:, 2] / np.diff(log.time)
        for recorded, slope, least in ((0, along, 3e-3), (1, across, 3e-3), (5, yawing, 2e-3)):
            assert np.sqrt(np.mean((mean[:, recorded] - slope) ** 2)) < least, (path.name, recorded)
        assert np.abs(log.command("rudder")).max() < np.radians(36)


def test_the_relative_wind_of_the_pond_is_the_true_wind_less_the_velocity(measured_logs):
    """In body axes, u and v taken off; both winds come from their directions."""
    true = {"wind_speed": "wind_velo_true", "wind_direction": "wind_dir_true"}
    path = measured_logs("esso_osaka") / "random_06-Aug-2020_16_24_25_3.csv"
    log = read_log(path, LogMapping.from_dict({"extends": "esso-osaka", "commands": true}))
    bow = log.command("wind_direction") - euler_from_quaternion(log.attitude)[:, 2]
    for name, axis, part in (("u", 0, np.cos(bow)), ("v", 1, np.sin(bow))):
        expected = -log.command("wind_speed") * part - log.velocity[:, axis]
        np.testing.assert_allclose(log.command(f"wind_{name}"), expected, atol=1e-3)


@pytest.mark.slow
def test_the_690_becomes_one_log_of_many_topics(measured_logs):
    """Against the log on one clock that others derived from the same files."""
    folder = measured_logs("vt690_field")
    with pytest.warns(GapWarning):
        log = read_log(folder, "avl690")
    assert log.velocity_names == ("u", "v", "w", "q", "r")  # roll is no measurement
    assert [segment.name for segment in log.segments] == [f"{folder.name}.{k}" for k in (1, 2, 3)]
    assert log.duration == pytest.approx(4434.6, abs=0.5)
    derived = np.genfromtxt(folder / "derived_10hz.csv", delimiter=",", names=True)
    inside = (log.time > derived["time_s"][0]) & (log.time < derived["time_s"][-1])
    columns = dict(zip("uvw", log.velocity.T[:3], strict=True)) | {"depth_m": log.position[:, 2]}
    columns |= {f"{name}_rad": log.command(name) for name in ("rudder", "elevator")}
    for name, column in columns.items():
        reference = np.interp(log.time, derived["time_s"], derived[name])
        assert np.corrcoef(reference[inside], column[inside])[0, 1] > 0.97, name
        assert np.sqrt(np.mean((reference - column)[inside] ** 2)) < 0.011, name
    for index, name in ((4, "q"), (5, "r")):  # the derived rates are smoothed
        reference = np.interp(log.time, derived["time_s"], derived[name])
        assert np.corrcoef(reference[inside], log.velocity[inside, index])[0, 1] > 0.93, name
    assert any("no message for longer than 1 s" in note for note in log.notes)
