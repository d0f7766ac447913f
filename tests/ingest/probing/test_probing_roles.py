from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.probing.names import hint
from hydrodamp.ingest.probing.probe import probe

Table = Callable[..., Recording]


@pytest.mark.parametrize(
    ("topic", "field", "unit", "role"),
    [
        ("/rov/odom", "twist.twist.angular.y", None, "velocity.q"),
        ("/rov/odom", "pose.pose.orientation.w", None, "attitude.qw"),
        ("/rov/odom", "twist.covariance[3]", None, None),
        ("IMU", "AccZ", "m/s^2", "specific_force.fz"),
        ("RATE", "Y", "deg/s", "velocity.r"),
        ("ATT", "DesYaw", "deg", None),
        ("XKF1", "VD", "m/s", "velocity.down"),
        ("share_node.fins", "top", "rad", "commands"),
        ("share_node.yaw_pid", "yaw_setpoint", "rad", None),
        ("share_node.depth", "depth_filt", "m", "position.depth"),
        ("", "yaw_rate", None, "velocity.r"),
        ("", "yaw", "m/s", None),
        ("", "velocity_north", "m/s", "velocity.north"),
        ("", "north", "m", "position.north"),
        ("dvl", "data_good", "bool", "flag"),
        ("", "ch_yaw", None, "commands"),
        ("", "temperature", None, None),
        ("", "log.vel.u", None, "velocity.u"),
        ("", "nu[4]", None, "velocity.q"),
        ("/rov/tau", "wrench.torque.z", None, "wrench.N"),
        ("/rov/torque", "vector.x", None, "wrench.K"),
        ("/rov/torque_setpoint", "vector.x", None, "commands"),
        ("/thruster_forces", "data[0]", None, "commands"),
        ("", "mag.x", None, None),
        ("", "u_meas", None, "velocity.u"),
        ("", "psi_measured", None, "attitude.yaw"),
        ("SERVO_OUTPUT_RAW", "servo3_raw", None, "commands"),
        ("ATTITUDE", "yawspeed", None, "velocity.r"),
        ("LOCAL_POSITION_NED", "vy", None, "velocity.east"),
        ("", "nu.z", None, "velocity.w"),
        ("", "u_sim", None, None),
        ("", "Surge", "kn", "velocity.u"),
        ("/euler", "vector.z", None, "attitude.yaw"),
    ],
)
def test_names(topic: str, field: str, unit: str | None, role: str | None) -> None:
    beside = (
        {f"{field[:-1]}w"} if "orientation" in field else {field, *(f"nu[{k}]" for k in range(6))}
    )
    said, sure = hint(topic, field, unit, beside)
    assert (said if sure else None) == role


def test_px4_is_earth_fixed_and_comes_back(px4: Recording, dive) -> None:
    found = probe(px4)
    assert found.roles.way.earth_fixed is True
    assert (found.roles.upright.body, found.roles.world) == ("FRD", "NED")
    assert [one.name for one in found.presets] == ["px4-uuv"]
    assert found.roles.chosen("specific_force.fx") is None
    dive.check(found.mapping().log(px4))


def test_ardusub_in_degrees_comes_back(ardusub: Recording, dive) -> None:
    found = probe(ardusub)
    assert found.roles.rates.unit == "rad/s"
    assert "attitude:\n  roll: {column: ATT.Roll, unit: deg}" in found.draft.text
    assert [one.name for one in found.presets] == ["ardusub"]
    assert found.roles.upright.confidence == 99
    dive.check(found.mapping().log(ardusub))


