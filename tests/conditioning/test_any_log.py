"""Laws that hold of any log, however odd."""

import dataclasses
import warnings

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hydrodamp.conditioning.actuator_response import (
    apply_dead_zone,
    apply_delay,
    apply_first_order_lag,
)
from hydrodamp.conditioning.current import estimate_current
from hydrodamp.conditioning.derivatives import (
    acceleration_from_accelerometer,
    rates_from_attitude,
    velocity_from_position,
)
from hydrodamp.conditioning.pipeline import clean
from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError

KINDS = (
    lambda rng, n: rng.normal(size=n),
    lambda rng, n: np.zeros(n),
    lambda rng, n: np.full(n, 1.25),
    lambda rng, n: np.round(rng.normal(size=n), 1),
    lambda rng, n: np.cumsum(rng.normal(size=n)) / n,
    lambda rng, n: rng.choice([0.0, -32.768, 1e-300, 49.0, -49.0], size=n),
    lambda rng, n: np.repeat(rng.normal(size=n // 5 + 1), 5)[:n],
)


@st.composite
def logs(draw):
    """Few or many segments, some of two samples, any channels, any clock."""
    lengths = draw(st.lists(st.integers(2, 40), min_size=1, max_size=5))
    n = sum(lengths)
    rng = np.random.default_rng(draw(st.integers(0, 2**31)))
    channel = st.sampled_from(KINDS)
    names = draw(st.sets(st.sampled_from("uvwpqr"), min_size=0, max_size=6))
    step = draw(st.sampled_from([1e-3, 0.1, 30.0]))
    jitter = draw(st.sampled_from([0.0, 0.9]))
    time = np.cumsum(step * (1 + jitter * rng.uniform(-1, 1, n)))
    with_attitude = draw(st.booleans())
    euler = np.column_stack([draw(channel)(rng, n) for _ in range(3)])
    extra = {
        block: np.column_stack([draw(channel)(rng, n) for _ in range(3)])
        for block in ("position", "specific_force")
        if draw(st.booleans())
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        log = Log.from_arrays(
            time,
            {name: draw(channel)(rng, n) for name in sorted(names)},
            commands={"rudder": draw(channel)(rng, n), "climb": draw(channel)(rng, n)},
            segment=np.repeat(np.arange(len(lengths)), lengths).tolist(),
            **extra,
        )
    if not with_attitude:
        return log
    signs = rng.choice([-1.0, 1.0], size=(log.n, 1))
    rows = np.searchsorted(time, log.time)
    return dataclasses.replace(log, attitude=signs * quaternion_from_euler(euler[rows]))


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(logs())
def test_cleaning_keeps_a_log_a_log(log):
    try:
        made = clean(log)
    except LogError:
        return
    assert made.n <= log.n
    assert made.velocity_names == log.velocity_names
    rows = np.searchsorted(log.time, made.time)
    np.testing.assert_array_equal(log.time[rows], made.time)
    np.testing.assert_array_equal(log.commands[rows], made.commands)
    told = " ".join(made.notes)
    is_untouched = [name in log.velocity_names and f"`{name}`" not in told for name in "uvwpqr"]
    np.testing.assert_array_equal(
        log.velocity[rows][:, is_untouched], made.velocity[:, is_untouched]
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "step",
    [
        rates_from_attitude,
        velocity_from_position,
        acceleration_from_accelerometer,
        lambda log: apply_delay(log, {"rudder": 0.3, "climb": 40.0}),
        lambda log: apply_first_order_lag(log, {"rudder": 0.3, "climb": 40.0}),
        lambda log: apply_dead_zone(log, {"rudder": (-0.1, 0.2)}),
    ],
)
@settings(max_examples=15, deadline=None)
@given(log=logs())
def test_completing_returns_a_log_or_says_why_not(step, log):
    try:
        made = step(log)
    except LogError:
        return
    assert made.segments == log.segments
    np.testing.assert_array_equal(made.time, log.time)
    assert len(made.notes) >= len(log.notes)


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(logs(), st.sampled_from([0.0, 0.05, 10.0]), st.sampled_from([1e-2, 600.0, 1e9]))
def test_a_current_is_finite_or_refused(log, drift, spacing):
    try:
        found = estimate_current(log, spacing=spacing, drift=drift)
    except LogError:
        return
    assert np.isfinite(found.velocity).all()
    assert np.isfinite(found.standard_error).all()
