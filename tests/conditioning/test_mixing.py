from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hydrodamp.conditioning.mixing import roll_from_mixing
from hydrodamp.data.attitude import euler_from_quaternion
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError

TIME = np.arange(0.0, 60.0, 0.1)
ROLL = 0.3 * np.sin(0.5 * TIME)
DEMANDED, FINS = ("climb", "turn"), ("elevator", "rudder")


def mixed(stop: float = 10.0, size: float = 0.15) -> Log:
    """An autopilot that knows its roll, fins that stop at an angle, a log of four digits."""
    wanted = size * (1.0 + 0.3j * np.sin(0.2 * TIME) + 0.4 * np.cos(0.13 * TIME))
    fins = wanted * np.exp(1j * ROLL)
    fins = np.clip(fins.real, -stop, stop) + 1j * np.clip(fins.imag, -stop, stop)
    parts = (wanted.real, wanted.imag, fins.real, fins.imag)
    return Log.from_arrays(
        TIME,
        {"u": np.ones(600)},
        attitude=np.column_stack((0 * TIME, 0.1 * np.cos(TIME), 0.05 * TIME)),
        commands=dict(zip((*DEMANDED, *FINS), np.round(parts, 4), strict=True)),
    )


def angles(log: Log) -> np.ndarray:
    return euler_from_quaternion(log.attitude)


def test_the_roll_that_was_mixed_in_comes_back() -> None:
    log = mixed()
    made = roll_from_mixing(log, DEMANDED, FINS, seconds=0.3)
    np.testing.assert_allclose(angles(made)[3:-3, 0], ROLL[3:-3], atol=2e-3)
    np.testing.assert_allclose(angles(made)[:, 1:], angles(log)[:, 1:], atol=1e-9)
    assert made.notes == (
        "derived: roll from the mixing of `elevator rudder`; interpolated in 0 of 600 samples",
    )


def test_the_mixing_of_the_690_is_known_by_its_name() -> None:
    log = mixed()
    e, r = (log.command(name) for name in DEMANDED)
    fins = (e * np.cos(ROLL) - r * np.sin(ROLL), e * np.sin(ROLL) - r * np.cos(ROLL))
    own = dataclasses.replace(log, commands=np.column_stack((e, r, *fins)))
    made = roll_from_mixing(own, DEMANDED, FINS, "avl690", seconds=0.1)
    np.testing.assert_allclose(angles(made)[3:-3, 0], ROLL[3:-3], atol=1e-6)
    with pytest.raises(LogError, match="Did you mean 'avl690'"):
        roll_from_mixing(own, DEMANDED, FINS, "avl960")


def test_fins_at_their_stops_are_bridged() -> None:
    made = roll_from_mixing(mixed(stop=0.2), DEMANDED, FINS)
    assert "interpolated in 0 of" not in made.notes[0]
    assert np.mean(np.abs(angles(made)[:, 0] - ROLL) < 0.08) > 0.9


def test_a_wrong_sign_is_refused() -> None:
    log = mixed()
    busy = log.commands.copy()
    wanted = 0.2 * np.exp(0.5j * np.random.default_rng(1).normal(size=600))
    fins = wanted * np.exp(1j * ROLL)
    busy[:] = np.column_stack((wanted.real, -wanted.imag, fins.real, fins.imag))
    with pytest.raises(LogError, match="opposite sign of `turn`"):
        roll_from_mixing(dataclasses.replace(log, commands=busy), DEMANDED, FINS)


@pytest.mark.parametrize(
    ("log", "demanded", "says"),
    [
        (mixed(), ("climb", "climb"), "check names, signs and mixing"),
        (mixed(size=1e-4), DEMANDED, "in only 0 % of the samples"),
        (mixed(), ("clim", "turn"), "no command 'clim'"),
        (dataclasses.replace(mixed(), attitude=None), DEMANDED, "no attitude, which `roll_from_m"),
    ],
)
def test_what_shows_no_roll_is_named(log: Log, demanded: tuple[str, str], says: str) -> None:
    with pytest.raises(LogError, match=says):
        roll_from_mixing(log, demanded, FINS)


def test_a_segment_that_shows_nothing_is_named() -> None:
    log = mixed()
    commands = log.commands.copy()
    commands[300:] = 0.0
    halves = Log.from_arrays(
        TIME,
        {"u": np.ones(600)},
        attitude=log.attitude,
        commands=dict(zip(log.command_names, commands.T, strict=True)),
        segment=["a"] * 300 + ["b"] * 300,
    )
    with pytest.raises(LogError, match=r"from 30 s to 59\.9 s"):
        roll_from_mixing(halves, DEMANDED, FINS)
