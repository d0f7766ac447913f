from __future__ import annotations

import dataclasses
from functools import partial

import numpy as np

from hydrodamp.conditioning.clean import CLEANING_STEPS, clean
from hydrodamp.conditioning.spikes import remove_spikes
from hydrodamp.data.concatenation import concatenate
from hydrodamp.data.log import Log


def spoilt(swim: Log) -> Log:
    velocity = swim.velocity.copy()
    velocity[10, :3] = -32.768
    velocity[30, 5] += 5.0
    velocity[60:73, 0] = velocity[60, 0]
    attitude = swim.attitude.copy()
    attitude[50] = [0, 1, 0, 0]
    return dataclasses.replace(swim, velocity=velocity, attitude=attitude)


def test_every_step_counts_its_own(swim: Log) -> None:
    made = clean(spoilt(swim))
    assert {one.step for one in made.touched} == {
        "no bottom lock",
        "frozen",
        "attitude leaps",
        "spikes",
    }
    assert made.counts("no bottom lock") == {"u": 1, "v": 1, "w": 1}
    assert made.counts("frozen") == {"u": 12}
    assert made.counts("attitude leaps") == {"attitude": 1}
    assert made.counts("spikes") == {"r": 1}
    assert made.count == 17
    assert made.log.notes == tuple(map(str, made.touched))
    rows = np.searchsorted(swim.time, made.log.time)
    np.testing.assert_allclose(made.log.velocity, swim.velocity[rows], atol=5e-3)


def test_a_clean_log_stays_as_it_is_and_clean(swim: Log) -> None:
    assert clean(swim).log is swim
    once = clean(spoilt(swim)).log
    twice = clean(once)
    assert twice.count == 0
    assert twice.log.notes == once.notes


def test_steps_are_chosen_and_set(swim: Log) -> None:
    log = spoilt(swim)
    assert clean(log, ()).log is log
    only = clean(log, [partial(remove_spikes, names=["r"])])
    assert [one.step for one in only.touched] == ["spikes"]
    assert len(CLEANING_STEPS) == 5


def test_what_was_done_is_told_on_one_screen_and_survives_cutting(swim: Log) -> None:
    made = clean(spoilt(swim))
    assert len(str(made).splitlines()) == len(made.touched)
    assert "what was done to it" in str(made.log)
    assert made.log.between(0, 3).notes == made.log.notes
    assert concatenate([made.log, made.log]).notes == made.log.notes
