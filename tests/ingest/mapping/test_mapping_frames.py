"""Axes there and back again, against SciPy's rotations and the definitions of the frames."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis.extra.numpy import arrays
from hypothesis.strategies import floats, sampled_from
from scipy.spatial.transform import Rotation

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.ingest.mapping import LogMapping

# Rows are the axes of each world in north-east-down, and of each body in forward-starboard-down.
WORLDS = {
    "NED": np.eye(3),
    "NWU": np.diag([1.0, -1, -1]),
    "ENU": np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]]),
}
BODIES = {"FRD": np.eye(3), "FLU": np.diag([1.0, -1, -1])}
MOTIONS = arrays(float, (4, 9), elements=floats(-1.4, 1.4))
CASES = sampled_from([("FRD", "NED"), ("FLU", "NWU"), ("FLU", "ENU")])


def recording(**columns: np.ndarray) -> Recording:
    return Recording((Topic("", None, columns),), "log.parquet", "a test")


def recorded(motion: np.ndarray, body: str, world: str) -> tuple[Rotation, np.ndarray, np.ndarray]:
    """Return attitude, velocity and rates as a log with such axes would hold them."""
    ours = Rotation.from_euler("ZYX", motion[:, [2, 1, 0]])
    theirs = Rotation.from_matrix(WORLDS[world] @ ours.as_matrix() @ BODIES[body].T)
    return theirs, motion[:, 3:6] @ BODIES[body].T, motion[:, 6:] @ BODIES[body].T


@settings(deadline=None, max_examples=60)
@given(MOTIONS, CASES, sampled_from(["euler", "quaternion"]))
def test_axes_there_and_back(motion: np.ndarray, case: tuple[str, str], form: str) -> None:
    body, world = case
    turned, velocity, rates = recorded(motion, body, world)
    if form == "euler":
        names = ("roll", "pitch", "yaw")
        attitude = turned.as_euler("ZYX")[:, ::-1]
    else:
        names = ("qw", "qx", "qy", "qz")
        attitude = turned.as_quat(scalar_first=True)
    columns = dict(zip(names, attitude.T, strict=True))
    columns |= dict(zip("uvw", velocity.T, strict=True)) | dict(zip("pqr", rates.T, strict=True))
    columns |= {"fin": np.arange(4.0)}
    mapping = LogMapping.from_dict(
        {
            "frame": body,
            "world": world,
            "time": "t",
            "attitude": {name: name for name in names},
            "velocity": {name: name for name in "uvwpqr"},
            "wrench": dict(zip("XYZKMN", "uvwpqr", strict=True)),
            "commands": ["fin"],
        }
    )
    record = mapping.record(recording(t=np.arange(4.0), **columns))
    np.testing.assert_array_equal(record.velocity, motion[:, 3:])
    np.testing.assert_array_equal(record.blocks["wrench"], motion[:, 3:])
    assert record.commands["fin"].tolist() == [0, 1, 2, 3]
    back = Rotation.from_quat(record.blocks["attitude"], scalar_first=True)
    ours = Rotation.from_euler("ZYX", motion[:, [2, 1, 0]])
    np.testing.assert_allclose((back * ours.inv()).magnitude(), 0, atol=1e-7)


def test_a_heading_is_that_of_a_compass_in_every_world() -> None:
    for frame, world in (("FRD", "NED"), ("FLU", "ENU")):
        mapping = LogMapping.from_dict(
            {
                "frame": frame,
                "world": world,
                "time": "t",
                "attitude": {"heading": {"column": "h", "unit": "deg"}},
                "velocity": {"north": "n", "east": "e"},
            }
        )
        given = recording(
            t=np.arange(2.0), h=np.array([90.0, 90]), n=np.array([0.0, 1]), e=np.array([1.0, 0])
        )
        record = mapping.record(given)
        np.testing.assert_allclose(record.velocity[:, :2], [[1, 0], [0, -1]], atol=1e-15)
        assert record.velocity_names == ("u", "v")


@settings(deadline=None, max_examples=40)
@given(MOTIONS)
def test_velocities_of_the_world_become_those_of_the_body(motion: np.ndarray) -> None:
    turned = Rotation.from_euler("ZYX", motion[:, [2, 1, 0]])
    north, east, down = turned.apply(motion[:, 3:6]).T
    given = recording(
        t=np.arange(4.0),
        **dict(zip(("roll", "pitch", "yaw"), motion[:, :3].T, strict=True)),
        n=north,
        e=east,
        up=-down,
    )
    mapping = LogMapping.from_dict(
        {
            "time": "t",
            "attitude": {name: name for name in ("roll", "pitch", "yaw")},
            "velocity": {"north": "n", "east": "e", "up": "up"},
        }
    )
    np.testing.assert_allclose(mapping.record(given).velocity[:, :3], motion[:, 3:6], atol=1e-12)


@settings(deadline=None, max_examples=40)
@given(MOTIONS)
def test_a_sensor_turned_and_moved_in_the_vehicle(motion: np.ndarray) -> None:
    """What rigid kinematics says a sensor measures comes back as the motion of the body."""
    angles = np.array([10.0, -20.0, 45.0])
    place = np.array([0.4, -0.1, 0.2])
    sits = Rotation.from_euler("ZYX", angles[::-1], degrees=True)
    velocity, rates = motion[:, 3:6], motion[:, 6:]
    body = Rotation.from_euler("ZYX", motion[:, [2, 1, 0]])
    measured = sits.inv().apply(velocity + np.cross(rates, place))
    gyro = sits.inv().apply(rates)
    quaternion = (body * sits).as_quat(scalar_first=True)
    given = recording(
        t=np.arange(4.0),
        **dict(zip("uvw", measured.T, strict=True)),
        **dict(zip("pqr", gyro.T, strict=True)),
        **dict(zip(("qw", "qx", "qy", "qz"), quaternion.T, strict=True)),
    )
    turn = {"rotation": dict(zip(("roll", "pitch", "yaw"), angles.tolist(), strict=True))}
    mapping = LogMapping.from_dict(
        {
            "time": "t",
            "attitude": {name: name for name in ("qw", "qx", "qy", "qz")},
            "velocity": {name: name for name in "uvwpqr"},
            "sensors": {
                "velocity": {**turn, "position": place.tolist()},
                "rates": turn,
                "attitude": turn,
            },
        }
    )
    record = mapping.record(given)
    np.testing.assert_allclose(record.velocity, motion[:, 3:], atol=1e-12)
    back = Rotation.from_quat(record.blocks["attitude"], scalar_first=True)
    np.testing.assert_allclose((back * body.inv()).magnitude(), 0, atol=1e-7)


def test_mountings_are_given_in_the_axes_of_the_mapping() -> None:
    """A Doppler log half a metre ahead, a fifth to port, a tenth up, turned 30 degrees to port."""
    content = {
        "frame": "FLU",
        "time": "t",
        "velocity": {name: name for name in "uvwr"},
        "sensors": {
            "velocity": {"rotation": {"yaw": 30.0}, "position": [0.5, 0.2, 0.1], "axes": "FLU"}
        },
    }
    mounting = LogMapping.from_dict(content).mounting("velocity")
    np.testing.assert_allclose(mounting.angles, [0, 0, -np.pi / 6])
    assert mounting.position == (0.5, -0.2, -0.1)
    ahead = LogMapping.from_dict(content).record(
        recording(t=np.arange(2.0), u=np.ones(2), v=np.zeros(2), w=np.zeros(2), r=np.zeros(2))
    )
    np.testing.assert_allclose(ahead.velocity[0, :3], [np.cos(np.pi / 6), -0.5, 0])


def test_a_sensor_may_have_axes_of_its_own() -> None:
    """A Doppler log forward-starboard-down on a vehicle whose gyroscope is z up."""
    mapping = LogMapping.from_dict(
        {
            "frame": "FLU",
            "time": "t",
            "velocity": {name: name for name in "vr"},
            "sensors": {"velocity": {"axes": "FRD"}},
        }
    )
    record = mapping.record(recording(t=np.arange(2.0), v=np.ones(2), r=np.ones(2)))
    assert record.velocity[0].tolist() == [0, 1, 0, 0, 0, -1]


def test_an_accelerometer_at_rest_feels_the_ground_push_up() -> None:
    mapping = LogMapping.from_dict(
        {
            "frame": "FLU",
            "time": "t",
            "velocity": {"u": "u"},
            "specific_force": {"fx": "x", "fy": "y", "fz": {"column": "z", "unit": "g"}},
            "position": {"north": "n", "depth": "d"},
        }
    )
    still = np.zeros(2)
    record = mapping.record(
        recording(t=np.arange(2.0), u=still, x=still, y=still, z=np.ones(2), n=still, d=still + 7)
    )
    np.testing.assert_allclose(record.blocks["specific_force"][0], [0, 0, -9.80665])
    assert record.blocks["position"][0].tolist() == [0, 0, 7]
