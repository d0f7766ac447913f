"""The sparse model on the campaign: smaller than linear, nearer in replay, with a brake."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.stepwise import (
    Round,
    best_round,
    brakes,
    candidates,
    degree,
    distinct,
    drag,
    kept,
    moved,
    replay_blocks,
    select_around,
)

QUICK = hd.StepwiseSelection(windows=(10.0,))


@pytest.fixture(autouse=True)
def few_pairs(monkeypatch):
    monkeypatch.setattr("hydrodamp.identification.backward_elimination._PAIRS", 3)


@pytest.fixture(scope="module", name="campaign")
def short_campaign():
    return hd.reenact(seed=13, duration=20.0)


@pytest.fixture(name="flat")
def planar_vehicle(campaign):
    return replace(campaign.vehicle, axes=("X", "Y", "N"))


def rms(campaign, model):
    fit = hd.identify(model, campaign.vehicle, campaign.train, hd.OutputError(windows=(30.0,)))
    found = hd.score(hd.simulate(campaign.vehicle, fit.damping, campaign.test)).rms
    assert found is not None
    return found


@pytest.mark.parametrize("truth", ["sname", "crossflow"])
def test_fewer_coefficients_than_linear_and_less_error(truth):
    campaign = hd.reenact(seed=12, truth=truth, duration=60.0)
    model = QUICK.select(campaign.vehicle, campaign.train)
    linear = hd.find_model("linear")
    assert model.key == "sparse"
    assert model.n_coefficients < linear.n_coefficients
    assert rms(campaign, model) < rms(campaign, linear)
    for axis, terms in enumerate(model.terms):
        assert any(brakes(axis, term) for term in terms)


def test_a_selection_says_what_it_did_and_is_the_same_again(campaign, flat):
    rounds: list[Round] = []
    first = QUICK.select(flat, campaign.train, done=rounds.append)
    assert first == QUICK.select(flat, campaign.train)
    assert {label[0] for label in first.labels} == {"X", "Y", "N"}
    assert [made.model.terms for made in rounds] == [first.terms]
    assert "one standard error of the difference" in first.note
    assert "operating box" not in first.note
    assert "selected by hydrodamp from" in first.source


def test_commands_of_other_models_are_kept(campaign, flat):
    given = hd.DampingModel.from_table({"N": "u|u|*rudder"}, key="gain")
    model = QUICK.select(flat, campaign.train, [given])
    assert "N_u|u|*rudder" in model.labels


def test_alone_it_takes_commands_without_actuators_and_is_graded(campaign, flat):
    bare = replace(flat, actuators=())
    model = QUICK.select(bare, campaign.train)
    assert {"rpm", "rudder"} <= set(model.commands)
    problem = hd.prepare(bare, campaign.train, model)
    fit = hd.WeakForm().identify(problem, model)
    assert set(hd.grade_fit(problem, fit).grades) == set(model.labels)
    more = model.with_terms({"X": "1"})
    assert set(more.labels) == {*model.labels, "X_1"}


def test_too_short_a_log_is_refused(campaign):
    with pytest.raises(hd.MethodError, match="give a longer log"):
        QUICK.select(campaign.vehicle, campaign.train.between(0.0, 1.0))


def test_a_replay_that_always_diverges_is_refused(campaign):
    offered = hd.find_model("linear")
    problem = hd.prepare(campaign.vehicle, campaign.train, offered)
    wild = hd.Damping(offered, np.full(36, 1e4))
    blocks, lost = replay_blocks(problem, offered, wild, 10.0)
    assert len(blocks) == 0
    assert lost > 0
    with pytest.raises(hd.MethodError, match="blocks of the log can be replayed"):
        select_around(problem, offered, wild, 10.0)


def test_an_axis_without_a_stable_brake_is_given_one(campaign, flat, monkeypatch):
    monkeypatch.setattr("hydrodamp.identification.stepwise._MOST", 1)
    monkeypatch.setattr("hydrodamp.identification.stepwise._OFTEN", 1.0)
    offered = hd.DampingModel.from_table({"X": "u|u|", "Y": "v v|r| ur", "N": "r"}, key="sparse")
    problem = hd.prepare(flat, campaign.train, offered)
    start = hd.Damping(offered, np.array([-3.0, -10.0, 0.0, 0.0, -10.0]))
    made, _ = select_around(problem, offered, start, 10.0)
    assert {"X_u|u|", "N_r"} <= set(made.model.labels)
    assert {"Y_v", "Y_v|r|"} & set(made.model.labels)


@pytest.mark.parametrize("windows", [(), (-1.0,)])
def test_settings_out_of_range_are_refused(windows):
    with pytest.raises(hd.MethodError, match="windows"):
        hd.StepwiseSelection(windows)


def made(n, rms, push):
    model = replace(
        hd.find_model("prestero"), terms=(hd.find_model("linear").terms[0][:n],) + ((),) * 5
    )
    return Round(model, "Said.", rms, push)


def test_among_rounds_those_that_dissipate_come_first_then_the_fewest():
    rounds = [made(3, 0.10, -1.0), made(2, 0.105, -1.0), made(1, 0.2, -1.0), made(1, 0.01, 5.0)]
    assert best_round(rounds)[0] is rounds[1]


def test_without_one_that_dissipates_the_replay_counts():
    rounds = [made(2, 0.1, 3.0), made(1, None, -1.0)]
    best, why = best_round(rounds)
    assert best is rounds[0]
    assert "replays the training data" in why


def test_under_way_all_candidates_are_products_of_two_velocities(campaign):
    offered = candidates(campaign.vehicle, campaign.train)
    assert {degree(term) for term in offered.basis} == {2}
    assert set(hd.find_model("prestero").labels) <= set(offered.labels)
    assert "Y_ur(eta-1)" in offered.labels
    assert "Z_u^2(eta-1)" not in offered.labels  # Gertler and Hagen have it on K alone


def test_a_vehicle_that_hovers_is_offered_linear_terms(campaign):
    time = np.arange(0.0, 10.0, 0.1)
    log = hd.Log.from_arrays(time, np.sin(time)[:, None] * np.eye(6)[0])
    offered = candidates(replace(campaign.vehicle, actuators=()), log)
    assert {"X_u", "N_r"} <= set(offered.labels)
    assert not any(term.needs_propulsion for term in offered.basis)


def test_terms_are_added(campaign):
    own = hd.DampingModel.from_table({"X": "1 u^2|u|"}, key="own")
    offered = candidates(campaign.vehicle, campaign.train, [own])
    assert {"X_1", "X_u^2|u|", "Y_v|v|"} <= set(offered.labels)
    assert "Y_v" not in offered.labels
    assert [offered.labels[place] for place in np.flatnonzero(kept(offered))] == ["X_1"]


def test_of_equal_columns_the_one_that_reverses_with_the_motion_stays(campaign):
    model = hd.DampingModel.from_table({"X": "u^2 u|u|", "Y": "uv v|u| v|v|"}, key="mine")
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    assert distinct(problem, model).labels == ("X_u|u|", "Y_v|u|", "Y_v|v|")


def test_what_brakes_takes_power_at_any_velocity():
    velocity = np.random.default_rng(3).normal(size=(500, 6))
    model = hd.find_model("gertler-hagen").with_terms({"Y": "v|r| v", "Z": "w|w|"})
    ratio = np.linspace(0.5, 1.5, 500)
    values = model.basis.evaluate(velocity, propulsion_ratio=ratio)
    for axis, (places, terms) in enumerate(zip(drag(model), model.terms, strict=True)):
        named = {model.labels[place].split("_", 1)[1] for place in places}
        for term in terms:
            power = -velocity[:, axis] * values[:, model.basis.index(term)]
            assert (str(term) in named) == bool(np.all(power <= 0.0))


def test_a_command_does_not_brake():
    assert not brakes(5, hd.Term.parse("r*|rudder|"))


def test_commands_are_offered_on_the_axes_that_they_move(campaign):
    bare, log = replace(campaign.vehicle, actuators=()), campaign.train
    found = moved(bare, log, [])
    assert found is not None
    assert {"X_rpm", "Y_u|u|*rudder", "M_u|u|*elevator", "N_u|u|*rudder"} <= set(found.labels)
    assert not {"Y_elevator", "Z_rudder", "K_rpm"} & set(found.labels)
    given = hd.DampingModel.from_table({"Y N": "u|u|*rudder", "X": "rpm"}, key="own")
    rest = moved(bare, log, [given])
    assert rest is not None
    assert rest.commands == ("elevator",)


def test_commands_that_something_takes_are_not_offered(campaign):
    assert moved(campaign.vehicle, campaign.train, []) is None
    recorded = replace(campaign.train, wrench=np.zeros((campaign.train.n, 6)))
    assert moved(replace(campaign.vehicle, actuators=()), recorded, []) is None
