import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hydrodamp.conditioning.outliers import (
    find_attitude_outliers,
    find_outliers,
    remove_attitude_outliers,
    remove_outliers,
)
from hydrodamp.data.attitude import quaternion_from_euler, rotation_vectors
from hydrodamp.data.log import Log, Segment
from hydrodamp.errors import LogError
from value_changes import set_values


def noisy(n=400, seed=0):
    return np.sin(np.arange(n) / 15) + 0.02 * np.random.default_rng(seed).normal(size=n)


def found_in(values):
    return find_outliers(still([0, len(values)]), values)


def still(edges):
    """A log of nothing but segments between some edges."""
    parts = tuple(Segment(str(a), a, b) for a, b in itertools.pairwise(edges))
    return Log(np.arange(1.0 * edges[-1]), np.zeros((edges[-1], 6)), segments=parts)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(
    st.sets(st.integers(0, 49), min_size=0, max_size=20),
    st.integers(0, 5),
    st.sampled_from([-1.0, 1.0]),
)
def test_exactly_the_spikes_put_in_are_found(places, seed, sign):
    values = noisy(seed=seed)
    rows = np.array(sorted(places), dtype=int) * 8  # no two in half a window
    values[rows] += sign * 1.0
    assert np.flatnonzero(found_in(values)).tolist() == rows.tolist()


@pytest.mark.parametrize("kind", ["step", "ramp", "corner", "stairs", "still", "pulse of four"])
def test_motion_is_no_spike(kind):
    index = np.arange(60.0)
    values = {
        "step": np.where(index < 30, 0.0, 1.0),
        "ramp": 0.3 * index,
        "corner": np.maximum(index - 30, 0.0),
        "stairs": np.floor(index / 4),
        "still": np.zeros(60),
        "pulse of four": np.where((index >= 30) & (index < 34), 1.0, 0.0),
    }[kind]
    assert not found_in(values).any()


def test_a_coarse_sensor_may_flicker():
    values = np.where(np.random.default_rng(1).random(500) < 0.1, 0.001, 0.0)
    values[100] = 0.5
    assert np.flatnonzero(found_in(values)).tolist() == [100]


def test_nothing_is_compared_across_a_join():
    low, high = noisy(), 30 + noisy(seed=1)
    both = np.concatenate((low, high))
    assert not find_outliers(still([0, 400, 800]), both).any()
    assert not find_outliers(still([0, 4, 10]), both[396:406]).any()


def test_a_step_counts_what_it_touched_and_tells_it(swim, counts):
    spikes = (([20, 21, 60], 0), lambda u: u + 4.0), ((0, 5), lambda r: r + 9.0)
    made = remove_outliers(set_values(swim, "velocity", *spikes))
    assert counts(made, "spikes") == {"u": 3, "r": 1}
    assert made.n == 99  # there is nothing before the first sample
    np.testing.assert_allclose(made.velocity, swim.velocity[1:], atol=2e-3)
    assert made.notes == (
        "spikes: 3 of 100 samples of `u` (3 %) interpolated",
        "spikes: 1 of 100 samples of `r` (1 %) cut out",
    )


def test_accelerations_are_looked_at_where_named(swim, counts):
    rng = np.random.default_rng(3)
    widths = {"acceleration": 6, "position": 3, "specific_force": 3}
    blocks = {name: rng.normal(size=(100, width)) / 50 for name, width in widths.items()}
    for block in blocks.values():
        block[40, 0] = 5.0
    log = dataclasses.replace(swim, **blocks)
    made = remove_outliers(log)
    assert counts(made, "spikes") == {"north": 1, "fx": 1}
    assert float(np.abs(made.position).max()) < 0.1
    assert counts(remove_outliers(log, names=["du", "fx"]), "spikes") == {"du": 1, "fx": 1}


@pytest.mark.parametrize("setting", [{"threshold": 0}, {"names": ["rudder"]}])
def test_settings_that_cannot_be(swim, setting, refused):
    refused(LogError, remove_outliers, swim, **setting)


