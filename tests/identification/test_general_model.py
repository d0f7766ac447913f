"""General model: it replays well where mass and gains are guesses, and holds what it says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.general_model import add_inputs
from value_changes import set_values


@pytest.fixture(scope="module", name="bare")
def vehicle_without_actuators(campaign):
    return replace(campaign.vehicle, actuators=())


def test_every_command_has_a_gain_on_every_axis(campaign, bare):
    labels = set(hd.general_model(bare, campaign.train).labels)
    commands = campaign.train.command_names
    assert {f"{axis}_{name}" for axis in "XYZKMN" for name in commands} <= labels
    assert f"Y_u^2*{commands[0]}" in labels  # surge keeps its sign


def test_a_command_of_an_actuator_has_no_other_gain(campaign):
    assert not hd.general_model(campaign.vehicle, campaign.train).commands


def test_a_wrench_has_a_gain_by_axis_and_commands_have_none(campaign, bare):
    wrench = np.random.default_rng(0).normal(size=(campaign.train.n, 6)) * [1, 0, 1, 0, 1, 1]
    model = hd.general_model(bare, replace(campaign.train, wrench=wrench))
    gains = {label for label in model.labels if "actuation" in label and "rise" not in label}
    assert gains == {"X_actuation_X", "Z_actuation_Z", "M_actuation_M", "N_actuation_N"}
    assert all("actuation" in name for name in model.commands)


def test_a_command_that_only_changes_its_sign_or_not_at_all_leaves_the_drag(campaign, bare):
    log = campaign.train
    rudder, rpm = map(log.command_names.index, ("rudder", "rpm"))
    signs = np.where(log.velocity[:, 5] > 0.0, 0.1, -0.1)
    held = set_values(log, "commands", (np.s_[:, rudder], signs), (np.s_[:, rpm], 1500.0))
    labels = hd.general_model(bare, held).labels
    assert "X_u|u|" in labels
    assert not any("rpm" in label for label in labels)


def test_terms_of_locked_axes_are_absent(campaign, bare):
    flat = replace(bare, axes=("X", "Y", "N"))
    labels = hd.general_model(flat, campaign.train.select(campaign.train.segments[0].name)).labels
    assert {label[0] for label in labels} == {"X", "Y", "N"}
    assert not any("down" in label or "w" in label for label in labels)


def test_inputs_are_added_to_a_model_of_damping(campaign, bare):
    linear = hd.catalog["linear"]
    model = add_inputs(linear, bare, campaign.train)
    assert model.key == "linear+inputs"
    assert {*linear.labels, "K_down_y", "N_1"} < set(model.labels)


@pytest.mark.slow
def test_a_vehicle_of_twice_the_mass_has_twice_the_coefficients(campaign, bare):
    heavy = replace(bare, mass_matrix=2.0 * bare.mass_matrix, added_mass=2.0 * bare.added_mass)
    light, twice = (
        hd.identify(hd.general_model(bare, campaign.train), vehicle, campaign.train, hd.WeakForm())
        for vehicle in (bare, heavy)
    )
    for label in light.model.labels:
        if "down" not in label:  # the weight is the same
            expected = 2.0 * light.damping[label]
            assert twice.damping[label] == pytest.approx(expected, rel=1e-4, abs=1e-6)


@pytest.mark.slow
def test_a_wrong_added_mass_costs_less_than_with_drag_alone(campaign, bare):
    added = bare.added_mass
    wrong = replace(bare, mass_matrix=bare.mass_matrix + 0.5 * added, added_mass=1.5 * added)
    drag = add_inputs(hd.catalog["fossen"], wrong, campaign.train)
    fits = []
    for model in (hd.general_model(wrong, campaign.train), drag):
        fit = hd.identify(model, wrong, campaign.train, hd.OutputError())
        fits.append(hd.score(hd.simulate(wrong, fit.damping, campaign.test)).fit_by_axis)
    for name in "vwqr":
        assert fits[0][name] > fits[1][name]
