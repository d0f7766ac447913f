"""Curves of thrusters and fins of a simulated boat, estimated from their priors."""

import re
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError, ProblemError
from hydrodamp.identification.command_curves import driving_commands
from hydrodamp.identification.grades import critical_value
from hydrodamp.simulation.replay import replay
from hydrodamp.vehicle.file import write_vehicle

MODEL = hd.DampingModel.from_table(
    {"X": "u u|u| m1 m2", "Y": "v v|v| r", "N": "r r|r| v m1 m2"}, key="boat"
)
VALUES = {"X_u": -6, "X_u|u|": -8, "X_m1": 20, "X_m2": 20, "Y_v": -30, "Y_v|v|": -20,
          "Y_r": 2, "N_r": -4, "N_r|r|": -4, "N_v": 1, "N_m1": 5, "N_m2": -5}  # fmt: skip
TRUTH = (
    hd.Curve("m1", reference=1.0, reverse_ratio=0.77, exponent=1.6, dead_band=0.07),
    hd.Curve("m2", reference=1.0, reverse_ratio=0.9, exponent=1.3, dead_band=0.04),
)


def boat(*actuators):
    """Return a boat of three degrees of freedom."""
    mass = np.array([[20.0, 0.0, 0.0], [0.0, 30.0, 1.0], [0.0, 1.0, 5.0]])
    return hd.Vehicle("boat", mass, 100.0, 100.0, axes=("X", "Y", "N"), actuators=actuators)


