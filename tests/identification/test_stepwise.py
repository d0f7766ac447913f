"""Stepwise selection on the campaign: smaller than linear, more accurate, with drag."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.identification.general_model import remove_duplicates
from hydrodamp.identification.identifiability import grade_fit
from hydrodamp.identification.stepwise import (
    Round,
    best_round,
    block_normal_matrices,
    candidate_model,
    drag_indices,
    is_drag,
    is_retained,
    select_command_terms,
    select_round,
    velocity_degree,
)

QUICK = hd.StepwiseSelection(windows=(4.0,))


@pytest.fixture(autouse=True)
def few_half_samples(monkeypatch):
    monkeypatch.setattr("hydrodamp.identification.backward_elimination._N_PAIRS", 3)


@pytest.fixture(name="flat")
def planar_vehicle(campaign):
    return replace(campaign.vehicle, axes=("X", "Y", "N"))


def rms(campaign, model):
    fit = hd.identify(model, campaign.vehicle, campaign.train, hd.OutputError(windows=(30.0,)))
    error = hd.score(hd.simulate(campaign.vehicle, fit.damping, campaign.test)).rms
    assert error is not None
    return error


@pytest.mark.slow
@pytest.mark.parametrize("truth", ["sname", "crossflow"])
def test_fewer_coefficients_than_linear_and_less_error(truth):
    campaign = hd.reenact(seed=12, truth=truth, duration=60.0)
    model = QUICK.select(campaign.vehicle, campaign.train)
    linear = hd.find_model("linear")
    assert model.key == "sparse"
    assert model.n_coefficients < linear.n_coefficients
    assert rms(campaign, model) < rms(campaign, linear)
    for axis, terms in enumerate(model.terms):
        assert any(is_drag(axis, term) for term in terms)


@pytest.mark.slow
def test_a_selection_is_deterministic_and_documents_itself(campaign, flat):
    rounds: list[Round] = []
    first = QUICK.select(flat, campaign.train, done=rounds.append)
    assert first == QUICK.select(flat, campaign.train)
    assert {label[0] for label in first.labels} == {"X", "Y", "N"}
    assert [each.model.terms for each in rounds] == [first.terms]
    assert "one standard error of the difference" in first.note
    assert "operating box" not in first.note
    assert "selected by hydrodamp from" in first.source


@pytest.mark.slow
def test_commands_of_other_models_are_retained(campaign, flat):
    gain = hd.DampingModel.from_table({"N": "u|u|*rudder"}, key="gain")
    model = QUICK.select(flat, campaign.train, [gain])
    assert "N_u|u|*rudder" in model.labels


@pytest.mark.slow
def test_commands_without_actuators_are_selected_and_the_fit_is_graded(campaign, flat):
    bare = replace(flat, actuators=())
    model = QUICK.select(bare, campaign.train)
    assert {"rpm", "rudder"} <= set(model.commands)
    problem = hd.prepare(bare, campaign.train, model)
    fit = hd.WeakForm().identify(problem, model)
    assert set(grade_fit(problem, fit).grades) == set(model.labels)
    more = model.with_terms({"X": "1"})
    assert set(more.labels) == {*model.labels, "X_1"}


def test_too_short_a_log_is_refused(campaign):
    with pytest.raises(MethodError, match="give a longer log"):
        QUICK.select(campaign.vehicle, campaign.train.between(0.0, 1.0))


def test_a_selection_of_diverged_blocks_is_refused(campaign):
    candidates = hd.find_model("linear")
    problem = hd.prepare(campaign.vehicle, campaign.train, candidates)
    unstable = hd.Damping(candidates, np.full(36, 1e4))
    blocks, n_diverged = block_normal_matrices(problem, candidates, unstable, 10.0)
    assert len(blocks) == 0
    assert n_diverged > 0
    with pytest.raises(MethodError, match="blocks of the log can be replayed"):
        select_round(problem, candidates, unstable, 10.0)


def test_every_axis_has_a_drag_term(campaign, flat, monkeypatch):
    monkeypatch.setattr("hydrodamp.identification.stepwise._MAX_FORWARD_TERMS", 1)
    monkeypatch.setattr("hydrodamp.identification.stepwise._MIN_SELECTION_FREQUENCY", 1.0)
    candidates = hd.DampingModel.from_table({"X": "u|u|", "Y": "v v|r| ur", "N": "r"}, key="sparse")
    problem = hd.prepare(flat, campaign.train, candidates)
    start = hd.Damping(candidates, np.array([-3.0, -10.0, 0.0, 0.0, -10.0]))
    result, _ = select_round(problem, candidates, start, 10.0)
    assert {"X_u|u|", "N_r"} <= set(result.model.labels)
    assert {"Y_v", "Y_v|r|"} & set(result.model.labels)


def round_of(n, error, max_power):
    model = hd.DampingModel.from_table({"X": " ".join("uvwpqr"[:n])}, key="sparse")
    return Round(model, "Summary.", error, max_power)


def test_best_round_is_dissipative_then_accurate_then_small():
    sizes = [(3, 0.10, -1.0), (2, 0.105, -1.0), (1, 0.2, -1.0), (1, 0.01, 5.0)]
    rounds = [round_of(*each) for each in sizes]
    assert best_round(rounds)[0] is rounds[1]


def test_best_round_without_a_dissipative_model_is_the_most_accurate():
    rounds = [round_of(2, 0.1, 3.0), round_of(1, None, -1.0)]
    best, reason = best_round(rounds)
    assert best is rounds[0]
    assert "can be replayed" in reason


def test_under_way_all_candidates_are_products_of_two_velocities(campaign):
    candidates = candidate_model(campaign.vehicle, campaign.train)
    assert {velocity_degree(term) for term in candidates.basis} == {2}
    assert set(hd.find_model("prestero").labels) <= set(candidates.labels)
    assert "Y_ur(eta-1)" in candidates.labels
    assert "Z_u^2(eta-1)" not in candidates.labels  # Gertler and Hagen have it on K alone


def test_a_vehicle_that_hovers_is_candidates_linear_terms(campaign):
    time = np.arange(0.0, 10.0, 0.1)
    log = hd.Log.from_arrays(time, np.sin(time)[:, None] * np.eye(6)[0])
    candidates = candidate_model(replace(campaign.vehicle, actuators=()), log)
    assert {"X_u", "N_r"} <= set(candidates.labels)
    assert not any(term.needs_propulsion for term in candidates.basis)


def test_terms_of_other_models_are_candidates(campaign):
    model = hd.DampingModel.from_table({"X": "1 u^2|u|"}, key="own")
    candidates = candidate_model(campaign.vehicle, campaign.train, [model])
    assert {"X_1", "X_u^2|u|", "Y_v|v|"} <= set(candidates.labels)
    assert "Y_v" not in candidates.labels
    assert np.array(candidates.labels)[is_retained(candidates)].tolist() == ["X_1"]


def test_of_duplicate_columns_the_odd_function_of_velocity_remains(campaign):
    model = hd.DampingModel.from_table({"X": "u^2 u|u|", "Y": "uv v|u| v|v|"}, key="mine")
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    assert remove_duplicates(problem, model).labels == ("X_u|u|", "Y_v|u|", "Y_v|v|")


def test_drag_terms_are_dissipative_at_any_velocity():
    velocity = np.random.default_rng(3).normal(size=(500, 6))
    model = hd.find_model("gertler-hagen").with_terms({"Y": "v|r| v", "Z": "w|w|"})
    values = model.basis.evaluate(velocity, propulsion_ratio=np.linspace(0.5, 1.5, 500))
    for axis, (indices, terms) in enumerate(zip(drag_indices(model), model.terms, strict=True)):
        named = {model.labels[index].split("_", 1)[1] for index in indices}
        for term in terms:
            power = -velocity[:, axis] * values[:, model.basis.index(term)]
            assert (str(term) in named) == bool(np.all(power <= 0.0))


def test_a_term_with_a_command_is_no_drag():
    assert not is_drag(5, hd.Term.parse("r*|rudder|"))


def test_command_terms_are_selected_on_the_axes_that_they_affect(campaign):
    bare, log = replace(campaign.vehicle, actuators=()), campaign.train
    selected = select_command_terms(bare, log, [])
    assert selected is not None
    assert {"X_rpm", "Y_u|u|*rudder", "M_u|u|*elevator", "N_u|u|*rudder"} <= set(selected.labels)
    assert not {"Y_elevator", "Z_rudder", "K_rpm"} & set(selected.labels)
    gains = hd.DampingModel.from_table({"Y N": "u|u|*rudder", "X": "rpm"}, key="own")
    remaining = select_command_terms(bare, log, [gains])
    assert remaining is not None
    assert remaining.commands == ("elevator",)


def test_commands_that_actuators_use_are_not_selected(campaign):
    assert select_command_terms(campaign.vehicle, campaign.train, []) is None
    recorded = replace(campaign.train, wrench=np.zeros((campaign.train.n, 6)))
    assert select_command_terms(replace(campaign.vehicle, actuators=()), recorded, []) is None
