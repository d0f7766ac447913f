import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hydrodamp.conditioning.dropouts import remove_samples
from hydrodamp.data.attitude import quaternion_from_euler, rotation_vectors
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError

CLOCK = np.cumsum(np.random.default_rng(5).uniform(0.05, 0.25, 60))


def straight(n=60):
    """Everything linear in time on an irregular clock: interpolation is exact."""
    time = CLOCK[:n]
    return Log.from_arrays(
        time,
        {"u": 1 + 0.2 * time, "r": np.full(n, 0.3)},
        attitude=quaternion_from_euler(np.outer(0.3 * time, (0, 0, 1))),
        commands={"rudder": np.arange(n)},
        segment=np.repeat(["a", "b"], [n // 2, n - n // 2]),
    )


def rows(places, n=60):
    """Return which of n samples are at some places."""
    return np.isin(np.arange(n), [*places])


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(st.sets(st.integers(1, 28), max_size=10))
def test_what_is_linear_comes_back(counts, places):
    log = straight()
    lost = rows(places)
    made = remove_samples(log, {"u": lost, "attitude": lost}, "gone", longest=10.0)
    assert sum(counts(made, "gone").values()) == 2 * len(places)
    np.testing.assert_allclose(made.velocity, log.velocity, atol=1e-12)
    np.testing.assert_allclose(np.abs(rotation_vectors(made.attitude, log.attitude)), 0, atol=1e-9)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(st.sets(st.integers(0, 59), max_size=59), st.floats(0.1, 3.0))
def test_every_lost_sample_is_bridged_or_cut(counts, places, longest):
    log = straight()
    lost = rows(places)
    try:
        made = remove_samples(log, {"u": lost}, "gone", longest)
    except LogError:
        return
    assert sum(counts(made, "gone").values()) == len(places)
    cut = [int(note.split()[1]) for note in made.notes if note.endswith("cut out")]
    assert made.n <= 60 - sum(cut)  # a sample left alone goes too
    steps = np.concatenate([np.diff(made.time[a:b]) for a, b in made.bounds])
    assert steps.max() <= np.diff(CLOCK).max()


def test_a_long_stretch_splits_and_the_pieces_go_by_the_old_name():
    made = remove_samples(straight(), {"u": rows(range(40, 52))}, "gone")
    assert [part.name for part in made.segments] == ["a", "b.1", "b.2"]
    assert made.select("b").n == 18
    twice = remove_samples(made, {"u": rows((33, 34), made.n)}, "gone", longest=0.0)
    assert [part.name for part in twice.segments] == ["a", "b.1.1", "b.1.2", "b.2"]
    assert twice.select("b.1").n == 8
    assert twice.select("b").n == 16


def test_no_bridge_across_a_join():
    made = remove_samples(straight(), {"r": rows((29, 30))}, "gone", longest=100.0)
    assert made.n == 58
    assert [part.name for part in made.segments] == ["a", "b"]


def test_nothing_left_is_a_fault(refused):
    refused(LogError, lambda: remove_samples(straight(), {"u": rows(range(60))}, "gone"))