def record(vehicle, model, values, ranges, n=1000, seed=0):
    """Return a noisy replay with random steps of commands within ranges."""
    random, (low, high) = np.random.default_rng(seed), np.transpose([*ranges.values()])
    log = hd.Log(
        time=0.1 * np.arange(n),
        velocity=np.tile([0.5, 0, 0, 0, 0, 0], (n, 1)),
        commands=np.repeat(random.uniform(low, high, size=(n // 25, len(ranges))), 25, axis=0),
        command_names=tuple(ranges),
    )
    damping = hd.Damping.from_dict(model, values)
    velocity = replay(hd.prepare(vehicle, log, model), damping).velocity
    noise = random.standard_normal(velocity.shape) * [0.01, 0.01, 0, 0, 0, 0.01]
    return replace(log, velocity=velocity + noise)


def identify(vehicle, log, model, *names):
    """Return the fit of output error that estimates groups of parameters."""
    return hd.OutputError(estimate=names).identify(hd.prepare(vehicle, log, model), model)


def assert_recovered(fit, truth):
    """Check that all parameters are determined, with the truth in their intervals."""
    assert fit.estimates.keys() == truth.keys()
    for label, each in fit.estimates.items():
        assert each.is_determined, (label, each)
        assert abs(each.value - truth[label]) <= critical_value() * each.standard_error, label


COMMANDS = {"m1": (-1.0, 1.0), "m2": (-1.0, 1.0)}


@pytest.mark.slow
def test_curves_of_thrusters_with_unknown_gain_are_recovered(tmp_path):
    log = record(boat(*TRUTH), MODEL, VALUES, COMMANDS)
    fit = identify(boat(), log, MODEL, "thrust-curve")
    names = {"reverse": "reverse_ratio", "exponent": "exponent", "dead_band": "dead_band"}
    truth = {f"{k}_{each.command}": getattr(each, v) for each in TRUTH for k, v in names.items()}
    assert_recovered(fit, truth)
    assert any("exponent of `m1`: 1.6" in remark for remark in fit.remarks)
    write_vehicle(fit.vehicle, tmp_path / "boat.yaml")
    read = hd.read_vehicle(tmp_path / "boat.yaml")
    assert read.actuators == fit.vehicle.actuators
    test = record(boat(*TRUTH), MODEL, VALUES, COMMANDS, seed=1)
    straight = identify(boat(), log, MODEL)
    (sentence,) = (each for each in straight.remarks if "The log suggests" in each)
    ratio = re.search(r"reverse over forward thrust of `m1` is ([\d.]+) \(\d+ standard", sentence)
    assert ratio is not None
    assert float(ratio[1]) == pytest.approx(0.77, abs=0.05)
    assert "exponent of `m1` is 1." in sentence
    assert not any("The log suggests" in each for each in fit.remarks)
    errors = [
        hd.score(hd.simulate(vehicle, each.damping, test)).rms
        for vehicle, each in ((read, fit), (boat(), straight))
    ]
    assert errors[0] < 0.2 * errors[1]


@pytest.mark.slow
def test_the_exponent_of_the_voltage_is_recovered():
    true = replace(TRUTH[0], voltage="battery", reference_voltage=14.0, voltage_exponent=1.3)
    ranges = COMMANDS | {"battery": (10.0, 17.0)}
    log = record(boat(true), MODEL, VALUES, ranges)
    fit = identify(boat(replace(true, voltage_exponent=1.0)), log, MODEL, "thrust-curve")
    assert fit.estimates["voltage_m1"].is_determined
    assert fit.estimates["voltage_m1"].value == pytest.approx(1.3, abs=0.05)
    bare = replace(log, commands=log.commands[:, :2], command_names=("m1", "m2"))
    with pytest.raises(ProblemError, match="no command 'battery', which an actuator"):
        hd.prepare(boat(true), bare, MODEL)


@pytest.mark.slow
def test_gain_and_stall_angle_of_a_fin_are_recovered():
    model = hd.DampingModel.from_table({"X": "u|u| m1", "Y": "v v|v| r", "N": "r v"}, key="ship")
    values = {"X_u|u|": -8, "X_m1": 20, "Y_v": -30, "Y_v|v|": -20, "Y_r": 2, "N_r": -4, "N_v": 1}
    fin = hd.Fin("rudder", {"Y": 5.0, "N": -4.0}, {"X": -2.0})
    true = replace(fin, force={"Y": 3.6, "N": -2.88}, drag={"X": -1.44})
    stall = hd.Curve("rudder", reference=0.6, limit=0.28)
    log = record(boat(true, stall), model, values, {"m1": (0.5, 1.0), "rudder": (-0.6, 0.6)})
    fit = identify(boat(fin), log, model, "fin-curve")
    assert_recovered(fit, {"gain_rudder": 0.72, "stall_rudder": 0.28})


def test_commands_that_act_with_a_velocity_alone_are_fins():
    model = hd.DampingModel.from_table(
        {"X": "rpm*|rpm| u*|rpm| u|u|*rudder^2", "N": "u|u|*rudder rpm*rudder"}, key="ship"
    )
    ranges = {"rpm": (-1.0, 1.0), "rudder": (-0.5, 0.5), "port": (0.0, 1.0), "table": (0.0, 1.0)}
    port = hd.Thruster("port", (0, -1, 0), (1, 0, 0), gain=1.0)
    table = hd.Thruster("table", (0, -1, 0), (1, 0, 0), curve=((0, 0), (1, 1)))
    values = dict(zip(model.labels, (1, 0, -9, 0.1, 0), strict=True))
    log = record(boat(), model, values, ranges, n=50)
    problem = hd.prepare(boat(port, table), log, model)
    assert driving_commands(problem, model) == (["rpm", "port"], ["rudder"])


@pytest.mark.slow
def test_a_log_of_straight_curves_suggests_none():
    log = record(boat(), MODEL, VALUES, COMMANDS, seed=3)
    remarks = identify(boat(), log, MODEL).remarks
    assert not any("The log suggests" in each for each in remarks)


@pytest.mark.parametrize(("group", "term"), [("thrust-curve", "u|u|*m1"), ("fin-curve", "m1")])
def test_a_group_without_a_command_is_refused(group, term):
    model = hd.DampingModel.from_table({"X": "u", "Y": "v", "N": f"r {term}"}, key="other")
    log = record(boat(), MODEL, VALUES, COMMANDS, n=100)
    with pytest.raises(MethodError, match=f"`{group}` needs a command that varies"):
        identify(boat(), log, model, group)
