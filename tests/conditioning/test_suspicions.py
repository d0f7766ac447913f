"""Each fault in the logs of an ROV, an AUV and a tanker is told once, a sound log never."""

import dataclasses
import re
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
import yaml

import hydrodamp as hd
import oracle
from hydrodamp.conditioning.consistency import VehicleScale
from hydrodamp.conditioning.pipeline import parse_steps
from hydrodamp.conditioning.quality_checks import Fix, annotate_quality, check_quality
from hydrodamp.data.attitude import euler_from_quaternion, quaternion_from_euler, rotation_matrices
from hydrodamp.data.channel_regression import cumulative_integral
from hydrodamp.simulation.log_issues import log_issues
from table_rows import rows
from value_changes import set_values

#: Length [m], speed [m/s] and step of the clock [s].
CRAFT = {"rov": (0.5, 0.4, 0.1), "auv": (2.0, 1.5, 0.1), "tanker": (320.0, 8.0, 1.0)}
SEEDS = (1, pytest.param(2, marks=pytest.mark.slow))
OTHERS = [pytest.param(name, marks=pytest.mark.slow) for name in ("auv", "tanker")]


@cache
def voyage(craft, seed):
    """A voyage by Froude's law, everything measured with noise and in accord."""
    length, speed, step = CRAFT[craft]
    rng = np.random.default_rng(seed)
    time = step * np.arange(3000.0)
    pace = rng.uniform(0.1, 0.3, 6) * speed / length
    waves = np.sin(np.outer(time, pace) + rng.uniform(0, 6, 6))
    swing = np.cos(np.outer(time, pace) + rng.uniform(0, 6, 6))
    angles = waves[:, :3] * (0.2, 0.15, 1.2)
    rates = oracle.body_rates(angles, np.gradient(angles, time, axis=0))
    linear = speed * (swing[:, :3] * (0.4, 0.2, 0.1) + (0.8, 0.0, 0.0))
    world = np.einsum("nij,nj->ni", rotation_matrices(quaternion_from_euler(angles)), linear)
    sizes = (2e-4, 0.01 * speed, 0.02 * speed / length, 2e-3 * length)
    a, v, w, p = (size * rng.standard_normal((3000, 3)) for size in sizes)
    return hd.Log(
        time=time,
        velocity=np.column_stack((linear + v, rates + w)),
        attitude=quaternion_from_euler(angles + a),
        position=cumulative_integral(time, world) + p,
        wrench=waves,
    )


def told(craft, log):
    """Return what `compare` and `identify` say before they work."""
    length = CRAFT[craft][0]
    vehicle = hd.Vehicle.from_hull(length, 0.3 * length, 50 * length**3)
    issues = map(str, log_issues(vehicle, log, [hd.catalog["linear"]]))
    return [issue.removeprefix("quality issue: ") for issue in issues]


Fault = Callable[[hd.Log], dict[str, object]]


def times(**factors):
    """Velocities times factors."""
    return lambda log: {"velocity": log.velocity * [factors.get(name, 1.0) for name in "uvwpqr"]}


def replaced(name, rows, value):
    """Some rows of an array: a value, or what a function makes of the array."""

    def fault(log):
        new = value(getattr(log, name)) if callable(value) else value
        return {name: getattr(set_values(log, name, (rows, new)), name)}

    return fault


def earth_fixed(log):
    """Velocities along the axes of the world."""
    world = np.einsum("nij,nj->ni", rotation_matrices(log.attitude), log.velocity[:, :3])
    return {"velocity": np.column_stack((world, log.velocity[:, 3:]))}


def arrived(log):
    """Times of arrival: late by up to a step and more."""
    step = log.time[1]
    late = np.random.default_rng(0).exponential(0.8 * step, log.n)
    return {"time": np.maximum.accumulate(log.time + late) + 1e-4 * step * np.arange(log.n)}


