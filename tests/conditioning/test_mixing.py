from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hydrodamp.conditioning.mixing import AVL_690, Mixing, roll_from_mixing
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


def test_another_mixing() -> None:
    """One that does not turn the demand, as the field vehicle of the tests' data does."""
    own = Mixing(sine=((0, 1), (1, 0)))
    log = mixed()
    climb, turn = log.command("climb"), 3 * log.command("turn")
    c, s = np.cos(ROLL), np.sin(ROLL)
    fins = (c * climb + s * turn, c * turn + s * climb)
    commands = np.column_stack((climb, turn, *fins))
    made = roll_from_mixing(dataclasses.replace(log, commands=commands), DEMANDED, FINS, own)
    np.testing.assert_allclose(angles(made)[3:-3, 0], ROLL[3:-3], atol=5e-3)


def test_a_table_that_is_none() -> None:
    with pytest.raises(LogError, match=r"`sine` must have shape \(2, 2\); got \(2,\)"):
        Mixing(sine=(1, 0))


def test_the_field_log_of_the_690(measured_logs: Callable[[str], Path]) -> None:
    """Oracle: the roll of the derived file, recovered from the same fins by other means."""
    folder = measured_logs("vt690_field")
    fins, climb, turn = (
        np.genfromtxt(
            folder / f"share_pid_attitude_control_node.{name}.dat",
            delimiter=",",
            skip_header=3,
            max_rows=6000,
        )
        for name in ("fins", "pitch_pid", "yaw_pid")
    )
    commands = {
        "elevator": (fins[:, 1] - fins[:, 2]) / 2,
        "rudder": (fins[:, 4] - fins[:, 3]) / 2,
        "climb": climb[:, 3],
        "turn": turn[:, 3],
    }
    rows = slice(500, None)
    log = Log.from_arrays(
        fins[rows, 0],
        {"u": np.ones(5500)},
        attitude=np.column_stack((0 * turn[rows, 1], climb[rows, 1], turn[rows, 1])),
        commands={name: values[rows] for name, values in commands.items()},
    )
    made = roll_from_mixing(log, DEMANDED, FINS, AVL_690)
    assert made.notes[-1].endswith("interpolated in 0 of 5500 samples")
    derived = np.genfromtxt(folder / "derived_10hz.csv", delimiter=",", names=True, max_rows=5000)
    inside = (made.time > derived["time_s"][0]) & (made.time < derived["time_s"][-1])
    roll = np.interp(made.time[inside], derived["time_s"], derived["roll_rad"])
    assert np.median(np.abs(angles(made)[inside, 0] - roll)) < 0.004


def test_fins_at_their_stops_are_bridged() -> None:
    made = roll_from_mixing(mixed(stop=0.2), DEMANDED, FINS)
    assert "interpolated in 0 of" not in made.notes[0]
    assert np.mean(np.abs(angles(made)[:, 0] - ROLL) < 0.08) > 0.9


def test_wrong_signs_and_fins_amidships_are_refused() -> None:
    log = mixed()
    busy = log.commands.copy()
    wanted = 0.2 * np.exp(0.5j * np.random.default_rng(1).normal(size=600))
    fins = wanted * np.exp(1j * ROLL)
    busy[:] = np.column_stack((wanted.real, -wanted.imag, fins.real, fins.imag))
    with pytest.raises(LogError, match="steadier with the other sign of `turn`"):
        roll_from_mixing(dataclasses.replace(log, commands=busy), DEMANDED, FINS)
    with pytest.raises(LogError, match="are names, signs and mixing right"):
        roll_from_mixing(mixed(), ("climb", "climb"), FINS)
    with pytest.raises(LogError, match="in 0 % of the samples only"):
        roll_from_mixing(mixed(size=1e-4), DEMANDED, FINS)


def test_what_is_lacking_is_named() -> None:
    with pytest.raises(LogError, match="no command 'clim'"):
        roll_from_mixing(mixed(), ("clim", "turn"), FINS)
    with pytest.raises(LogError, match="roll from mixing needs pitch and yaw"):
        roll_from_mixing(dataclasses.replace(mixed(), attitude=None), DEMANDED, FINS)


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
    with pytest.raises(LogError, match=r"nothing shows the roll from 30 s to 59\.9 s"):
        roll_from_mixing(halves, DEMANDED, FINS)
