"""Sign and zero of the yaw of a draft, decided by the motion along the position."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.data.attitude import euler_from_quaternion
from strangers import write_columns


def turns(seed, n=600):
    """Return time, position north and east, heading, u and v of a vessel that turns at 10 Hz."""
    rng = np.random.default_rng(seed)
    time = 0.1 * np.arange(n)
    phase = rng.uniform(-np.pi, np.pi, 2)
    rate = 0.2 * np.sin(0.5 * time + phase[0]) + 0.1 * np.sin(0.13 * time + phase[1])
    heading = np.cumsum(0.1 * rate) + rng.uniform(-3.0, 3.0)
    u = 2.0 + 0.1 * np.sin(0.3 * time)
    v = -0.5 * rate
    north = np.cumsum(0.1 * (u * np.cos(heading) - v * np.sin(heading)))
    east = np.cumsum(0.1 * (u * np.sin(heading) + v * np.cos(heading)))
    return time, north, east, heading, u, v


def read_draft(tmp_path, columns):
    found = hd.probe(hd.read_recording(write_columns(tmp_path / "log.csv", columns)))
    return found, hd.read_log(tmp_path / "log.csv", found.mapping())


def wrap(angle):
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sign", "zero", "has_speed"), [(1, 0, 0), (-1, 0, 0), (-1, np.pi / 2, 0), (1, np.pi, 1)]
)
def test_named_positions_decide_the_yaw(tmp_path, sign, zero, has_speed):
    """The true heading, of opposite sign, counterclockwise from east, and from south."""
    time, north, east, heading, u, v = turns(0)
    columns = {
        "time": time,
        "x_north": north,
        "y_east": east,
        "yaw_rad": wrap(zero + sign * heading),
    }
    _, log = read_draft(tmp_path, columns | ({"surge_mps": u, "sway_mps": v} if has_speed else {}))
    error = wrap(euler_from_quaternion(log.attitude)[:, 2] - np.interp(log.time, time, heading))
    assert np.abs(np.degrees(error)).max() < 0.1
    assert log.velocity[:, 0].mean() == pytest.approx(2.0, abs=0.05)
    np.testing.assert_allclose(log.velocity[5:-5, 1], v[5:-5], atol=0.06)


def test_a_vehicle_that_moves_astern_keeps_its_yaw(tmp_path):
    """Without a velocity nothing says which end is the bow."""
    time, north, east, heading, _, _ = turns(6)
    columns = {"time": time, "x_north": north, "y_east": east, "yaw_rad": wrap(heading + np.pi)}
    _, log = read_draft(tmp_path, columns)
    assert log.velocity[:, 0].mean() == pytest.approx(-2.0, abs=0.05)


def test_a_vehicle_that_moves_sideways_keeps_its_yaw(tmp_path):
    """Crabbing contradicts every yaw of a vehicle that moves ahead: none is sure."""
    time, north, east, *_ = turns(5)
    rng = np.random.default_rng(5)
    yaw = np.cumsum(np.repeat(rng.uniform(-0.05, 0.05, len(time) // 30), 30))
    columns = {"time": time, "x_north": north, "y_east": east, "yaw_rad": wrap(yaw)}
    found, _ = read_draft(tmp_path, columns)
    assert {guess.sign for guess in found.roles.guesses} == {1}


@pytest.mark.slow
@pytest.mark.parametrize("drift", [-90.0, 180.0], ids=["sideways", "astern"])
def test_a_nearly_constant_heading_is_kept_where_the_vehicle_does_not_move_ahead(tmp_path, drift):
    time = 0.2 * np.arange(1500)
    heading = np.radians(45.0 + 6.0 * np.sin(0.3 * time))
    speed, course = 0.4 + 0.2 * np.sin(0.21 * time), heading + np.radians(drift)
    north, east = np.cumsum(0.2 * speed * [np.cos(course), np.sin(course)], axis=1)
    columns = {"time": time, "north": north, "east": east, "heading_deg": np.degrees(heading)}
    found, _ = read_draft(tmp_path, columns)
    assert {guess.sign for guess in found.roles.guesses} == {1}
