"""Commands that record one signal, and effects that names, geometry or clocks contradict."""

import re
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.data.log import Log
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.ingest.inspection.command_signs import contradicted_signs, leading_responses
from hydrodamp.ingest.inspection.delay import estimate_delays
from hydrodamp.ingest.inspection.equivalent_commands import (
    equivalent_commands,
    find_equivalent_commands,
)
from hydrodamp.ingest.inspection.probe import probe
from hydrodamp.ingest.inspection.quality_report import Requirements, report_quality
from hydrodamp.simulation.checks import thruster_signs
from hydrodamp.simulation.log_issues import training_issues
from strangers import name_columns
from table_rows import rows

STEP, N = 0.1, 3000
SIDES = ("left", "right")


def force_of(throttle):
    """Return the thrust [N] of a throttle with a dead zone."""
    return np.where(np.abs(throttle) < 0.06, 0.0, 30.0 * throttle * np.abs(throttle))


def boat_log(seed, names=SIDES, factors=(1.0, 1.0), offset=0, extra=None):
    """Simulate a boat of 20 kg with two thrusters; ``factors`` reverse what is recorded."""
    random = np.random.default_rng(seed)
    levels = random.uniform(-0.5, 1.0, (N // 25, 2)).repeat(25, axis=0)
    force, motion = force_of(levels), np.zeros((N, 3))
    for i in range(N - 1):
        u, v, r = motion[i]
        left, right = force[i]
        rates = (
            (left + right - 8.0 * u - 6.0 * u * abs(u)) / 22.0 + v * r,
            (-12.0 * v - 20.0 * v * abs(v)) / 30.0 - 0.7 * u * r,
            (0.3 * (left - right) - 2.0 * r - 1.5 * r * abs(r)) / 2.0,
        )
        motion[i + 1] = motion[i] + STEP * np.array(rates)
    motion += random.normal(size=motion.shape) * (0.01, 0.01, 0.005)
    forces = np.roll(force * factors, offset, axis=0)
    recorded = name_columns(" ".join(f"{name}_force" for name in names), forces)
    recorded |= {} if extra is None else extra(levels)
    velocities = dict(zip("uvr", motion.T, strict=True))
    return Log.from_arrays(STEP * np.arange(N), velocities, commands=recorded)


def pulses(levels):
    return name_columns("left_pwm right_pwm", np.round(1500.0 + 400.0 * levels))


def sign_issues(log, expected=None):
    return list(contradicted_signs(log, estimate_delays(log), expected))


def channels(issues):
    return {issue.channel for issue in issues}


@pytest.mark.slow
def test_thrusters_with_the_right_signs_contradict_nothing():
    found = [sign_issues(boat_log(seed)) for seed in range(20)]
    assert sum(map(bool, found)) <= 1


@pytest.mark.slow
@rows("change, named, remedy")
def test_thrusters_recorded_wrongly_are_named(change, named, remedy):
    found = [sign_issues(boat_log(seed, **change)) for seed in range(20)]
    assert sum(channels(issues) == {*named} for issues in found) >= 18
    assert remedy in found[0][0].remedy


@pytest.mark.parametrize(("sign", "n_issues"), [(1, 0), (-1, 2)])
def test_geometry_replaces_the_names(sign, n_issues):
    log = boat_log(3, names=("m1", "m2"))
    expected = {("m1_force", "r"): sign, ("m2_force", "r"): -sign}
    assert len(sign_issues(log, expected)) == n_issues


def test_a_channel_that_moves_another_axis_than_its_name_says_is_named():
    log = boat_log(4, names=("forward", "yaw"))
    mixed = np.column_stack([log.commands.sum(axis=1), log.commands @ (1.0, -1.0)])
    assert not sign_issues(replace(log, commands=mixed))
    named = channels(sign_issues(replace(log, commands=mixed[:, ::-1])))
    assert named == {"forward_force", "yaw_force"}


@pytest.mark.slow
def test_pulse_widths_beside_forces_are_omitted():
    groups = [equivalent_commands(boat_log(seed, extra=pulses)) for seed in range(20)]
    expected = [(f"{side}_force", (f"{side}_pwm",)) for side in SIDES]
    assert [[(each.selected, each.omitted) for each in g] for g in groups].count(expected) >= 18
    report = report_quality(boat_log(0, extra=pulses))
    assert {delay.command for delay in report.delays} == {"left_force", "right_force"}
    assert any("omit left_pwm from `commands`" in issue.remedy for issue in report.issues)


def test_no_command_that_an_actuator_takes_is_omitted():
    log = boat_log(0, extra=pulses)
    for taken in (("left_pwm",), ("left_pwm", "left_force")):
        report = report_quality(log, Requirements(("u", "v", "r"), commands=taken))
        omitted = [each.fix.value for each in report.issues if each.fix]
        assert omitted == [*(["left_force"] if len(taken) == 1 else []), "right_pwm"]
        assert {*taken} <= {delay.command for delay in report.delays}


@pytest.mark.parametrize("name", ["rpm", "left_forces", "left_force"])
def test_a_command_that_no_column_resembles_may_be_constant(name):
    needs = Requirements(("u", "v", "r"), commands=("right_force", name))
    remedies = report_quality(boat_log(0), needs).missing
    assert ["rpm: {value: VALUE}" in each for each in remedies] == [True] * (name == "rpm")


def test_gains_are_named_of_known_responses_only():
    """Wind that no delay relates to the motion explains it by chance, and the parts disagree."""
    log = boat_log(0, extra=lambda levels: {"wind": np.roll(levels @ (1.0, -1.0), -30)})
    report = report_quality(log)
    *forces, wind = report.delays
    assert (wind.command, wind.share > 0.05, wind.confidence) == ("wind", True, 0)
    assert "wind" not in report.identifiable[-1]
    assert all(force.command in report.identifiable[-1] for force in forces)


def test_a_feedback_is_preferred_to_its_demand():
    for seed in range(5):
        random = np.random.default_rng(seed)
        demand = random.choice([-0.3, 0.0, 0.3], 100).repeat(20)
        angle = np.zeros(len(demand))
        for i in range(len(demand) - 1):
            angle[i + 1] = angle[i] + 0.25 * (demand[i] - angle[i])
        angle += 0.005 * random.normal(size=len(angle))
        names = ("rudder_cmd", "rudder_feedback")
        (group,) = find_equivalent_commands(names, np.column_stack((demand, angle)))
        assert (group.omitted, group.selected) == (names[:1], names[1])


@pytest.mark.slow
def test_surfaces_that_are_driven_apart_are_different_signals():
    for seed in range(20):
        random = np.random.default_rng(seed)
        common, apart = random.uniform(-1.0, 1.0, (2, 100)).repeat(20, axis=1)
        pair = np.column_stack((common + 0.05 * apart, common - 0.05 * apart))
        assert not find_equivalent_commands(("rudder_top", "rudder_bottom"), pair)
        assert not find_equivalent_commands(("left_thruster", "right_thruster"), pair)
        same = np.column_stack((common, -common))
        assert find_equivalent_commands(("rudder_top", "rudder_bottom"), same)


@pytest.mark.slow
@pytest.mark.parametrize(("offset", "n_issues"), [(4, 1), (0, 0), (-4, 0)])
def test_a_response_before_its_command_is_a_clock_offset(offset, n_issues):
    for seed in range(3):
        log = boat_log(seed, offset=offset)
        issues = list(leading_responses(log, estimate_delays(log)))
        assert len(issues) == n_issues
        found = [re.search(r"`delay: ([0-9.]+)` to", issue.remedy)[1] for issue in issues]
        assert np.allclose(np.array(found, dtype=float), 0.4, atol=0.05)


def test_the_draft_takes_the_force_and_says_why_it_omits_the_pulse_width():
    log = boat_log(1, extra=pulses)
    fields = {"t": log.time, "u": log.velocity[:, 0], "r": log.velocity[:, 5]}
    fields |= {name: log.command(name) for name in log.command_names}
    text = probe(Recording((Topic("", None, fields),), "boat.csv", "text in columns")).draft.text
    mapped, _, omitted = text.partition("# Omitted:")
    assert ("left_force" in mapped, "left_pwm" in mapped) == (True, False)
    words = " ".join(omitted.replace("#", " ").split())
    assert "left_pwm - records the same signal as left_force" in words


@pytest.fixture
def boat():
    thrusters = [
        hd.Thruster(f"{side}_force", (0.0, y, 0.0), (1.0, 0.0, 0.0), gain=1.0)
        for side, y in zip(SIDES, (-0.3, 0.3), strict=True)
    ]
    mass = np.diag([22.0, 30.0, 22.0, 1.0, 1.0, 2.0])
    return hd.Vehicle("boat", mass, 0.0, 0.0, axes=("X", "Y", "N"), actuators=thrusters)


def test_position_and_direction_give_the_signs_of_surge_and_yaw(boat):
    turns = {"left_force": 1, "right_force": -1}
    by_side = ({(name, "u"): 1, (name, "r"): turn} for name, turn in turns.items())
    assert thruster_signs(boat) == {key: sign for each in by_side for key, sign in each.items()}


def test_a_fit_warns_of_a_thruster_against_its_geometry_and_of_two_recordings(boat):
    model = hd.catalog["linear"].with_terms({"X": "left_force left_pwm"})
    log = boat_log(2, factors=(1.0, -1.0), extra=pulses)
    messages = [*map(str, training_issues(boat, log, [model]))]
    assert any("`sign: -1` for `right_force`" in each for each in messages)
    assert any("omit left_pwm from `commands`" in each for each in messages)


@pytest.mark.slow
def test_a_log_without_delays_has_no_contradiction():
    log = hd.reenact(duration=20.0).train
    assert not [*contradicted_signs(log, (), {("port", "yaw"): 1.0})]
