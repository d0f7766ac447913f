from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hydrodamp.conditioning.dropouts import mask_frozen
from hydrodamp.data.log import Log

Counts = Callable[[Log, str], dict[str, int]]

TIME = np.arange(0.0, 60.0, 0.1)


def moving(seed: int = 0) -> Log:
    rng = np.random.default_rng(seed)
    velocity = np.sin(np.outer(TIME, rng.uniform(0.2, 1, 6))) + 0.01 * rng.normal(size=(600, 6))
    return Log(time=TIME, velocity=velocity, segments=())


@settings(max_examples=40, deadline=None)
@given(st.integers(20, 300), st.integers(12, 200), st.integers(0, 5))
def test_all_but_the_first_sample_of_a_frozen_run_go(
    counts: Counts, start: int, length: int, axis: int
) -> None:
    log = moving()
    velocity = log.velocity.copy()
    velocity[start : start + length, axis] = velocity[start, axis]
    made = mask_frozen(dataclasses.replace(log, velocity=velocity))
    assert counts(made, "frozen") == {"uvwpqr"[axis]: length - 1}
    assert made.n == (600 if length <= 10 else 600 - length + 1)


def test_a_short_stop_is_interpolated(counts: Counts) -> None:
    log = moving()
    velocity = log.velocity.copy()
    velocity[100:106, 0] = velocity[100, 0]
    made = mask_frozen(dataclasses.replace(log, velocity=velocity), seconds=0.3)
    assert counts(made, "frozen") == {"u": 5}
    assert made.n == 600
    np.testing.assert_allclose(made.velocity[:, 0], log.velocity[:, 0], atol=0.1)


def test_a_slow_sensor_is_not_frozen() -> None:
    log = moving()
    held = log.velocity[np.arange(600) // 15 * 15]
    slow = dataclasses.replace(log, velocity=np.column_stack((held[:, :3], log.velocity[:, 3:])))
    assert mask_frozen(slow).notes == ()


@pytest.mark.parametrize("value", [0.0, 0.7])
def test_a_velocity_that_never_moves_is_left_to_suspicion(value: float) -> None:
    velocity = moving().velocity.copy()
    velocity[:, 2] = value
    assert mask_frozen(Log(time=TIME, velocity=velocity)).notes == ()


def test_a_vehicle_at_rest_is_not_frozen() -> None:
    velocity = moving().velocity.copy()
    velocity[100:300] = 0.3
    assert mask_frozen(Log(time=TIME, velocity=velocity)).notes == ()
    velocity = moving().velocity.copy()
    velocity[100:300, 0] = 0.0
    assert mask_frozen(Log(time=TIME, velocity=velocity)).notes == ()


def test_attitude_tells_that_the_vehicle_moves(counts: Counts) -> None:
    surge = np.sin(TIME)
    surge[200:300] = surge[200]
    yaw = np.outer(0.1 * np.sin(TIME), (0, 0, 1))
    alone = Log.from_arrays(TIME, {"u": surge})
    assert mask_frozen(alone).notes == ()
    beside = mask_frozen(Log.from_arrays(TIME, {"u": surge}, attitude=yaw))
    assert counts(beside, "frozen") == {"u": 99}


def test_runs_end_at_joins(counts: Counts) -> None:
    log = moving()
    velocity = log.velocity.copy()
    velocity[295:305, 0] = velocity[295, 0]
    segments = Log.from_arrays(TIME, velocity, segment=["a"] * 300 + ["b"] * 300)
    assert mask_frozen(segments, seconds=0.6).notes == ()
    whole = mask_frozen(Log(time=TIME, velocity=velocity), seconds=0.6)
    assert sum(counts(whole, "frozen").values()) == 9
