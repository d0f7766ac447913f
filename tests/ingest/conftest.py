"""One dive in closed form, written down the ways that loggers write."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hydrodamp.data.log import Log
from hydrodamp.data.recording import Recording, Topic

FLIP = np.array([1.0, -1.0, -1.0])  # turns axes with z down into those with z up, and back


class Dive:
    """Two minutes of turning, pitching and rolling; FRD over NED, by scipy's rotations."""

    def __init__(self) -> None:
        self.time = np.arange(0.0, 120.0, 0.1)
        time = self.time
        self.angles = np.column_stack(
            (0.1 * np.sin(0.5 * time), 0.2 * np.sin(0.31 * time), 0.8 * np.sin(0.2 * time))
        )
        self.turns = turns = Rotation.from_euler("ZYX", self.angles[:, ::-1])
        self.quaternion = turns.as_quat(scalar_first=True)
        self.body = np.column_stack(
            (1 + 0.5 * np.sin(0.4 * time), 0.2 * np.sin(0.6 * time), 0.1 * np.cos(0.5 * time))
        )
        self.world = turns.apply(self.body)
        self.position = np.cumsum(self.world * 0.1, axis=0)
        steps = (turns[:-1].inv() * turns[1:]).as_rotvec() / 0.1
        self.rates = np.vstack((steps, steps[-1:]))
        self.rudder = np.sign(np.sin(0.3 * time))

    def enu(self) -> np.ndarray:
        """Quaternions of port-up axes in east-north-up, scalar last."""
        swap = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])
        return Rotation.from_matrix(swap @ self.turns.as_matrix() @ np.diag(FLIP)).as_quat()

    def check(self, log: Log) -> None:
        """Check that a log is the dive, its position too where it has one."""
        np.testing.assert_allclose(log.velocity, np.hstack((self.body, self.rates)), atol=1e-9)
        apart = Rotation.from_quat(log.attitude, scalar_first=True) * self.turns.inv()
        np.testing.assert_allclose(apart.magnitude(), 0, atol=1e-7)
        if log.position is not None:
            np.testing.assert_allclose(log.position, self.position, atol=1e-9)


@pytest.fixture(scope="session")
def dive() -> Dive:
    """The dive."""
    return Dive()


@pytest.fixture
def table() -> Callable[..., Recording]:
    """Return a function that makes a recording of one table."""

    def make(**columns: np.ndarray) -> Recording:
        return Recording((Topic("", None, columns),), "dive.csv", "text in columns")

    return make


@pytest.fixture
def px4(dive: Dive) -> Recording:
    """The dive as PX4 logs it: earth-fixed velocities, quaternion with w first."""
    time, place, speed = dive.time, dive.position.T, dive.world.T
    position = dict(zip(("x", "y", "z"), place, strict=True))
    velocity = dict(zip(("vx", "vy", "vz", "ax"), (*speed, 0 * time), strict=True))
    attitude = {f"q[{k}]": dive.quaternion[:, k] for k in range(4)}
    return Recording(
        (
            Topic("vehicle_attitude", time, {**attitude, "quat_reset_counter": 0 * time}),
            Topic(
                "vehicle_local_position", time, {**position, **velocity, "v_xy_valid": 1 + 0 * time}
            ),
            Topic(
                "vehicle_angular_velocity", time, {f"xyz[{k}]": dive.rates[:, k] for k in range(3)}
            ),
            Topic("vehicle_thrust_setpoint", time, {"xyz[0]": dive.rudder}),
        ),
        "dive.ulg",
        "PX4 ULog",
    )


@pytest.fixture
def ardusub(dive: Dive) -> Recording:
    """The dive as ArduSub logs it: degrees, pulse widths, an accelerometer."""
    time, angles = dive.time, np.degrees(dive.angles)
    gyro = {f"Gyr{axis}": column for axis, column in zip("XYZ", dive.rates.T, strict=True)}
    force = {"AccX": 0 * time, "AccY": 0 * time, "AccZ": -9.8 + 0.1 * np.sin(time)}
    world = zip(
        ("VN", "VE", "VD", "PN", "PE", "PD"), (*dive.world.T, *dive.position.T), strict=True
    )
    return Recording(
        (
            Topic(
                "ATT",
                time,
                {
                    "Roll": angles[:, 0],
                    "DesRoll": 0 * time,
                    "Pitch": angles[:, 1],
                    "Yaw": angles[:, 2] % 360,
                },
                units={"Roll": "deg", "Pitch": "deg", "Yaw": "degheading"},
            ),
            Topic("XKF1", time, {"C": 0 * time, **dict(world)}),
            Topic("IMU", time, {**gyro, **force}),
            Topic("RCOU", time, {"C1": 1500 + 100 * dive.rudder}),
        ),
        "dive.bin",
        "ArduPilot log",
    )


@pytest.fixture
def odometry(dive: Dive) -> Callable[[str], Recording]:
    """Return a function that writes the dive as ROS does, by REP 103, under the name of a topic."""

    def make(topic: str) -> Recording:
        fields = {"header.stamp": dive.time}
        for name, parts, values in (
            ("pose.pose.position", "xyz", dive.position[:, [1, 0, 2]] * (1, 1, -1)),
            ("pose.pose.orientation", "xyzw", dive.enu()),
            ("twist.twist.linear", "xyz", dive.body * FLIP),
            ("twist.twist.angular", "xyz", dive.rates * FLIP),
        ):
            fields |= {f"{name}.{part}": one for part, one in zip(parts, values.T, strict=True)}
        return Recording((Topic(topic, dive.time + 0.3, fields),), "dive.mcap", "ROS 2 bag (MCAP)")

    return make
