"""Replays with restarts: windows, what they predict, and how they diverge."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.simulation.replay import horizon_scores, replay, score, window_bounds

LINEAR = hd.catalog["linear"]
SOFT = hd.Damping(LINEAR, (-20 * np.eye(6) + 0.1).ravel())


@pytest.fixture
def log(exact_log):
    return exact_log(hd.Damping(LINEAR, (-30 * np.eye(6) + 0.1).ravel()), n=300)


@pytest.fixture
def problem(vehicle, log):
    return hd.prepare(vehicle, log, LINEAR)


def test_windows_share_their_ends_and_cross_no_join(problem):
    """Segments of 100 samples at 10 Hz: 4 s are 40 steps, and 19 are left over."""
    first = [(0, 41), (40, 81), (80, 100)]
    expected = [(start + 100 * k, stop + 100 * k) for k in range(3) for start, stop in first]
    np.testing.assert_array_equal(window_bounds(problem, 4.0), expected)
    steps = [(k + 100 * s, k + 2 + 100 * s) for s in range(3) for k in range(99)]
    np.testing.assert_array_equal(window_bounds(problem, "step"), steps)
    np.testing.assert_array_equal(window_bounds(problem, "run"), problem.segments)


def test_a_horizon_is_at_least_a_step_and_at_most_the_segment(problem):
    np.testing.assert_array_equal(window_bounds(problem, 1000.0), problem.segments)
    # The last sample begins no window: 9.9 s after the first there is nothing to predict.
    assert window_bounds(problem, 9.9).tolist() == problem.segments.tolist()
    np.testing.assert_array_equal(window_bounds(problem, 0.01), window_bounds(problem, "step"))


def test_windows_follow_an_irregular_clock(vehicle):
    """A window begins at the first sample at or after each full second of its segment."""
    time = np.array([5.0, 5.4, 6.1, 6.9, 7.0, 7.2, 8.5, 9.4])
    log = hd.Log(time=time, velocity=np.zeros((8, 6)), wrench=np.zeros((8, 6)))
    log = replace(log, attitude=np.tile([1.0, 0, 0, 0], (8, 1)))
    found = window_bounds(hd.prepare(vehicle, log, LINEAR), 1.0)
    assert found[:, 0].tolist() == [0, 2, 4, 6]


def test_the_whole_run_is_the_replay(vehicle, log, problem):
    (found,) = horizon_scores(vehicle, SOFT, log, ["run"])
    assert found.score == score(replay(problem, SOFT))
    assert (found.n_windows, found.n_diverged, found.diverged_share) == (3, 0, 0.0)


@pytest.mark.parametrize("attitude", ["measured", "simulated"])
def test_each_window_is_a_replay_of_its_own(vehicle, log, problem, attitude):
    """The same as cutting the log by hand and replaying every piece."""
    (found,) = horizon_scores(vehicle, SOFT, log, [3.0], attitude=attitude)
    squares = np.zeros(6)
    for start, stop in window_bounds(problem, 3.0).tolist():
        piece = log.between(log.elapsed[start], log.elapsed[stop - 1] + 0.05)
        assert piece.n == stop - start
        made = hd.prepare(vehicle, piece, LINEAR)
        # gravity follows a curve through the samples before and after, too
        made = replace(made, inputs=problem.inputs.select(np.s_[start:stop]))
        error = replay(made, SOFT, attitude).velocity - piece.velocity
        squares += np.square(error).sum(axis=0)
    expected = np.sqrt(squares / log.n) * np.where(np.arange(6) < 3, 1.0, np.degrees(1.0))
    np.testing.assert_allclose(list(found.score.rms_by_axis.values()), expected, rtol=1e-9)


def test_windows_that_diverge_are_counted(vehicle):
    """From u = 1 m/s to the limit of 50 by exp(300/m t), m = 60 kg: log(50) m/300 = 0.78 s."""
    n = 100
    velocity = np.zeros((n, 6))
    velocity[:50, 0] = 1.0
    log = hd.Log.from_arrays(
        np.arange(n) / 10, velocity, attitude=np.zeros((n, 3)), wrench=np.zeros((n, 6)),
        segment=np.repeat(["moving", "still"], 50),
    )  # fmt: skip
    masses = np.diag([60.0, 99.0, 99.0, 1.0, 29.0, 29.0])
    level = replace(vehicle, center_of_gravity=(0.0, 0.0, 0.0), mass_matrix=masses)
    growing = hd.Damping(LINEAR, np.diag([300.0, 0, 0, 0, 0, 0]).ravel())
    found = horizon_scores(level, growing, log, ["step", 2.0, "run"])
    assert [entry.n_diverged for entry in found] == [0, 3, 1]
    assert [entry.diverged_share for entry in found] == [0.0, 3 / 6, 1 / 2]
    middle = found[1].score
    assert middle.rms is None
    assert middle.status is hd.Status.DIVERGED
    assert [name for name, _ in middle.diverged] == ["moving"] * 3
    assert [time for _, time in middle.diverged] == pytest.approx([0.8, 2.8, 4.8])
    assert found[0].score.rms is not None


@pytest.mark.parametrize("horizon", [0.0, -1.0, np.nan, np.inf, "day"])
def test_a_horizon_that_is_none_is_refused(vehicle, log, horizon, refused):
    refused(MethodError, horizon_scores, vehicle, SOFT, log, [horizon])
