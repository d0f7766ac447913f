from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from hydrodamp.conditioning.dropouts import SENTINELS, mask_bottom_lock
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError

Counts = Callable[[Log, str], dict[str, int]]


@pytest.mark.parametrize("value", [*SENTINELS, -40.0])
def test_numbers_that_stand_for_none_go(swim: Log, value: float, counts: Counts) -> None:
    velocity = swim.velocity.copy()
    velocity[[30, 31], 1] = value
    made = mask_bottom_lock(dataclasses.replace(swim, velocity=velocity))
    assert counts(made, "no bottom lock") == {"u": 2, "v": 2, "w": 2}
    np.testing.assert_allclose(made.velocity, swim.velocity, atol=2e-3)


def test_rates_have_no_bottom_lock() -> None:
    log = Log.from_arrays([0, 1, 2], {"r": [1, 32.768, 1]})
    assert mask_bottom_lock(log) is log


def test_zeros_between_samples_under_way(swim: Log, counts: Counts) -> None:
    velocity = swim.velocity.copy()
    velocity[40:60, :3] = 0.0
    made = mask_bottom_lock(dataclasses.replace(swim, velocity=velocity))
    assert counts(made, "no bottom lock") == {"u": 20, "v": 20, "w": 20}
    assert [part.name for part in made.segments] == ["swim.1", "swim.2"]


def test_a_vehicle_that_stops_stands(swim: Log) -> None:
    velocity = swim.velocity.copy()
    velocity[:, 0] *= np.clip(np.abs(np.arange(100) - 50) / 10 - 1, 0, 1)
    stopped = dataclasses.replace(swim, velocity=velocity)
    assert (stopped.velocity[:, 0] == 0).sum() > 10
    assert mask_bottom_lock(stopped).notes == ()
    velocity = swim.velocity.copy()
    velocity[:10, :3] = 0.0
    velocity[90:, :3] = 0.0
    assert mask_bottom_lock(dataclasses.replace(swim, velocity=velocity)).notes == ()


def test_another_unit_is_no_lost_lock() -> None:
    log = Log.from_arrays(np.arange(50), {"u": np.linspace(35, 49, 50)})
    assert mask_bottom_lock(log).notes == ()


def test_a_surge_alone_may_be_zero() -> None:
    log = Log.from_arrays([0, 1, 2], {"u": [1, 0, 1]})
    assert mask_bottom_lock(log).notes == ()


def test_a_flag_speaks_for_the_instrument(counts: Counts) -> None:
    good = np.ones(50)
    good[20:24] = 0
    log = Log.from_arrays(np.arange(50) / 10, {"u": np.arange(50) / 10}, commands={"good": good})
    assert mask_bottom_lock(log).notes == ()
    made = mask_bottom_lock(log, flag="good")
    assert counts(made, "no bottom lock") == {"u": 4}
    np.testing.assert_allclose(made.velocity, log.velocity, atol=1e-12)
    with pytest.raises(LogError, match=r"no command 'god'\. Did you mean 'good'"):
        mask_bottom_lock(log, flag="god")