AWAY = (0.0, 0.6, 0.0, 0.8)  # an attitude far from any
FAULTS = {
    "dead gyro": (times(p=1e-7, q=1e-7, r=1e-7), "p q r", "`steps: [rates_from_attitude: {names"),
    "noise": (
        replaced("velocity", np.s_[:, 5], lambda v: np.random.default_rng(0).permutation(v[:, 5])),
        "r",
        "over ",
    ),
    "degrees": (times(p=0.01745, q=0.01745, r=0.01745), "p q r", "taken for deg/s"),
    "rpm": (times(r=9.549), "r", "write `unit: rpm`"),
    "other axes": (times(q=-1.0, r=-1.0), "q r", "of opposite sign"),
    "knots": (times(u=1.944), "u", "write `unit: knots`"),
    "sway reversed": (times(v=-1.0), "v", "`sign: -1`"),
    "no surge": (times(u=0.0), "u", "`steps: [velocity_from_position: {names: [u]}]`"),
    "earth-fixed": (earth_fixed, "u v w", "name them `north`, `east` and `down`"),
    "east and north": (
        lambda log: {"position": log.position[:, (1, 0, 2)] * (1.0, 1.0, -1.0)},
        "u v w",
        "name the axes of the position `east`, `north`, `up`",
    ),
    "lost frames": (
        replaced("position", np.s_[900:940], 0.0),
        "north east down",
        "add `mask_mocap_dropouts` to `steps`",
    ),
    "leap": (
        replaced("position", np.s_[1500:], lambda p: p[1500:] + 5 * np.ptp(p, axis=0)),
        "position",
        "`segment`",
    ),
    "frozen pose": (
        replaced("position", np.s_[900:1500], lambda p: p[900]),
        "north east down",
        "add `mask_frozen` to `steps`",
    ),
    "frozen": (
        replaced("velocity", np.s_[900:1500, :3], lambda v: v[900, :3]),
        "u v w",
        "add `mask_frozen` to `steps`",
    ),
    "Doppler log of a sixth of the rate": (
        replaced("velocity", np.s_[:, :3], lambda v: v[np.arange(len(v)) // 6 * 6, :3]),
        "u v w",
        "2500 of 3000 samples",
    ),
    "arrival": (arrived, "time", "`time: header.stamp`"),
    "one leap": (replaced("attitude", [700], AWAY), "yaw", "at "),
    "leaps": (replaced("attitude", [700, 1500], AWAY), "yaw", "in 2 intervals from "),
    "impossible": (  # differenced over a frame that motion capture lost
        replaced("velocity", ([700, 710], 0), (25.0, -25.0)),
        "u",
        "in 2 intervals",
    ),
}


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("craft", CRAFT)
def test_a_sound_log_is_left_alone(craft, seed):
    assert told(craft, voyage(craft, seed)) == []
    assert check_quality(voyage(craft, seed)) == ()


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("craft", CRAFT)
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_told_in_one_sentence_with_its_cure(fault, craft, seed):
    change, channel, words = FAULTS[fault]
    log = voyage(craft, seed)
    said = told(craft, dataclasses.replace(log, **change(log)))
    assert [one for one in said if one.startswith(f"`{channel}` ") and words in one], said
    assert len(said) == 1, said


def commanded(name, values):
    """One command in place of the wrench."""
    return lambda _: {"wrench": None, "command_names": (name,), "commands": values[:, np.newaxis]}


def place(factor):
    """Positions times a factor."""
    return lambda log: {"position": factor * log.position}


def force(factor):
    """Specific forces of a vehicle that floats, times a factor."""
    return lambda log: {"specific_force": -9.81 * factor * log.down}


def turned_in_degrees(log):
    """A heading in degrees for radians; rates alone cannot tell."""
    yaw = np.degrees(euler_from_quaternion(log.attitude)[:, 2])
    attitude = quaternion_from_euler(np.outer(yaw, (0, 0, 1)))
    return {"attitude": attitude, "position": None, "velocity_names": ("u", "r")}


def alone(log, **others):
    """Nothing but velocities and what else is given."""
    return {"attitude": None, "position": None, **others}


WAVE = np.sin(np.arange(3000) / 10)
PULSES = 1500 + 300 * WAVE
TWICE = "and converted once too often"
PULSE = "looks like a pulse width [us], not a force"
OTHER_SIGN = "is of opposite sign"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "found"),
    [
        (times(r=180 / np.pi), {"r": "is deg/s taken for rad/s"}),
        (times(r=1 / 2 / np.pi), {"r": "is rev/s taken for rad/s"}),
        (turned_in_degrees, {"r": f"is rad/s taken for deg/s {TWICE}, or its angle is degrees"}),
        (times(w=0.01), {"w": f"is m/s taken for cm/s {TWICE}"}),
        (times(u=3.6, v=-1.0), {"u": "is km/h taken for m/s", "v": OTHER_SIGN}),
        (place(0.01), {"u v w": "is cm/s taken for m/s"}),
        (place(0.001), {"u v w": "is mm/s taken for m/s"}),
        (place(0.3048), {"u v w": "is ft/s taken for m/s"}),
        (place(-1.0), {"u v w": OTHER_SIGN}),
        (
            lambda log: alone(log, velocity=log.velocity * [20.0, 1, 1, 1, 1, 1]),
            {"u v w": "may be cm/s or mm/s, not m/s"},
        ),
        (force(1 / 9.81), {"specific_force": "is g taken for m/s^2"}),
        (
            lambda log: alone(log, **force(1 / 9.81)(log)),
            {"specific_force": "is g taken for m/s^2"},
        ),
        (force(-1.0), {"specific_force": "has the opposite sign"}),
        (force(0.0), {}),
        (commanded("rudder", 20 * WAVE), {"rudder": "may be in degrees, not rad"}),
        (commanded("m1", PULSES), {"m1": PULSE}),
        (lambda log: {"wrench": np.outer(PULSES, (1, 0, 0, 0, 0, 0))}, {"X": PULSE}),
        (
            lambda log: alone(log, **replaced("velocity", np.s_[:, 2], 0.1)(log)),
            {"w": "was not measured"},
        ),
        (lambda log: alone(log, time=1000 * log.time), {"time": "may be in ms, not s"}),
    ],
)
def test_wrong_units_and_signs_are_noted(change, found):
    log = dataclasses.replace(voyage("auv", 1), **change(voyage("auv", 1)))
    wrong = check_quality(log)
    grave = [one for one in wrong if not one.is_minor or one.fix == Fix("unit", "deg")]
    assert [one.channel for one in grave] == [*found]
    assert all(one.problem.startswith(found[one.channel]) for one in grave)
    made = annotate_quality(log)
    assert made.notes == tuple(map(str, wrong))
    np.testing.assert_array_equal(made.time, log.time)


