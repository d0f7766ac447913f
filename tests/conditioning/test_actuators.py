import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hydrodamp.conditioning.actuator_response import (
    apply_dead_zone,
    apply_delay,
    apply_first_order_lag,
)
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError


def log_of(values, time=None):
    clock = np.arange(len(values)) / 10 if time is None else time
    return Log.from_arrays(clock, {"u": np.ones(len(values))}, commands={"rudder": values})


def clock(seed, n=200):
    return np.cumsum(np.random.default_rng(seed).uniform(0.02, 0.3, n))


def wave(seed, n=200):
    return np.repeat(np.random.default_rng(seed).normal(size=-(-n // 7)), 7)[:n]


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(st.integers(0, 20))
def test_a_whole_number_of_steps_is_a_shift(steps):
    values = wave(1)
    made = apply_delay(log_of(values), {"rudder": steps / 10}).command("rudder")
    shifted = np.concatenate((np.full(steps, values[0]), values[: 200 - steps]))
    np.testing.assert_allclose(made, shifted, atol=1e-9)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 5), st.floats(0.01, 3.0))
def test_a_delay_keeps_the_impulse(seed, seconds):
    time, values = clock(seed), wave(seed)
    values[0] = values[-40:] = 0.0  # nothing is under way before and at the end
    made = apply_delay(log_of(values, time), {"rudder": seconds}).command("rudder")
    steps = np.append(np.diff(time), np.median(np.diff(time)))
    if time[-1] - time[-40] > seconds:
        assert made @ steps == pytest.approx(values @ steps, abs=1e-9)


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(st.integers(0, 5), st.floats(0.02, 5.0))
def test_a_lag_solves_its_equation(seed, seconds):
    """Oracle: the superposed responses to every jump of the command, averaged over each step."""
    time, values = clock(seed), wave(seed)
    ends = np.append(time[1:], time[-1] + np.median(np.diff(time)))
    since, until = (np.maximum(one[:, np.newaxis] - time, 0.0) for one in (time, ends))
    decay = (np.exp(-since / seconds) - np.exp(-until / seconds)) * seconds
    answers = np.tril(1.0 - decay / (ends - time)[:, np.newaxis])
    mean = values[0] + answers @ np.diff(values, prepend=values[0])
    made = apply_first_order_lag(log_of(values, time), {"rudder": seconds}).command("rudder")
    np.testing.assert_allclose(made, mean, atol=1e-9)


def test_what_was_done_is_told_and_zero_does_nothing():
    log = log_of(wave(5))
    made = apply_first_order_lag(apply_delay(log, {"rudder": 0.2}), {"rudder": 0.4})
    assert made.notes == ("command `rudder` delayed by 0.2 s", "command `rudder` lagged by 0.4 s")
    same = apply_delay(log, {"rudder": 0.0})
    assert same.notes == ()
    np.testing.assert_array_equal(same.commands, log.commands)


def test_what_cannot_be_is_named(refused):
    log = log_of(wave(6))
    refused(LogError, apply_delay, log, {"ruder": 0.1})
    for seconds in (-1.0, np.nan, np.inf):
        refused(LogError, apply_first_order_lag, log, {"rudder": seconds})
    refused(LogError, apply_dead_zone, log, {"rudder": (1.0, 0.0)})


@settings(max_examples=30, deadline=None)
@given(st.floats(-1, 0), st.floats(0, 1), st.integers(0, 5))
def test_beyond_a_dead_zone(low, high, seed):
    values = wave(seed)
    made = apply_dead_zone(log_of(values), {"rudder": (low, high)}).command("rudder")
    inside = (values >= low) & (values <= high)
    assert (made[inside] == 0).all()
    order = np.argsort(values)
    assert (np.diff(made[order]) >= 0).all()
    np.testing.assert_allclose(made[values > high] + high, values[values > high])
    np.testing.assert_allclose(made[values < low] + low, values[values < low])
