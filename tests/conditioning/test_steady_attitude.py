from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hydrodamp.conditioning.spikes import leaps, steady_attitude
from hydrodamp.data.attitude import quaternion_from_euler, turn
from hydrodamp.data.log import Log, Segment

Counts = Callable[[Log, str], dict[str, int]]


def tumbling(n: int = 200, rate: float = 0.8) -> np.ndarray:
    """Turning about every axis, through every wrap there is."""
    time = np.arange(n) / 10
    return quaternion_from_euler(
        np.column_stack((rate * time, 0.7 * np.sin(rate * time), 2 * rate * time))
    )


def log_of(attitude: np.ndarray) -> Log:
    n = len(attitude)
    return Log(time=np.arange(n) / 10, velocity=np.ones((n, 6)), attitude=attitude)


@pytest.mark.parametrize("rate", [0.0, 0.3, 1.0, 2.0])
def test_a_tumbling_vehicle_does_not_leap(rate: float) -> None:
    attitude = tumbling(rate=rate)
    assert not leaps(log_of(attitude)).any()


@settings(max_examples=25, deadline=None)
@given(st.sets(st.integers(1, 23), max_size=10), st.floats(0.8, 3.1), st.floats(0, 1.0))
def test_exactly_the_leaps_put_in_are_taken_out(
    counts: Counts, places: set[int], angle: float, rate: float
) -> None:
    attitude = tumbling(rate=rate)
    rows = np.array(sorted(places), dtype=int) * 8
    half = angle / 2
    w, x, y, z = attitude[rows].T
    c, s = np.cos(half), np.sin(half)
    spoilt = attitude.copy()
    spoilt[rows] = np.column_stack((c * w - s * y, c * x - s * z, c * y + s * w, c * z + s * x))
    made = steady_attitude(log_of(spoilt))
    assert counts(made, "attitude leaps").get("attitude", 0) == len(rows)
    off = np.linalg.norm(turn(made.attitude, attitude), axis=1)
    assert off.max() < 0.02 + 0.05 * rate**2


def test_averaged_wraps_are_found_whatever_the_signs(counts: Counts) -> None:
    rng = np.random.default_rng(1)
    attitude = tumbling() * rng.choice([-1.0, 1.0], size=(200, 1))
    attitude[[50, 120]] = quaternion_from_euler(np.zeros((2, 3)))
    made = steady_attitude(log_of(attitude))
    assert counts(made, "attitude leaps") == {"attitude": 2}
    assert made.attitude is not None
    assert (np.sum(made.attitude[1:] * made.attitude[:-1], axis=1) > 0).all()


def test_small_noise_is_left_alone() -> None:
    rng = np.random.default_rng(3)
    attitude = quaternion_from_euler(1e-4 * rng.normal(size=(500, 3)))
    attitude[100] = quaternion_from_euler(np.full((1, 3), np.radians(0.5)))
    assert not leaps(log_of(attitude)).any()


def test_short_segments_and_no_attitude(counts: Counts) -> None:
    attitude = tumbling(8)
    attitude[2] = -attitude[2][[1, 0, 3, 2]]
    halves = (Segment("a", 0, 4), Segment("b", 4, 8))
    assert not leaps(dataclasses.replace(log_of(attitude), segments=halves)).any()
    log = Log(time=[0.0, 1.0], velocity=np.ones((2, 6)))
    assert steady_attitude(log) is log
    still = dataclasses.replace(log, attitude=[[1, 0, 0, 0], [-1, 0, 0, 0]])
    assert counts(steady_attitude(still), "quaternion signs") == {"attitude": 1}
