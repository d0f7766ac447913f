"""Values at the times of another topic."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis.strategies import floats, lists
from scipy.spatial.transform import Rotation, Slerp

from hydrodamp.ingest.clock import (
    Clock,
    Ticks,
    align_runs,
    bracket_ticks,
    clean_timestamps,
    interpolate,
    interpolate_attitude,
    make_even_ticks,
)
from table_rows import rows


def stamps(time, topic="dvl"):
    return clean_timestamps(Clock(topic, np.asarray(time, float)))


def ticks(time, run=None):
    time = np.asarray(time, float)
    return Ticks(time, np.zeros(len(time), np.int64) if run is None else np.array(run))


@pytest.mark.slow
@given(lists(floats(0.01, 0.9), min_size=2, max_size=40), lists(floats(-1, 40), min_size=1))
def test_between_messages_values_lie_on_a_line(steps, asked):
    """Against np.interp where there is something on both sides; else nothing."""
    time = np.cumsum([0.0, *steps])
    values = np.sin(7 * time)
    wanted = np.sort(asked)
    got = interpolate(values, bracket_ticks(stamps(time), ticks(wanted)))
    inside = (wanted >= 0) & (wanted <= time[-1])
    np.testing.assert_array_equal(np.isnan(got), ~inside)
    np.testing.assert_allclose(got[inside], np.interp(wanted, time, values)[inside], atol=1e-12)


def test_runs_know_nothing_of_one_another():
    two = stamps([90, 91, 92, 0, 1, 2])
    brackets = bracket_ticks(two, ticks([90.5, 92.0, 0.5, 3.0, 0.5], [0, 0, 1, 1, 2]))
    got = interpolate(np.array([0.0, 1, 2, 10, 11, 12]), brackets)
    np.testing.assert_allclose(got, [0.5, 2.0, 10.5, np.nan, np.nan])


def test_attitude_turns_as_scipy_turns_it():
    rng = np.random.default_rng(3)
    time = np.cumsum(rng.uniform(0.05, 0.5, 60))
    turns = Rotation.random(60, random_state=rng)
    wanted = rng.uniform(time[0], time[-1], 300)
    wanted.sort()
    # Any quaternion may come with the other sign.
    given = turns.as_quat(scalar_first=True) * rng.choice([-1.0, 1.0], 60)[:, np.newaxis]
    got = interpolate_attitude(given, bracket_ticks(stamps(time), ticks(wanted)))
    expected = Slerp(time, turns)(wanted)
    difference = (Rotation.from_quat(got, scalar_first=True) * expected.inv()).magnitude()
    np.testing.assert_allclose(difference, 0, atol=1e-7)
    np.testing.assert_allclose(np.linalg.norm(got, axis=1), 1, atol=1e-12)


@pytest.mark.parametrize("rate", [3.0, 7.0, 10.0, 50.0])
def test_even_ticks_reach_the_last_message(rate):
    time = np.arange(0, 100 * rate + 1) / rate
    assert make_even_ticks(stamps(time), rate).time.tolist() == pytest.approx(time.tolist())


@rows("base, other, run")
def test_runs_are_matched_in_order_or_where_they_overlap_most(base, other, run):
    assert align_runs(stamps(other), stamps(base)).run.tolist() == run
