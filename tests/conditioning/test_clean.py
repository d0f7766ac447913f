from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from hydrodamp.conditioning.steps import clean
from hydrodamp.data.log import Log

Counts = Callable[[Log, str], dict[str, int]]


def spoilt(swim: Log) -> Log:
    velocity = swim.velocity.copy()
    velocity[10, :3] = -32.768
    velocity[30, 5] += 5.0
    velocity[60:73, 0] = velocity[60, 0]
    attitude = swim.attitude.copy()
    attitude[50] = [0, 1, 0, 0]
    return dataclasses.replace(swim, velocity=velocity, attitude=attitude)


def test_every_step_counts_its_own(swim: Log, counts: Counts) -> None:
    made = clean(spoilt(swim))
    assert counts(made, "no bottom lock") == {"u": 1, "v": 1, "w": 1}
    assert counts(made, "frozen") == {"u": 12}
    assert counts(made, "attitude leaps") == {"attitude": 1}
    assert counts(made, "spikes") == {"r": 1}
    assert len(made.notes) == 6
    rows = np.searchsorted(swim.time, made.time)
    np.testing.assert_allclose(made.velocity, swim.velocity[rows], atol=5e-3)


def test_a_clean_log_stays_as_it_is_and_clean(swim: Log) -> None:
    assert clean(swim) is swim
    once = clean(spoilt(swim))
    twice = clean(once)
    assert twice.notes == once.notes
