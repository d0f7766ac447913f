"""Section V of the paper: equation 24 and the printed Table I."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.basis.term import AXES
from hydrodamp.simulation.replay import score


def trajectory(error, axes=AXES):
    """A replay that is so far from a log of a vehicle at rest."""
    log = hd.Log(np.arange(len(error)) / 10, np.zeros_like(error))
    return hd.Trajectory(log, error, diverged=(), attitude="measured", axes=axes)


def test_equation_24_by_hand():
    """J = sqrt(1/(6 n_k) sum of all squared entries), here with n_k = 2."""
    error = np.array([[1.0, 0, 0, 0, 0, 2.0], [0, 3.0, 0, 0, 0, 0]])
    found = score(trajectory(error), rate_unit="rad")
    assert found.rms == pytest.approx(np.sqrt((1 + 4 + 9) / 12))


def test_rates_count_in_degrees_by_default():
    turning = np.radians([[0.0, 0, 0, 0, 0, 6.0]] * 2)
    in_degrees, in_radians = (
        score(trajectory(turning)),
        score(trajectory(turning), rate_unit="rad"),
    )
    assert in_degrees.rms == pytest.approx(np.sqrt(36 / 6))
    assert in_radians.rms == pytest.approx(np.radians(6) / np.sqrt(6))
    assert in_degrees.rms_by_axis["r"] == pytest.approx(6.0)
    assert in_degrees.fit_by_axis["r"] is None  # the record does not vary


def test_equation_24_divides_by_the_free_axes():
    planar = score(trajectory(np.array([[0.0, 0.3, 0, 0, 0, 0]] * 4), ("X", "Y", "N")))
    assert planar.rms == pytest.approx(0.3 / np.sqrt(3))
    assert list(planar.rms_by_axis) == ["u", "v", "r"]


def test_fit_is_100_for_a_perfect_replay_and_0_for_the_mean():
    velocity = np.random.default_rng(3).normal(size=(50, 6))
    log = hd.Log.from_arrays(np.arange(50) / 10, velocity, wrench=np.zeros((50, 6)))
    mean = np.broadcast_to(velocity.mean(axis=0), velocity.shape)

    perfect = score(hd.Trajectory(log, velocity, (), "measured"))
    flat = score(hd.Trajectory(log, mean, (), "measured"))

    assert all(value == pytest.approx(100.0) for value in perfect.fit_by_axis.values())
    assert all(value == pytest.approx(0.0, abs=1e-9) for value in flat.fit_by_axis.values())


def test_printed_table_i():
    """The last three columns of Table I."""
    assert [(row.n_coefficients, row.ls, row.ai) for row in hd.PAPER_TABLE_I.values()] == [
        (216, 0.40, 0.54),
        (100, 1.74, 2.00),
        (88, 0.39, 0.55),
        (36, 0.50, 0.74),
        (33, 1.29, 2.29),
        (30, 1.79, 2.31),
        (24, 2.15, 1.98),
        (12, 2.24, 2.08),
    ]