def test_axes_and_units_of_every_sensor_are_found(table: Table, dive) -> None:
    """Attitude and velocity with z up, rates in deg/s with z down, an accelerometer tells."""
    flip = np.array([1.0, 1.0, -1.0, -1.0])
    up = np.array([1.0, -1.0, -1.0])
    recording = table(
        t_ms=1000 * dive.time + 1e6,
        **{
            f"q{part}": column
            for part, column in zip("wxyz", (dive.quaternion * flip).T, strict=True)
        },
        **{f"gyro_{a}": column for a, column in zip("xyz", np.degrees(dive.rates).T, strict=True)},
        **{f"v{a}": column for a, column in zip("xyz", (dive.body * up).T, strict=True)},
        **dict(zip("xyz", (dive.position * up).T, strict=True)),
        acc_z=9.81 + 0.1 * np.sin(dive.time),
        rpm=dive.rudder,
    )
    found = probe(recording)
    roles = found.roles
    assert (roles.upright.body, roles.world, roles.way.earth_fixed) == ("FLU", "NWU", False)
    assert roles.rates.unit == "deg/s"
    assert roles.rates.mirrored
    assert roles.clocks[""].unit == "ms"
    dive.check(found.mapping().log(recording))


def test_velocities_in_other_axes_than_the_attitude(table: Table, dive) -> None:
    up = np.array([1.0, -1.0, -1.0])
    recording = table(
        time_s=dive.time,
        **dict(zip(("roll", "pitch", "yaw"), dive.angles.T, strict=True)),
        **dict(zip(("vx", "vy", "vz"), (dive.body * up).T, strict=True)),
        **dict(zip("pqr", dive.rates.T, strict=True)),
        **dict(zip("xyz", dive.position.T, strict=True)),
        depth=dive.position[:, 2] + 3,
    )
    found = probe(recording)
    assert found.roles.way.mirrored
    assert not found.roles.rates.mirrored
    assert "velocity: {axes: FLU}" in found.draft.text
    dive.check(found.mapping().log(recording))


def test_numbers_alone_are_no_roles(table: Table) -> None:
    time = np.arange(0.0, 60.0, 0.1)
    found = probe(table(a=time, b=np.cos(time), c=np.sin(time)))
    assert [(one.column, one.role) for one in found.roles.guesses] == [("a", "time")]
    assert found.without_role == ("b", "c")
    assert found.draft.confidence == 0
    with pytest.raises(LogError):
        found.mapping()


def test_depth_tells_which_way_is_down(dive) -> None:
    up = dive.body * (1.0, -1.0, -1.0)
    angles = dive.angles * (1.0, -1.0, -1.0)
    for body, angle, depth, axes in (
        (dive.body, dive.angles, dive.position[:, 2], "FRD"),
        (up, angles, dive.position[:, 2], "FLU"),
    ):
        recording = Recording(
            (
                Topic("dvl", dive.time, dict(zip(("v_x", "v_y", "v_z"), body.T, strict=True))),
                Topic("ahrs", dive.time, dict(zip(("roll", "pitch", "yaw"), angle.T, strict=True))),
                Topic("ctd", dive.time[::2], {"depth": depth[::2] + 5}),
            ),
            "dive",
            "text in columns",
        )
        upright = probe(recording).roles.upright
        assert upright.body == axes
        assert upright.confidence > 90


def test_bad_rows_are_left_out_and_flagged(dive) -> None:
    good = np.ones(1200)
    good[100:140] = 0.0
    speed = np.where(good[:, np.newaxis] == 1.0, dive.body, -32.768)
    fields = dict(zip(("v_x", "v_y", "v_z"), speed.T, strict=True))
    recording = Recording(
        (
            Topic("dvl.velocity", dive.time, {**fields, "data_good": good}),
            Topic("control.yaw_pid", dive.time, {"yaw_input": dive.angles[:, 2]}),
            Topic("control.pitch_pid", dive.time, {"pitch_input": dive.angles[:, 1]}),
        ),
        "dive",
        "text in columns",
    )
    text = probe(recording).draft.text
    assert "u: {column: dvl.velocity.v_x, where: data_good}" in text
    assert "roll: {value: 0.0}" in text


def test_preset_with_another_topic(odometry: Callable[[str], Recording], dive) -> None:
    """Odometry under a name of its own: the preset fits, given the topic."""
    recording = odometry("/rov/state")
    found = probe(recording)
    (preset,) = found.presets
    assert (preset.name, preset.topics) == ("rep103-odometry", (("odometry", "/rov/state"),))
    assert "time: [header.stamp, recorded]" in found.draft.text
    assert found.roles.world == "ENU"
    dive.check(found.mapping().log(recording))
