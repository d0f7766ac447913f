from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest

from hydrodamp.conditioning.suspicions import note_suspicions, suspicions
from hydrodamp.data.attitude import quaternion_from_euler, rotation
from hydrodamp.data.log import Log

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


def looks(log: Log) -> list[tuple[str, str]]:
    return [(one.channel, one.looks) for one in suspicions(log)]


def test_a_sound_log_is_above_suspicion() -> None:
    assert suspicions(sound()) == ()
    assert note_suspicions(sound()).notes == ()


@pytest.mark.parametrize(
    ("scale", "says"),
    [
        (180 / np.pi, "is deg/s taken for rad/s"),
        (60 / 2 / np.pi, "is rpm taken for rad/s"),
        (1 / 2 / np.pi, "is rev/s taken for rad/s"),
        (-1.0, "is of the other sign, or of another frame than the attitude"),
    ],
)
def test_rates_in_another_unit(scale: float, says: str) -> None:
    log = sound()
    velocity = log.velocity.copy()
    velocity[:, 5] *= scale
    (one,) = suspicions(dataclasses.replace(log, velocity=velocity))
    assert (one.channel, one.looks) == ("r", says)
    assert f"{scale:.2g}"[:3] in one.evidence


def test_rates_converted_once_too_often() -> None:
    """Or the attitude is in degrees: rates alone cannot tell, and both are said."""
    log = sound()
    velocity = log.velocity.copy()
    velocity[:, 5] *= np.pi / 180
    found = looks(dataclasses.replace(log, velocity=velocity))
    assert found == [
        ("r", "is rad/s taken for deg/s and converted once too often"),
        ("yaw", "is degrees taken for radians"),
    ]


def test_heading_in_degrees() -> None:
    log = sound()
    yaw = np.degrees(0.2 * TIME + 0.3 * np.sin(0.5 * TIME))
    wrong = quaternion_from_euler(np.outer(yaw, (0, 0, 1)))
    found = looks(dataclasses.replace(log, attitude=wrong, position=None))
    assert found == [("yaw", "is degrees taken for radians")]


@pytest.mark.parametrize(
    ("scale", "says"),
    [
        (0.01, "is cm/s taken for m/s"),
        (0.001, "is mm/s taken for m/s"),
        (1852 / 3600, "is knots taken for m/s"),
        (0.3048, "is ft/s taken for m/s"),
        (-1.0, "is of the other sign, or of another frame than the position"),
    ],
)
def test_speed_in_another_unit_than_the_way(scale: float, says: str) -> None:
    log = sound()
    position = log.position * scale
    ((channel, found),) = looks(dataclasses.replace(log, position=position))
    assert (channel, found) == ("u v w", says)


def test_a_speed_that_no_vehicle_has() -> None:
    log = dataclasses.replace(sound(), position=None)
    velocity = log.velocity * np.array([20.0, 1, 1, 1, 1, 1])
    fast = dataclasses.replace(log, velocity=velocity)
    assert looks(fast) == [("u v w", "may be cm/s or mm/s, not m/s")]


def test_accelerometers() -> None:
    log = sound()
    units = dataclasses.replace(log, specific_force=log.specific_force / 9.81)
    assert looks(units) == [("specific_force", "is g taken for m/s^2")]
    turned = dataclasses.replace(log, specific_force=-log.specific_force)
    assert looks(turned) == [("specific_force", "is of the other sign or frame")]
    nothing = dataclasses.replace(log, specific_force=np.zeros((1200, 3)))
    assert looks(nothing) == []
    assert looks(dataclasses.replace(units, attitude=None, position=None)) == looks(units)


def test_pulse_widths_and_angles() -> None:
    pulses = 1500 + 300 * np.sin(TIME)
    log = dataclasses.replace(sound(), commands=np.column_stack((20 * np.sin(TIME), pulses)))
    assert looks(log) == [
        ("m1", "looks like a pulse width [us], not a force"),
        ("rudder", "may be in degrees, not rad"),
    ]
    wrench = np.zeros((1200, 6))
    wrench[:, 0] = pulses
    assert looks(dataclasses.replace(sound(), wrench=wrench)) == [
        ("X", "looks like a pulse width [us], not a force")
    ]


def test_what_was_never_measured_and_a_clock_in_milliseconds() -> None:
    log = dataclasses.replace(sound(), attitude=None, position=None)
    velocity = log.velocity.copy()
    velocity[:, 2] = 0.1
    assert looks(dataclasses.replace(log, velocity=velocity)) == [("w", "was not measured")]
    assert looks(dataclasses.replace(log, time=1000 * TIME)) == [("time", "may be in ms, not s")]


def test_suspicions_are_told_and_nothing_is_changed() -> None:
    log = dataclasses.replace(sound(), time=1000 * TIME, attitude=None, position=None)
    made = note_suspicions(log)
    np.testing.assert_array_equal(made.time, log.time)
    assert made.notes == ("suspicion: `time` may be in ms, not s: the median step is 100",)


def test_fewer_velocities_have_fewer_suspicions() -> None:
    for names in itertools.chain.from_iterable(itertools.combinations("uvr", k) for k in (1, 2, 3)):
        log = sound()
        kept = {name: log.velocity[:, "uvwpqr".index(name)] for name in names}
        few = Log.from_arrays(TIME, kept, attitude=log.attitude, position=log.position)
        assert suspicions(few) == ()


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
