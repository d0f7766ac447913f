import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hydrodamp.conditioning.dropouts import DVL_SENTINELS, mask_dvl_dropouts, mask_frozen
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError
from value_changes import set_values

TIME = np.arange(0.0, 60.0, 0.1)


def moving(seed=0):
    rng = np.random.default_rng(seed)
    velocity = np.sin(np.outer(TIME, rng.uniform(0.2, 1, 6))) + 0.01 * rng.normal(size=(600, 6))
    return Log(time=TIME, velocity=velocity, segments=())


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(st.integers(20, 300), st.integers(12, 200), st.integers(0, 5))
def test_all_but_the_first_sample_of_a_frozen_run_go(counts, start, length, axis):
    log = moving()
    stretch = np.s_[start : start + length, axis]
    made = mask_frozen(set_values(log, "velocity", (stretch, lambda values: values[0])))
    assert counts(made, "frozen") == {"uvwpqr"[axis]: length - 1}
    assert made.n == (600 if length <= 10 else 600 - length + 1)


def test_a_slow_sensor_is_not_frozen():
    log = moving()
    held = np.s_[:, :3], log.velocity[np.arange(600) // 15 * 15, :3]
    assert mask_frozen(set_values(log, "velocity", held)).notes == ()


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (np.s_[:, 2], 0.0),  # never measured: left to suspicion
        (np.s_[:, 2], 0.7),
        (np.s_[100:300], 0.3),
        (np.s_[100:300, 0], 0.0),
    ],
)
def test_rest_and_what_never_moves_are_not_frozen(place, value):
    assert mask_frozen(set_values(moving(), "velocity", (place, value))).notes == ()


def test_attitude_tells_that_the_vehicle_moves(counts):
    surge = np.sin(TIME)
    surge[200:300] = surge[200]
    yaw = np.outer(0.1 * np.sin(TIME), (0, 0, 1))
    alone = Log.from_arrays(TIME, {"u": surge})
    assert mask_frozen(alone).notes == ()
    beside = mask_frozen(Log.from_arrays(TIME, {"u": surge}, attitude=yaw))
    assert counts(beside, "frozen") == {"u": 99}


@pytest.mark.parametrize(
    ("place", "value"),
    [*((np.s_[30:32, 1], value) for value in (*DVL_SENTINELS, -40.0)), (np.s_[30:50, :3], 0.0)],
)
def test_numbers_that_stand_for_none_go(swim, place, value, counts):
    made = mask_dvl_dropouts(set_values(swim, "velocity", (place, value)))
    lost = len(swim.velocity[place])
    assert counts(made, "no measurement") == dict.fromkeys("uvw", lost)
    kept = np.searchsorted(swim.time, made.time)
    assert len(kept) == (100 if lost == 2 else 80)  # a short gap is bridged, a long one is cut
    np.testing.assert_allclose(made.velocity, swim.velocity[kept], atol=2e-3)


@pytest.mark.parametrize(
    "velocity",
    [{"r": [1, 32.768, 1]}, {"u": [35, 40, 49]}, {"u": [1, 0, 1]}],
    ids=["rates", "another unit", "a surge alone"],
)
def test_what_lost_no_lock_is_left_alone(velocity):
    assert mask_dvl_dropouts(Log.from_arrays([0, 1, 2], velocity)).notes == ()


def test_a_flag_speaks_for_the_instrument(counts, refused):
    good = np.ones(50)
    good[20:24] = 0
    log = Log.from_arrays(np.arange(50) / 10, {"u": np.arange(50) / 10}, commands={"good": good})
    assert mask_dvl_dropouts(log).notes == ()
    made = mask_dvl_dropouts(log, flag="good")
    assert counts(made, "no measurement") == {"u": 4}
    np.testing.assert_allclose(made.velocity, log.velocity, atol=1e-12)
    refused(LogError, mask_dvl_dropouts, log, flag="god")
