"""Proposal of training and test data by the excitation of both."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.data.intervals import select_data
from hydrodamp.validation.excitation import propose_split


def test_a_proposed_split_has_each_manoeuvre_on_both_sides():
    time = np.arange(0.0, 300.0, 0.1)
    roll = np.where((time < 100.0) | (time > 200.0), np.sin(time), 0.0)  # not in the middle
    log = hd.Log.from_arrays(time, {"u": 1.0 + 0.2 * np.sin(0.3 * time), "p": roll})
    sides = propose_split(log, ("X", "K"))
    for side in sides:
        assert max(np.abs(select_data(log, each).velocity[:, 3]).max() for each in side) > 0.9
    assert sum(select_data(log, each).n for each in sides[1]) == pytest.approx(log.n / 3, rel=0.02)


def test_a_proposed_split_tests_a_run_with_the_motion_of_the_others():
    time, logs = np.arange(0.0, 60.0, 0.1), []
    for name, size in (("a", 0.3), ("b", 0.3), ("c", 0.0)):
        motion = {"u": 1.0 + 0.2 * np.sin(time), "p": size * np.cos(time)}
        logs.append(hd.Log.from_arrays(time, motion, source=name))
    train, test = propose_split(hd.concatenate(logs), ("X", "K"))
    assert "c" not in test
    assert len(train) == 2
