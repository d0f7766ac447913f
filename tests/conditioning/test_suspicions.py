from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from hydrodamp.conditioning.suspicions import note_suspicions, suspicions
from hydrodamp.data.attitude import quaternion_from_euler, rotation
from hydrodamp.data.log import Log

Change = Callable[[Log], dict[str, object]]

TIME = np.arange(0.0, 120.0, 0.1)


def sound() -> Log:
    """A vehicle circling, everything measured and in accord."""
    yaw = 0.2 * TIME + 0.3 * np.sin(0.5 * TIME)
    attitude = quaternion_from_euler(np.outer(yaw, (0, 0, 1)))
    velocity = np.zeros((1200, 6))
    velocity[:, 0] = 1.5 + 0.1 * np.sin(TIME)
    velocity[:, 5] = 0.2 + 0.15 * np.cos(0.5 * TIME)
    world = np.einsum("nij,nj->ni", rotation(attitude), velocity[:, :3])
    force = np.full((1200, 3), (0.01, 0.02, -9.81))
    return Log(
        time=TIME,
        velocity=velocity,
        attitude=attitude,
        position=np.cumsum(world, axis=0) / 10,
        specific_force=force,
        command_names=("rudder", "m1"),
        commands=np.column_stack((0.1 * np.sin(TIME), np.sin(TIME))),
        segments=(),
    )


def test_a_sound_log_is_above_suspicion() -> None:
    assert suspicions(sound()) == ()
    assert note_suspicions(sound()).notes == ()


def rates(scale: float) -> Change:
    """Yaw rates times a factor."""
    return lambda log: {"velocity": log.velocity * np.array([1, 1, 1, 1, 1, scale])}


def way(scale: float) -> Change:
    """Positions times a factor."""
    return lambda log: {"position": log.position * scale}


def force(scale: float) -> Change:
    """Specific forces times a factor."""
    return lambda log: {"specific_force": log.specific_force * scale}


def constant_heave(log: Log) -> dict[str, object]:
    """A heave that does not vary, where nothing tells it from a true one."""
    velocity = log.velocity.copy()
    velocity[:, 2] = 0.1
    return {"velocity": velocity, "attitude": None, "position": None}


YAW = np.degrees(0.2 * TIME + 0.3 * np.sin(0.5 * TIME))
PULSES = 1500 + 300 * np.sin(TIME)
TWICE = "is rad/s taken for deg/s and converted once too often"
ANGLE = f"{TWICE}, or its angle is degrees taken for radians"
PULSE = "looks like a pulse width [us], not a force"


@pytest.mark.parametrize(
    ("change", "found"),
    [
        (rates(180 / np.pi), {"r": "is deg/s taken for rad/s"}),
        (rates(60 / 2 / np.pi), {"r": "is rpm taken for rad/s"}),
        (rates(1 / 2 / np.pi), {"r": "is rev/s taken for rad/s"}),
        (rates(-1.0), {"r": "is of the other sign, or of another frame than the attitude"}),
        (rates(np.pi / 180), {"r": ANGLE}),
        (  # rates alone cannot tell
            lambda log: {
                "attitude": quaternion_from_euler(np.outer(YAW, (0, 0, 1))),
                "position": None,
            },
            {"r": ANGLE},
        ),
        (way(0.01), {"u": "is cm/s taken for m/s"}),
        (way(0.001), {"u": "is mm/s taken for m/s"}),
        (way(1852 / 3600), {"u": "is knots taken for m/s"}),
        (way(0.3048), {"u": "is ft/s taken for m/s"}),
        (way(-1.0), {"u": "is of the other sign, or of another frame than the position"}),
        (
            lambda log: {"position": None, "velocity": log.velocity * [20.0, 1, 1, 1, 1, 1]},
            {"u v w": "may be cm/s or mm/s, not m/s"},
        ),
        (force(1 / 9.81), {"specific_force": "is g taken for m/s^2"}),
        (
            lambda log: {**force(1 / 9.81)(log), "attitude": None, "position": None},
            {"specific_force": "is g taken for m/s^2"},
        ),
        (force(-1.0), {"specific_force": "is of the other sign or frame"}),
        (force(0.0), {}),
        (
            lambda log: {"commands": np.column_stack((20 * np.sin(TIME), PULSES))},
            {"m1": PULSE, "rudder": "may be in degrees, not rad"},
        ),
        (lambda log: {"wrench": np.outer(PULSES, (1, 0, 0, 0, 0, 0))}, {"X": PULSE}),
        (constant_heave, {"w": "was not measured"}),
    ],
)
def test_wrong_units_and_signs_are_suspected(change: Change, found: dict[str, str]) -> None:
    wrong = suspicions(dataclasses.replace(sound(), **change(sound())))
    assert [(one.channel, one.looks) for one in wrong] == [*found.items()]


def test_suspicions_are_told_and_nothing_is_changed() -> None:
    log = dataclasses.replace(sound(), time=1000 * TIME, attitude=None, position=None)
    made = note_suspicions(log)
    np.testing.assert_array_equal(made.time, log.time)
    assert made.notes == ("suspicion: `time` may be in ms, not s: the median step is 100",)


def swaying(**wrong: float) -> Log:
    """A vehicle that goes ahead, sideways and up and down, with velocities times some factors."""
    rng = np.random.default_rng(5)
    yaw = 0.5 * np.sin(0.1 * TIME)
    attitude = quaternion_from_euler(np.outer(yaw, (0, 0, 1)))
    velocity = np.column_stack((np.sin(0.2 * TIME), np.cos(0.3 * TIME), np.sin(0.13 * TIME)))
    world = np.einsum("nij,nj->ni", rotation(attitude), velocity)
    position = np.cumsum(world, axis=0) / 10 + rng.normal(0, 0.02, (1200, 3))
    factors = [wrong.get(name, 1.0) for name in "uvw"]
    named = dict(zip("uvw", (velocity * factors).T, strict=True))
    return Log.from_arrays(TIME, named, attitude=attitude, position=position)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({}, []),
        ({"v": -1.0}, [("v", "of the other sign")]),
        ({"u": 1.944}, [("u", "knots taken for m/s")]),
        ({"w": 0.01}, [("w", "m/s taken for cm/s and converted once too often")]),
        ({"u": 3.6, "v": -1.0}, [("u", "km/h taken for m/s"), ("v", "of the other sign")]),
        ({"u": -1.0, "v": -1.0, "w": -1.0}, [("u v w", "of the other sign")]),
    ],
)
def test_one_velocity_that_is_wrong_is_told(
    wrong: dict[str, float], said: list[tuple[str, str]]
) -> None:
    found = suspicions(swaying(**wrong))
    assert [one.channel for one in found] == [channel for channel, _ in said]
    assert all(words in one.looks for one, (_, words) in zip(found, said, strict=True))