def tumbling(n=200, rate=0.8):
    """Turning about every axis, through every wrap there is."""
    time = np.arange(n) / 10
    return quaternion_from_euler(
        np.column_stack((rate * time, 0.7 * np.sin(rate * time), 2 * rate * time))
    )


def turning(attitude):
    n = len(attitude)
    return Log(time=np.arange(n) / 10, velocity=np.ones((n, 6)), attitude=attitude)


def yawing(yaw):
    return quaternion_from_euler(np.outer(yaw, (0.0, 0.0, 1.0)))


def noise_of_attitude():
    attitude = quaternion_from_euler(1e-4 * np.random.default_rng(3).normal(size=(500, 3)))
    attitude[100] = quaternion_from_euler(np.full((1, 3), np.radians(0.5)))
    return attitude


ZIGZAG = np.radians(20.0) * np.sin(2.0 * np.pi / 16.0 * np.arange(120))  # of a compass at 1 Hz
AWAY_AND_BACK = np.radians(20.0) * np.repeat([0.0, 1.0, -1.0, 0.0], [300, 4, 4, 300])
NO_LEAPS = {f"tumbling at {rate} rad/s": tumbling(rate=rate) for rate in (0.0, 0.3, 1.0, 2.0)} | {
    "manoeuvre": yawing(np.cumsum(AWAY_AND_BACK)),
    "compass held at 20 Hz": yawing(np.repeat(ZIGZAG, 20)),
    "set anew": yawing(0.05 * np.arange(300) + 2.0 * (np.arange(300) >= 150)),
    "noise": noise_of_attitude(),
}


@pytest.mark.parametrize("kind", NO_LEAPS)
def test_motion_and_noise_of_an_attitude_are_no_leaps(kind):
    assert not find_attitude_outliers(turning(NO_LEAPS[kind])).any()


@settings(max_examples=25, deadline=None)
@given(st.sets(st.integers(1, 23), max_size=10), st.floats(0.8, 3.1), st.floats(0, 1.0))
def test_exactly_the_leaps_put_in_are_taken_out(counts, places, angle, rate):
    attitude = tumbling(rate=rate)
    rows = np.array(sorted(places), dtype=int) * 8
    half = angle / 2
    w, x, y, z = attitude[rows].T
    c, s = np.cos(half), np.sin(half)
    spoilt = attitude.copy()
    spoilt[rows] = np.column_stack((c * w - s * y, c * x - s * z, c * y + s * w, c * z + s * x))
    made = remove_attitude_outliers(turning(spoilt))
    assert counts(made, "attitude leaps").get("attitude", 0) == len(rows)
    off = np.linalg.norm(rotation_vectors(made.attitude, attitude), axis=1)
    assert off.max() < 0.02 + 0.05 * rate**2


@pytest.mark.parametrize("length", [1, 3, 8, 12])
def test_a_pose_that_is_lost_for_some_samples_is_found_whole(length):
    """Motion capture takes another marker set for a while; the vehicle turns on meanwhile."""
    yaw = 0.04 * np.arange(300) + 0.5 * np.sin(0.05 * np.arange(300))
    attitude = yawing(yaw)
    lost = slice(120, 120 + length)
    attitude[lost] = quaternion_from_euler(np.array([[0.3, -0.6, yaw[120] + 2.5]]))
    found = find_attitude_outliers(turning(attitude))
    assert found[lost].all()
    assert found.sum() == length


def test_averaged_wraps_are_found_whatever_the_signs(counts):
    attitude = tumbling() * np.random.default_rng(1).choice([-1.0, 1.0], size=(200, 1))
    attitude[[50, 120]] = quaternion_from_euler(np.zeros((2, 3)))
    made = remove_attitude_outliers(turning(attitude))
    assert counts(made, "attitude leaps") == {"attitude": 2}


def test_short_segments_and_no_attitude():
    attitude = tumbling(8)
    attitude[2] = -attitude[2][[1, 0, 3, 2]]
    halves = (Segment("a", 0, 4), Segment("b", 4, 8))
    assert not find_attitude_outliers(dataclasses.replace(turning(attitude), segments=halves)).any()
    log = Log(time=[0.0, 1.0], velocity=np.ones((2, 6)))
    assert remove_attitude_outliers(log) is log
