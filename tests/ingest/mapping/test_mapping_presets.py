"""Presets, each on messages as their standard or firmware writes them."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.data.attitude import euler_from_quaternion, turn
from hydrodamp.data.log import Log
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import GapWarning, LogError
from hydrodamp.ingest.mapping import LogMapping, read_mapping
from hydrodamp.ingest.read import read_log, read_logs

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "bluerov2" / "mapping.yaml"
FLIP, SWAP = np.diag([1.0, -1, -1]), np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])


class Dive:
    """Two turns of a tilted circle, forward-right-down and north-east-down, in closed form."""

    def __init__(self, time: np.ndarray) -> None:
        self.time = time
        yaw = 0.3 * time
        angles = np.column_stack((yaw, 0.1 * np.sin(time), 0.2 * np.cos(time)))
        self.attitude = Rotation.from_euler("ZYX", angles)
        self.velocity = np.column_stack((1 + 0 * time, 0.1 * np.sin(time), 0.05 * np.cos(time)))
        self.world = self.attitude.apply(self.velocity)
        self.rates = np.column_stack((0.1 * np.cos(time), 0 * time, 0.3 + 0 * time))

    def enu(self) -> np.ndarray:
        """Quaternions of port-up axes in east-north-up, scalar last."""
        return Rotation.from_matrix(SWAP @ self.attitude.as_matrix() @ FLIP).as_quat()


def close(log: Log, *, position: bool = False) -> None:
    """Check a log against the dive at its times."""
    dive = Dive(log.time)
    np.testing.assert_allclose(log.velocity, np.hstack((dive.velocity, dive.rates)), atol=2e-3)
    assert log.attitude is not None
    apart = Rotation.from_quat(log.attitude, scalar_first=True) * dive.attitude.inv()
    np.testing.assert_allclose(apart.magnitude(), 0, atol=1e-3)
    if position:
        assert log.position is not None
        np.testing.assert_allclose(log.position, np.outer(log.time, [1, 2, 3]), atol=1e-9)


def read(recording: Recording, mapping: LogMapping) -> Log:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", GapWarning)
        return mapping.log(recording)


def vector(name: str, values: np.ndarray, parts: str = "xyz") -> dict[str, np.ndarray]:
    return {f"{name}.{part}": column for part, column in zip(parts, values.T, strict=True)}


def array(name: str, values: np.ndarray) -> dict[str, np.ndarray]:
    return {f"{name}[{index}]": column for index, column in enumerate(values.T)}


@pytest.mark.parametrize("topic", ["/odom", "/my/odometry"])
def test_odometry_of_rep_103(topic: str) -> None:
    time = np.arange(0, 20, 0.05)
    dive = Dive(time)
    fields = {
        **vector("pose.pose.position", np.outer(time, [2, 1, -3])),
        **vector("pose.pose.orientation", dive.enu(), "xyzw"),
        **vector("twist.twist.linear", dive.velocity @ FLIP),
        **vector("twist.twist.angular", dive.rates @ FLIP),
        "header.stamp": time,
    }
    recording = Recording((Topic(topic, time + 0.3, fields),), "dive.mcap", "a test")
    given = {"extends": "rep103-odometry"}
    if topic != "/odom":
        with pytest.raises(
            LogError, match=r"no topic `odometry`.*`topics: \{odometry: ITS NAME\}`"
        ):
            LogMapping.from_dict(given).log(recording)
        given["topics"] = {"odometry": topic}
    close(LogMapping.from_dict(given).log(recording), position=True)


def test_a_bag_beside_mavros() -> None:
    time, slow, late = np.arange(0, 20, 0.02), np.arange(0.01, 20, 0.1), np.arange(0.03, 20, 0.05)
    imu, body = Dive(time), Dive(slow)
    recording = Recording(
        (
            Topic(
                "/mavros/imu/data",
                time,
                {
                    **vector("orientation", imu.enu(), "xyzw"),
                    **vector("angular_velocity", imu.rates @ FLIP),
                    **vector("linear_acceleration", np.tile([0, 0, 9.8], (len(time), 1))),
                },
            ),
            Topic(
                "/mavros/local_position/velocity_body",
                slow,
                vector("twist.linear", body.velocity @ FLIP),
            ),
            Topic(
                "/mavros/local_position/pose",
                slow,
                vector("pose.position", np.outer(slow, [2, 1, -3])),
            ),
            Topic(
                "/mavros/rc/out", late, array("channels", np.tile([1500, 1900.0], (len(late), 1)))
            ),
        ),
        "dive.bag",
        "a test",
    )
    log = read(recording, read_mapping("mavros"))
    close(log, position=True)
    assert log.command_names == ("servo1", "servo2")
    np.testing.assert_allclose(log.commands[0], [0, 1])
    assert log.specific_force is not None
    np.testing.assert_allclose(log.specific_force[0], [0, 0, -9.8])


@pytest.mark.parametrize("core", ["XKF1[0]", "NKF1"])
def test_a_dataflash_log_of_ardusub(core: str) -> None:
    time, slow = np.arange(0, 20, 0.05), np.arange(0.01, 20, 0.1)
    fast, body = Dive(time), Dive(slow)
    roll, pitch, yaw = np.degrees(fast.attitude.as_euler("ZYX")[:, ::-1].T)
    p, q, r = np.degrees(fast.rates.T)
    estimated = {f"V{axis}": column for axis, column in zip("NED", body.world.T, strict=True)}
    estimated |= {f"P{axis}": slow * rate for axis, rate in zip("NED", (1, 2, 3), strict=True)}
    other = Topic("XKF1[1]", slow, {name: column + 9 for name, column in estimated.items()})
    recording = Recording(
        (
            Topic("ATT", time, {"Roll": roll, "Pitch": pitch, "Yaw": yaw % 360}),
            Topic("RATE", time, {"R": p, "P": q, "Y": r}),
            Topic(core, slow, estimated, units={"VN": "m/s"}),
            other,
            Topic("RCOU", slow, {f"C{k}": 1100.0 + 0 * slow for k in range(1, 7)}),
        ),
        "0001.BIN",
        "a test",
    )
    log = read(recording, read_mapping("ardusub"))
    close(log, position=True)
    assert log.command_names == tuple(f"servo{k}" for k in range(1, 7))
    assert set(log.commands.ravel().tolist()) == {-1.0}


def test_a_log_of_px4() -> None:
    time, slow, mid = np.arange(0, 20, 0.02), np.arange(0.01, 20, 0.1), np.arange(0.03, 20, 0.05)
    fast, body, turned = Dive(time), Dive(slow), Dive(mid)
    q = turned.attitude.as_quat(scalar_first=True).astype(np.float32)
    local = {f"v{axis}": column for axis, column in zip("xyz", body.world.T, strict=True)}
    local |= {axis: slow * rate for axis, rate in zip("xyz", (1, 2, 3), strict=True)}
    local["v_xy_valid"] = np.ones(len(slow))
    recording = Recording(
        (
            Topic("vehicle_angular_velocity", time, array("xyz", fast.rates)),
            Topic("vehicle_attitude", mid, array("q", q)),
            Topic("vehicle_local_position", slow, local),
            Topic(
                "vehicle_thrust_setpoint", slow, array("xyz", np.tile([0.5, 0, 0], (len(slow), 1)))
            ),
        ),
        "log_1.ulg",
        "a test",
    )
    log = read(recording, read_mapping("px4-uuv"))
    close(log, position=True)
    assert log.command_names == ("thrust_x", "thrust_y", "thrust_z")


def test_the_preset_of_the_tank_runs_is_the_mapping_of_the_example(
    bluerov2_runs: list[Path],
) -> None:
    ours, theirs = (read_logs(bluerov2_runs, one) for one in ("bluerov2-kth", EXAMPLE))
    assert ours.time.tolist() == theirs.time.tolist()
    np.testing.assert_array_equal(ours.velocity, theirs.velocity)
    np.testing.assert_array_equal(ours.attitude, theirs.attitude)
    np.testing.assert_array_equal(ours.commands, theirs.commands)
    assert ours.command_names == theirs.command_names
    assert ours.segments == theirs.segments


def test_the_tanker_moves_as_its_position_says(kvlcc2_runs: list[Path]) -> None:
    """Every zigzag: u v r against differences of position and heading at 20 Hz."""
    for path in kvlcc2_runs:
        log = read_log(path, "kvlcc2-hsva")
        assert log.velocity_names == ("u", "v", "r")
        assert log.position is not None
        assert log.attitude is not None
        mean = (log.velocity[1:] + log.velocity[:-1]) / 2
        step = np.diff(log.time)[:, np.newaxis]
        yaw = euler_from_quaternion(log.attitude)[:, 2]
        middle = np.unwrap(yaw)[:-1] + np.diff(np.unwrap(yaw)) / 2
        north, east = (np.diff(log.position, axis=0) / step)[:, :2].T
        along = north * np.cos(middle) + east * np.sin(middle)
        across = east * np.cos(middle) - north * np.sin(middle)
        yawing = turn(log.attitude[:-1], log.attitude[1:])[:, 2] / np.diff(log.time)
        for recorded, slope, least in ((0, along, 3e-3), (1, across, 3e-3), (5, yawing, 2e-3)):
            error = np.sqrt(np.mean((mean[:, recorded] - slope) ** 2))
            assert error < least, (path.name, recorded)
        assert np.abs(log.command("rudder")).max() < np.radians(36)


def test_the_690_becomes_one_log_of_many_topics(vt690_folder: Path) -> None:
    """Against the log on one clock that others derived from the same files."""
    with pytest.warns(GapWarning):
        log = read_log(vt690_folder, "avl690")
    assert log.velocity_names == VELOCITIES
    assert [part.name for part in log.segments] == [f"{vt690_folder.name}.{k}" for k in (1, 2, 3)]
    assert log.duration == pytest.approx(4434.6, abs=0.5)
    derived = np.genfromtxt(vt690_folder / "derived_10hz.csv", delimiter=",", names=True)
    inside = (log.time > derived["time_s"][0]) & (log.time < derived["time_s"][-1])
    assert log.position is not None
    columns = {"u": log.velocity[:, 0], "v": log.velocity[:, 1], "w": log.velocity[:, 2]}
    columns |= {"rudder_rad": log.command("rudder"), "elevator_rad": log.command("elevator")}
    columns |= {"depth_m": log.position[:, 2]}
    for name, column in columns.items():
        other = np.interp(log.time, derived["time_s"], derived[name])
        assert np.corrcoef(other[inside], column[inside])[0, 1] > 0.97, name
        assert np.sqrt(np.mean((other - column)[inside] ** 2)) < 0.011, name
    for index, name in ((3, "p"), (4, "q"), (5, "r")):  # the derived rates are smoothed
        other = np.interp(log.time, derived["time_s"], derived[name])
        assert np.corrcoef(other[inside], log.velocity[inside, index])[0, 1] > 0.93, name
    assert any("no message for longer than 1 s" in note for note in log.notes)
    assert any("roll from the mixing" in note for note in log.notes)
