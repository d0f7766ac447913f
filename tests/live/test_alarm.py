"""The alarm: quiet while nothing changes, rung by another drag, and resumed to the bit."""

import itertools
import math

import numpy as np
import pytest

import hydrodamp as hd
from live.conftest import heard

MASS, DRAG, CHANGED = 60.0, 3.0, 900

VEHICLE = hd.Vehicle("sled", np.diag([MASS] + [1.0] * 5), 0.0, 0.0, axes=("X",))


def push(time):
    return 25.0 + 20.0 * math.sin(time / 9.0) + 10.0 * math.sin(time / 31.0)


def sled(n, more=0.0, seed=0):
    """Yield a second each of a sled that is pushed to and fro; its drag grows at ``CHANGED``."""
    rng, u = np.random.default_rng(seed), 0.0
    for k in range(n):
        drag = DRAG * (1.0 + more * (k >= CHANGED))
        yield {"time": float(k), "u": u + 0.01 * rng.standard_normal(), "X": push(k)}
        for part in range(20):
            u += 0.05 * (push(k + part / 20.0) - drag * u * abs(u)) / MASS


@pytest.mark.parametrize("seed", range(4))
def test_it_is_quiet_where_nothing_changes(seed):
    told = heard(sled(1500, seed=seed), VEHICLE)
    assert told.lines[-1]["alarm"] == {"armed": True, "changes": 0, "last": None}
    assert [line["alarm"]["armed"] for line in told.lines[300:500]].index(True) > 90
    assert not told.sentences


def test_it_names_the_axis_and_the_time_of_a_change():
    told = heard(sled(1500, more=0.2), VEHICLE)
    alarm = told.lines[-1]["alarm"]
    assert alarm["changes"] == 1
    assert alarm["last"]["axes"] == ["X"]
    assert CHANGED <= alarm["last"]["since"] < alarm["last"]["time"] < CHANGED + 60
    assert ["told by X at" in sentence for sentence in told.sentences] == [True]


def test_it_is_learnt_anew_after_a_change():
    lines = heard(sled(1500, more=0.2), VEHICLE).lines
    armed = [line["alarm"]["armed"] for line in lines if line["time"] > CHANGED + 60]
    assert not any(armed[:300])
    assert armed[-1]


@pytest.mark.parametrize("stop", [250, 350, CHANGED + 4, CHANGED + 80])
def test_an_interrupted_watch_goes_on_bit_for_bit(tmp_path, stop):
    path, rows = tmp_path / "state.json", [*sled(1100, more=0.2)]
    whole = heard(rows, VEHICLE)
    first = heard(itertools.islice(rows, stop), VEHICLE, path=path)
    rest = heard(rows[stop:], VEHICLE, path=path)
    assert rest.lines[-1] == whole.lines[-1]
    assert rest.run.state.alarm.axes[0].climb == whole.run.state.alarm.axes[0].climb
    assert first.sentences + rest.sentences == whole.sentences
