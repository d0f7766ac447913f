"""Whatever the clocks and numbers of a recording: a sound log, or a fault in words."""

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.strategies import integers, sampled_from

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import HydrodampWarning, LogError
from hydrodamp.ingest.mapping import LogMapping

NUMBERS = np.array([np.nan, np.inf, -np.inf])
STEPS = np.array([0.0, -0.1, 1.5, -50.0, 1e9, -1e9, np.nan])
MAPPING = {
    "time": "recorded",
    "attitude": {"heading": "b.x"},
    "velocity": {"north": "a.x", "east": "a.y", "r": "b.y"},
    "commands": {"fin": "c.x", "flag": {"column": "c.y", "hold": True}},
    "position": {"depth": {"column": "d.x", "optional": True}},
}


def topic(name, rng):
    """Steps of 0.1 s and small numbers, here and there something else."""
    n = int(rng.choice([0, 1, 2, *[60] * 20]))
    odd = 0.05 * rng.random()
    steps = np.where(rng.random(n) < odd, rng.choice(STEPS, n), 0.1)
    time = np.where(np.isnan(steps), np.nan, 100 + np.nancumsum(steps))
    fields = {
        axis: np.where(rng.random(n) < odd, rng.choice(NUMBERS, n), rng.uniform(-3, 3, n))
        for axis in "xy"
    }
    return Topic(name, time, fields)


@pytest.mark.slow
@settings(deadline=None, max_examples=120)
@given(integers(0, 10**9), sampled_from([None, "a", {"rate": 3.0}]))
def test_a_recording_makes_a_sound_log_or_a_fault(seed, clock):
    rng = np.random.default_rng(seed)
    a, b, c, d = (topic(name, rng) for name in "abcd")
    mapping = LogMapping.from_dict({**MAPPING, **({} if clock is None else {"clock": clock})})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", HydrodampWarning)
        try:
            log = mapping.log(Recording((a, b, c, d), "dive.bag", "a test"))
        except LogError:
            return
    for segment in log.segments:
        assert (np.diff(log.time[segment.start : segment.stop]) > 0).all()
    assert np.isfinite(log.velocity).all()
    assert np.isfinite(log.commands).all()
    assert set(log.command("flag").tolist()) <= set(c.fields["y"].tolist())
    known = np.concatenate((a.fields["x"], a.fields["y"]))
    fastest = np.hypot(*2 * [np.abs(known[np.isfinite(known)]).max(initial=0.0)])
    assert np.hypot(log.velocity[:, 0], log.velocity[:, 1]).max() <= fastest + 1e-9
