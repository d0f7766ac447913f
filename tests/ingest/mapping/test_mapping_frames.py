"""Axes there and back again, against SciPy's rotations and the definitions of the frames."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.extra.numpy import arrays
from hypothesis.strategies import floats, sampled_from
from scipy.spatial.transform import Rotation

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.ingest.mapping import LogMapping
from hydrodamp.ingest.mapping.assemble import build_record
from strangers import name_columns

# Rows are the axes of each world in north-east-down, and of each body in forward-starboard-down.
WORLDS = {
    "NED": np.eye(3),
    "NWU": np.diag([1.0, -1, -1]),
    "ENU": np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]]),
}
BODIES = {"FRD": np.eye(3), "FLU": np.diag([1.0, -1, -1])}
MOTIONS = arrays(float, (4, 9), elements=floats(-1.4, 1.4))
EULER, QUATERNION = "roll pitch yaw", "qw qx qy qz"
CASES = sampled_from([("FRD", "NED"), ("FLU", "NWU"), ("FLU", "ENU")])


def make_record(content, **columns):
    """Return the record that a mapping makes of columns a second apart."""
    columns["t"] = np.arange(float(len(next(iter(columns.values())))))
    recording = Recording((Topic("", None, columns),), "log.parquet", "a test")
    return build_record(LogMapping.from_dict({"time": "t", **content}), recording)


def by_name(names):
    """Return channels that are called as they are here."""
    return {name: name for name in names.split()}


def recorded(motion, body, world):
    """Return attitude, velocity and rates as a log with such axes would hold them."""
    ours = Rotation.from_euler("ZYX", motion[:, [2, 1, 0]])
    theirs = Rotation.from_matrix(WORLDS[world] @ ours.as_matrix() @ BODIES[body].T)
    return theirs, motion[:, 3:6] @ BODIES[body].T, motion[:, 6:] @ BODIES[body].T


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@given(MOTIONS, CASES, sampled_from([EULER, QUATERNION]))
def test_axes_there_and_back(motion, case, names):
    body, world = case
    turned, velocity, rates = recorded(motion, body, world)
    angles = turned.as_euler("ZYX")[:, ::-1]
    attitude = angles if names == EULER else turned.as_quat(scalar_first=True)
    record = make_record(
        {
            "frame": body,
            "world": world,
            "attitude": by_name(names),
            "velocity": by_name("u v w p q r"),
            "wrench": dict(zip("XYZKMN", "uvwpqr", strict=True)),
            "commands": ["fin"],
        },
        **name_columns(names, attitude),
        **name_columns("u v w p q r", np.hstack((velocity, rates))),
        fin=np.arange(4.0),
    )
    np.testing.assert_array_equal(record.blocks["velocity"], motion[:, 3:])
    np.testing.assert_array_equal(record.blocks["wrench"], motion[:, 3:])
    assert record.blocks["commands"][:, record.command_names.index("fin")].tolist() == [0, 1, 2, 3]
    back = Rotation.from_quat(record.blocks["attitude"], scalar_first=True)
    ours = Rotation.from_euler("ZYX", motion[:, [2, 1, 0]])
    np.testing.assert_allclose((back * ours.inv()).magnitude(), 0, atol=1e-7)


@pytest.mark.parametrize(("frame", "world"), [("FRD", "NED"), ("FLU", "ENU")])
def test_a_heading_is_that_of_a_compass_in_every_world(frame, world):
    content = {
        "frame": frame,
        "world": world,
        "attitude": {"heading": {"column": "h", "unit": "deg"}},
        "velocity": {"north": "n", "east": "e"},
    }
    record = make_record(
        content, h=np.array([90.0, 90]), n=np.array([0.0, 1]), e=np.array([1.0, 0])
    )
    np.testing.assert_allclose(record.blocks["velocity"][:, :2], [[1, 0], [0, -1]], atol=1e-15)
    assert record.velocity_names == ("u", "v")


@pytest.mark.slow
@settings(deadline=None, max_examples=40)
@given(MOTIONS)
def test_velocities_of_the_world_become_those_of_the_body(motion):
    turned = Rotation.from_euler("ZYX", motion[:, [2, 1, 0]])
    world = turned.apply(motion[:, 3:6]) * (1, 1, -1)
    content = {"attitude": by_name(EULER), "velocity": by_name("north east up")}
    record = make_record(
        content, **name_columns(EULER, motion[:, :3]), **name_columns("north east up", world)
    )
    np.testing.assert_allclose(record.blocks["velocity"][:, :3], motion[:, 3:6], atol=1e-12)


@pytest.mark.parametrize(
    ("latitude", "north", "east"),
    [(0.0, 110.574, 111.320), (45.0, 111.132, 78.847), (-60.0, 111.412, 55.800)],
)
@pytest.mark.parametrize("unit", ["deg", "rad", "degE7", "ddmm"])
def test_a_geographic_position_becomes_north_and_east(latitude, north, east, unit):
    """The lengths of a degree are those of the tables of WGS 84, in km; 180 degrees is no jump."""

    def write_in_unit(degrees):
        whole, rest = np.divmod(np.abs(degrees), 1.0)
        minutes = np.copysign(100.0 * whole + 60.0 * rest, degrees)
        return {"deg": degrees, "rad": np.radians(degrees), "degE7": 1e7 * degrees}.get(
            unit, minutes
        )

    angles = {
        "lat": write_in_unit(latitude + np.array([0.0, 0.01, 0.0, -0.01])),
        "lon": write_in_unit(np.array([179.995, -179.995, 179.985, 179.995])),
    }
    position = {"latitude": {"column": "lat", "unit": unit}}
    position |= {"longitude": {"column": "lon", "unit": unit}}
    record = make_record({"velocity": {"u": "u"}, "position": position}, u=np.ones(4), **angles)
    expected = [[0, 0, 0], [north, east, 0], [0, -east, 0], [-north, 0, 0]]
    np.testing.assert_allclose(record.blocks["position"], 10.0 * np.array(expected), atol=0.02)
    assert f"latitude {latitude:.7f} and longitude 179.9950000 deg" in record.notes[-1]


@pytest.mark.parametrize("is_split", [False, True])
def test_positions_without_a_fix_are_missing_between_other_clocks(is_split):
    time = np.arange(40.0)
    fixes = {"lat": 59.4 + 0.0 * time, "lon": 10.5 + 1e-6 * time}
    for values in fixes.values():
        values[:8] = values[20:23] = 0.0
    receivers = [{name: fixes[name]} for name in fixes] if is_split else [fixes]
    topics = [Topic(f"g{next(iter(fields))}", time, fields) for fields in receivers]
    topics.append(Topic("b", time + 0.3, {"u": np.ones(40)}))
    columns = ("glat.lat", "glon.lon" if is_split else "glat.lon")
    position = dict(zip(("latitude", "longitude"), columns, strict=True))
    content = {"time": "recorded", "velocity": {"u": "b.u"}, "position": position}
    record = build_record(LogMapping.from_dict(content), Recording((*topics,), "a.bag", "a test"))
    north, east, _ = record.blocks["position"].T
    is_fix = np.isfinite(east)
    assert not is_fix[:7].any()
    assert is_fix[9:].sum() > 20
    np.testing.assert_allclose(north[is_fix], 0.0, atol=1e-6)
    assert np.nanmax(np.abs(east)) < 5.0


def test_positions_without_a_fix_are_missing():
    columns = {"lat": np.array([0.0, 59.4, 59.4]), "lon": np.array([0.0, 10.5, 10.5])}
    position = {"latitude": "lat", "longitude": "lon"}
    record = make_record({"velocity": {"u": "u"}, "position": position}, u=np.ones(3), **columns)
    assert np.isnan(record.blocks["position"][0, :2]).all()
    assert record.blocks["position"][1:].tolist() == [[0, 0, 0], [0, 0, 0]]


@pytest.mark.parametrize("frame", ["FRD", "FLU"])
def test_a_speed_over_ground_has_the_axes_of_the_vehicle(frame):
    """The vehicle drifts to starboard where its course is clockwise from its heading."""
    course, heading = np.radians([10.0, 350.0, 181.0]), np.radians([350.0, 10.0, 181.0])
    path = {"speed": {"column": "s", "unit": "kn"}, "course": "c"}
    content = {"frame": frame, "attitude": {"heading": "h"}, "velocity": path}
    record = make_record(content, s=np.array([2.0, 2.0, 1.0]) / 0.514444444, c=course, h=heading)
    drift = np.radians([20.0, -20.0, 0.0])
    expected = np.array([2.0, 2.0, 1.0])[:, None] * np.column_stack((np.cos(drift), np.sin(drift)))
    np.testing.assert_allclose(record.blocks["velocity"][:, :2], expected, rtol=1e-8, atol=1e-12)


def test_a_speed_without_a_course_is_u():
    record = make_record({"velocity": {"speed": "s"}}, s=np.array([1.0, 2.0]))
    assert record.blocks["velocity"][:, 0].tolist() == [1.0, 2.0]
    assert "sway is not separated" in record.notes[-1]


@pytest.mark.slow
@settings(deadline=None, max_examples=40)
@given(MOTIONS)
def test_a_sensor_turned_and_moved_in_the_vehicle(motion):
    """What rigid kinematics says a sensor measures comes back as the motion of the body."""
    angles, lever_arm = np.array([10.0, -20.0, 45.0]), np.array([0.4, -0.1, 0.2])
    sits = Rotation.from_euler("ZYX", angles[::-1], degrees=True)
    velocity, rates = motion[:, 3:6], motion[:, 6:]
    body = Rotation.from_euler("ZYX", motion[:, [2, 1, 0]])
    measured = sits.inv().apply(velocity + np.cross(rates, lever_arm))
    turn = {"rotation": dict(zip(EULER.split(), angles.tolist(), strict=True))}
    record = make_record(
        {
            "attitude": by_name(QUATERNION),
            "velocity": by_name("u v w p q r"),
            "sensors": {
                "velocity": {**turn, "position": lever_arm.tolist()},
                "rates": turn,
                "attitude": turn,
            },
        },
        **name_columns("u v w p q r", np.hstack((measured, sits.inv().apply(rates)))),
        **name_columns(QUATERNION, (body * sits).as_quat(scalar_first=True)),
    )
    np.testing.assert_allclose(record.blocks["velocity"], motion[:, 3:], atol=1e-12)
    back = Rotation.from_quat(record.blocks["attitude"], scalar_first=True)
    np.testing.assert_allclose((back * body.inv()).magnitude(), 0, atol=1e-7)


def test_mountings_are_given_in_the_axes_of_the_mapping():
    """A Doppler log turned 30 degrees to port, half a metre ahead and a fifth to port."""
    sits = {"rotation": {"yaw": 30.0}, "position": [0.5, 0.2, 0.1], "axes": "FLU"}
    content = {"frame": "FLU", "velocity": by_name("u v w r"), "sensors": {"velocity": sits}}
    still = np.zeros(2)
    turning = make_record(content, u=np.ones(2), v=still, w=still, r=np.full(2, 0.5))
    ahead = np.array([np.cos(np.pi / 6), -0.5, 0])
    moved = np.cross([0, 0, -0.5], [0.5, -0.2, -0.1])
    np.testing.assert_allclose(turning.blocks["velocity"][0, :3], ahead - moved)
