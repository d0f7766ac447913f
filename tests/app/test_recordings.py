"""Recordings on one time, run after run."""

import numpy as np
import pytest

from hydrodamp.app.recordings import Files
from hydrodamp.data.recording import Recording, Topic


def table(time, values, name="run"):
    return Recording((Topic("", None, {"time": time, "u": values}),), name, "text in columns")


def test_runs_follow_each_other_and_their_starts_are_known():
    time = np.arange(0.0, 10.0, 0.1)
    files = Files((table(time + 100.0, 0 * time), table(time + 5000.0, 0 * time + 1.0)))
    assert files.starts == pytest.approx([0.0, 9.9])
    series = files.series["u"]
    assert np.all(np.diff(series.time) >= 0.0)
    assert files.extent == pytest.approx((0.0, 19.8))
    _, second = series.between(12.0, 15.0, 100)
    assert set(second.tolist()) == {1.0}


def test_a_clock_with_gaps_and_steps_back_is_plotted():
    time = np.arange(0.0, 100.0, 0.1)
    time[:3], time[500], time[600:605] = np.nan, np.nan, 20.0
    files = Files((table(time, np.sin(time)),))
    series = files.series["u"]
    assert np.isfinite(series.time).all()
    assert np.all(np.diff(series.time) >= 0.0)
    assert files.extent[1] <= 100.0


def test_a_recording_without_times_has_an_extent():
    files = Files((Recording((Topic("a", None, {"x": np.ones(1)}),), "a", "text"),))
    assert len(files.series["a.x"].time) == 1
    assert files.extent[0] <= files.extent[1]