def test_what_is_little_goes_with_the_vehicle_by_froude_s_law():
    """A yaw rate of 0.0056 rad/s is much for a ship of 320 m, and nothing for an AUV."""
    ship, auv = (VehicleScale(CRAFT[craft][0]) for craft in ("tanker", "auv"))
    assert 5 * ship.negligible("rad/s") < 0.0056 < auv.negligible("rad/s")
    for name in ("negligible", "largest_plausible"):
        one, other = getattr(ship, name), getattr(auv, name)
        product = one("m/s") * one("rad/s")  # speeds go with the root of the length, rates against
        assert product == pytest.approx(other("m/s") * other("rad/s"))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("craft", ["rov", *OTHERS])
@pytest.mark.parametrize("fault", [name for name in FAULTS if name not in ("noise", "impossible")])
def test_the_step_that_a_cure_names_mends_the_log(fault, craft):
    log = voyage(craft, 1)
    wrong = dataclasses.replace(log, **FAULTS[fault][0](log))
    (found,) = check_quality(wrong, CRAFT[craft][0])
    named = re.search(r"`steps: (.*)`", found.remedy)
    is_step = found.fix is not None and found.fix.kind == "step"
    if named or is_step:
        text = f"[{found.fix.value}]" if is_step else named[1]
        steps, faults = parse_steps(yaml.safe_load(text))
        assert not faults
        assert check_quality(hd.clean(wrong, steps), CRAFT[craft][0]) == ()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@rows("folder, files, mapping")
def test_measured_logs_are_sound_but_for_single_samples(folder, files, mapping, measured_logs):
    home = measured_logs(folder)
    for path in home.glob(files) if files else (home,):
        log = hd.read_log(path, mapping)
        parts = [log, *(log.between(start, start + 40.0) for start in (0.0, 20.0))]
        assert [one for part in parts for one in check_quality(part) if not one.is_minor] == []


def test_a_fault_at_the_end_is_not_taken_for_one_at_the_start():
    log = set_values(voyage("rov", 1), "velocity", (([-1, 0], [0, 1]), 25.0))  # m/s
    found = [one for one in check_quality(log, 1.0) if "plausible speed" in one.problem]
    places = {"u": f"at {log.elapsed[-1]:.6g} s", "v": "at 0 s"}
    assert {one.channel: one.where for one in found} == places


def test_zeros_at_once_are_no_matter_of_a_doppler_log():
    log = set_values(voyage("rov", 1), "velocity", (np.s_[500:510, :3], 0.0))
    (found,) = (one for one in check_quality(log) if one.is_minor)
    assert "drops to zero" in found.problem
    assert "lock" not in found.problem
