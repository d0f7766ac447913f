"""Implausible samples are left out and named; strong commands are not."""

import re
import warnings
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.data.log import Log
from hydrodamp.data.plausibility import mask_absurd
from hydrodamp.errors import LogError, OutlierWarning
from hydrodamp.simulation.ranges import ranges_of, remove_implausible
from value_changes import set_values

CAMPAIGN = hd.reenact(duration=30.0)
MODELS = [hd.catalog["prestero"]]

pytestmark = pytest.mark.filterwarnings("ignore::hydrodamp.errors.GapWarning")


def screened(log):
    """Return the screened log and its warnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        log = remove_implausible(CAMPAIGN.vehicle, log, MODELS)
    return log, [str(each.message) for each in caught if each.category is OutlierWarning]


def with_command(name, rows, value, log=CAMPAIGN.train):
    """Return a log with a value of a command in some rows."""
    return set_values(log, "commands", ((rows, log.command_names.index(name)), value))


def test_ranges_are_those_of_free_axes():
    planar = replace(CAMPAIGN.vehicle, axes=("X", "Y", "N"))
    ranges = ranges_of(planar, ("rudder",), actuators=False)
    assert ranges.names == ("rudder", "X", "Y", "N")
    assert np.isfinite(ranges[1:]).all()


@pytest.mark.parametrize("rows", [[100], [0], [100, 101, 102, 500]])
@pytest.mark.parametrize("value", [65535.0, 1e6, 12e3, -1.0, 32767.0])
def test_wild_commands_are_cut_out_and_named(rows, value):
    log, (message,) = screened(with_command("rpm", rows, value))
    assert not np.isin(value, log.command("rpm"))
    assert f"`rpm`: {len(rows)} implausible sample" in message
    assert f"{value:g} at {CAMPAIGN.train.time[rows[0]] - CAMPAIGN.train.time[0]:.2f} s" in message


@pytest.mark.parametrize(("index", "value"), [(0, 32.767), (2, -32.768), (3, 20.0)])
def test_wild_velocities_are_interpolated_and_named(index, value):
    wild = set_values(CAMPAIGN.train, "velocity", ((100, index), value))
    log, (message,) = screened(wild)
    assert log.n == wild.n
    assert log.velocity[100, index] == pytest.approx(wild.velocity[[99, 101], index].mean())
    assert f"`{'uvwpqr'[index]}`: 1 implausible sample" in message


def start_propeller_once():
    """A propeller that starts once, and a rudder hard over."""
    log = with_command("rpm", slice(None), 0.0)
    rudder, rpm = map(log.command_names.index, ("rudder", "rpm"))
    log = replace(log, commands=0.01 * log.commands)
    return set_values(
        log, "commands", (np.s_[100:102, rpm], 2000.0), (np.s_[200:203, rudder], 0.34)
    )


def pulse_propeller(value):
    """A single pulse of an idle propeller."""
    noise = np.random.default_rng(1).normal(0.0, 1e-3, CAMPAIGN.train.commands.shape)
    return with_command("rpm", slice(100, 103), value, replace(CAMPAIGN.train, commands=noise))


def add_impact(index, value):
    """An impact that the accelerometer records."""
    log = replace(CAMPAIGN.train, acceleration=np.zeros((CAMPAIGN.train.n, 6)))
    log = set_values(log, "velocity", (np.s_[100:102, index], value))
    return set_values(log, "acceleration", ((100, index), 40.0))


@pytest.mark.parametrize(
    "log",
    [
        with_command("rudder", slice(None), 0.0),
        with_command("rpm", slice(100, 150), 9000.0),
        with_command("rpm", slice(None), 0.0),
        with_command("rpm", slice(100, 102), 0.0),
        start_propeller_once(),
        *map(pulse_propeller, (9000.0, 12e3, 20e3)),
        *(add_impact(index, value) for index, value in ((0, 5.0), (3, 3.0), (5, -2.0))),
    ],
)
def test_steps_pulses_and_impacts_are_kept(log):
    assert screened(log) == (log, [])


def with_actuator(actuator, values):
    """Return the vehicle with one actuator, and a log of its command."""
    commands = np.resize(values, CAMPAIGN.train.n)[:, None]
    log = replace(CAMPAIGN.train, commands=commands, command_names=actuator.commands)
    return replace(CAMPAIGN.vehicle, actuators=(actuator,)), log


THRUSTER = {"position": (0.0, 0.0, 0.0), "direction": (1.0, 0.0, 0.0)}
CURVE = [[1100.0, -50.0], [1500.0, 0.0], [1900.0, 50.0]]


@pytest.mark.parametrize(
    ("actuator", "values"),
    [
        (hd.Thruster("duty", gain=1e-3, limit=32767.0, **THRUSTER), [8000.0] * 30 + [32767.0] * 30),
        (hd.Thruster("duty", gain=1e-3, limit=32767.0, **THRUSTER), [8000.0] * 98 + [32767.0] * 2),
        (hd.Thruster("duty", gain=0.03, **THRUSTER), [8000.0] * 30 + [32767.0] * 30),
        (hd.Thruster("percent", gain=1.0, **THRUSTER), [20.0] * 600 + [-1.0] * 30),
        (hd.Thruster("percent", gain=1.0, **THRUSTER), [20.0] * 600 + [-1.0] * 3),
        (hd.Fin("fin", {"Y": 0.1}), [10.0] * 600 + [-1.0] * 20),
        (hd.Propeller("rev", thrust=0.05, speed_slope=0.1), [20.0] * 600 + [-1.0] * 30),
    ],
)
def test_full_scale_and_a_weak_reverse_are_kept(actuator, values):
    vehicle, log = with_actuator(actuator, values)
    assert remove_implausible(vehicle, log, []) == log


@pytest.mark.parametrize(
    ("actuator", "values"),
    [
        (hd.Thruster("duty", gain=1e-3, limit=1000.0, **THRUSTER), [800.0] * 180 + [65535.0] * 20),
        (hd.Thruster("duty", gain=1e-3, limit=1e4, **THRUSTER), [8000.0] * 198 + [32767.0] * 2),
        (hd.Thruster("pwm", curve=CURVE, **THRUSTER), [1600.0] * 198 + [-1.0] * 2),
    ],
)
def test_a_sentinel_beyond_the_range_of_the_actuator_is_cut_out(actuator, values):
    vehicle, log = with_actuator(actuator, values)
    with pytest.warns(OutlierWarning, match="unknown to MAVLink"):
        log = remove_implausible(vehicle, log, [])
    assert np.unique(log.commands).tolist() == [values[0]]


def test_a_pulse_of_a_channel_of_unknown_effect_is_kept_and_a_field_is_not():
    pilot = np.random.default_rng(1).normal(0.0, 1e-3, CAMPAIGN.train.n)
    pilot[200:203] = 1.0
    model = hd.catalog["linear"].with_terms({"X": "pilot"})
    vehicle = replace(CAMPAIGN.vehicle, actuators=())
    log = replace(CAMPAIGN.train, commands=pilot[:, None], command_names=("pilot",))
    assert remove_implausible(vehicle, log, [model]) == log
    log.commands.setflags(write=True)
    log.commands[300] = 1e6
    with pytest.warns(OutlierWarning, match="`pilot`: 1 implausible sample .*: 1e\\+06 at 30.00 s"):
        assert remove_implausible(vehicle, log, [model]).n == log.n - 1


def test_a_channel_in_another_unit_is_kept_and_named():
    log = with_command("rpm", slice(None), 1e5)
    screened_log, (message,) = screened(log)
    assert screened_log == log
    assert f"`rpm`: {log.n} of {log.n} samples are beyond " in message


def test_a_problem_and_a_replay_leave_out_the_same():
    log, damping = with_command("rpm", [100], 65535.0), hd.published["vt690-sname2022"]
    with pytest.warns(OutlierWarning, match="rpm"):
        problem = hd.prepare(CAMPAIGN.vehicle, log, MODELS)
    with pytest.warns(OutlierWarning, match="rpm"):
        trajectory = hd.simulate(CAMPAIGN.vehicle, damping, log)
    assert problem.n_samples == trajectory.log.n == log.n - 1


@pytest.mark.parametrize(
    ("name", "value"), [("u", 300.0), ("r", 65.535), ("pitch", 400.0), ("roll", 1e308)]
)
def test_an_impossible_sample_does_not_refuse_a_log(tmp_path, name, value):
    time = np.arange(40.0) / 10
    columns = {each: 0.1 * np.sin(time + k) for k, each in enumerate(("roll", "pitch", *"uvwpqr"))}
    columns |= {"time": time, "yaw": time, "rpm": 0 * time}
    columns[name][20] = value
    path = tmp_path / "log.csv"
    table = np.column_stack([*columns.values()])
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="")
    words = rf"log.csv: `{name}`: 1 .*: {re.escape(f'{value:g}')} at 2.00 s"
    with pytest.warns(OutlierWarning, match=words):
        log = hd.read_log(path)
    assert log.time.tolist() == np.delete(time, 20).tolist()
    angles = np.column_stack([columns[each] for each in ("roll", "pitch", "yaw")])
    velocity = {each: columns[each] for each in "uvwpqr"}
    with pytest.warns(OutlierWarning, match=name):
        assert Log.from_arrays(time, velocity, attitude=angles).n == 39


def test_an_impossible_quaternion_does_not_refuse_a_log():
    train, attitude = CAMPAIGN.train, CAMPAIGN.train.attitude[:200].copy()
    attitude[50, 0] = 65535.0
    with pytest.warns(OutlierWarning, match="qw qx qy qz"):
        log = Log.from_arrays(train.time[:200], train.velocity[:200], attitude=attitude)
    assert log.n == 199


def test_degrees_are_refused(refused):
    refused(LogError, Log.from_arrays, np.arange(40.0), {"u": np.full(40, 60.0)})


def test_warnings_have_the_order_of_the_channels():
    rng = np.random.default_rng(2)
    columns = {name: rng.normal(size=40) for name in (*"uvwpqr", "roll", "pitch", "yaw")}
    for values in columns.values():
        values[7] = 1e6
    with pytest.warns(OutlierWarning) as caught:
        mask_absurd(dict(reversed(columns.items())), np.arange(40.0), "")
    assert [str(each.message).split("`")[1] for each in caught] == [*columns]
