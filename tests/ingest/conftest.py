"""One dive in closed form, written down the ways that loggers write."""

import numpy as np
import pytest

from hydrodamp.data.recording import Recording, Topic
from strangers import Truth, name_columns, ros_odometry


@pytest.fixture(scope="session")
def dive():
    """The dive."""
    return Truth()


@pytest.fixture
def table():
    """Return a function that makes a recording of one table."""

    def make(**columns):
        return Recording((Topic("", None, columns),), "dive.csv", "text in columns")

    return make


@pytest.fixture
def px4(dive):
    """The dive as PX4 logs it: earth-fixed velocities, quaternion with w first."""
    time, position, speed = dive.time, dive.place.T, dive.world.T
    moves = name_columns("x y z vx vy vz ax", np.vstack((position, speed, 0 * time)).T)
    attitude = {f"q[{k}]": dive.q_ned[:, k] for k in range(4)}
    return Recording(
        (
            Topic("vehicle_attitude", time, {**attitude, "quat_reset_counter": 0 * time}),
            Topic("vehicle_local_position", time, {**moves, "v_xy_valid": 1 + 0 * time}),
            Topic(
                "vehicle_angular_velocity", time, {f"xyz[{k}]": dive.rates[:, k] for k in range(3)}
            ),
            Topic("vehicle_thrust_setpoint", time, {"xyz[0]": dive.rudder}),
        ),
        "dive.ulg",
        "PX4 ULog",
    )


@pytest.fixture
def ardusub(dive):
    """The dive as ArduSub logs it: degrees, pulse widths, an accelerometer."""
    time = dive.time
    attitude = name_columns("Roll Pitch Yaw", np.degrees(dive.angles))
    attitude |= {"Yaw": attitude["Yaw"] % 360, "DesRoll": 0 * time}
    units = {"Roll": "deg", "Pitch": "deg", "Yaw": "degheading"}
    gyro = name_columns("GyrX GyrY GyrZ", dive.rates)
    force = {"AccX": 0 * time, "AccY": 0 * time, "AccZ": -9.8 + 0.1 * np.sin(time)}
    world = name_columns("VN VE VD PN PE PD", np.hstack((dive.world, dive.place)))
    return Recording(
        (
            Topic("ATT", time, attitude, units=units),
            Topic("XKF1", time, {"C": 0 * time, **world}),
            Topic("IMU", time, {**gyro, **force}),
            Topic("RCOU", time, {"C1": 1500 + 100 * dive.rudder}),
        ),
        "dive.bin",
        "ArduPilot log",
    )


@pytest.fixture
def odometry(dive):
    """Return a function that writes the dive as ROS does, by REP 103, under the name of a topic."""

    def make(topic):
        fields = {"header.stamp": dive.time, **ros_odometry(dive)}
        return Recording((Topic(topic, dive.time + 0.3, fields),), "dive.mcap", "ROS 2 bag (MCAP)")

    return make
