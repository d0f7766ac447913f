"""The sparse model on the campaign: smaller than linear, nearer in replay, with a brake."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import identify
from hydrodamp.identification.grades import graded
from hydrodamp.identification.linear import WeakForm
from hydrodamp.identification.output_error import OutputError
from hydrodamp.identification.sparse import (
    Round,
    Sparse,
    best_round,
    brakes,
    replay_blocks,
    select_around,
)
from hydrodamp.models.catalog import find_model
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.campaign.reenact import Campaign, reenact
from hydrodamp.simulation.problem import prepare
from hydrodamp.simulation.replay import simulate
from hydrodamp.simulation.score import score
from hydrodamp.vehicle.vehicle import Vehicle

QUICK = Sparse(windows=(10.0,))


@pytest.fixture(autouse=True)
def few_pairs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hydrodamp.identification.elimination._PAIRS", 3)


@pytest.fixture(scope="module", name="campaign")
def short_campaign() -> Campaign:
    return reenact(seed=13, duration=20.0)


@pytest.fixture(name="flat")
def planar_vehicle(campaign: Campaign) -> Vehicle:
    return replace(campaign.vehicle, axes=("X", "Y", "N"))


def rms(campaign: Campaign, model: DampingModel) -> float:
    fit = identify(model, campaign.vehicle, campaign.train, OutputError(windows=(30.0,)))
    found = score(simulate(campaign.vehicle, fit.damping, campaign.test)).rms
    assert found is not None
    return found


@pytest.mark.parametrize("truth", ["sname", "crossflow"])
def test_fewer_coefficients_than_linear_and_less_error(truth: str) -> None:
    campaign = reenact(seed=12, truth=truth, duration=60.0)
    model = QUICK.select(campaign.vehicle, campaign.train)
    linear = find_model("linear")
    assert model.key == "sparse"
    assert model.n_coefficients < linear.n_coefficients
    assert rms(campaign, model) < rms(campaign, linear)
    for axis, terms in enumerate(model.terms):
        assert any(brakes(axis, term) for term in terms)


def test_a_selection_says_what_it_did_and_is_the_same_again(
    campaign: Campaign, flat: Vehicle
) -> None:
    rounds: list[Round] = []
    first = QUICK.select(flat, campaign.train, done=rounds.append)
    assert first == QUICK.select(flat, campaign.train)
    assert {label[0] for label in first.labels} == {"X", "Y", "N"}
    assert [made.model.terms for made in rounds] == [first.terms]
    assert "one standard error of the difference" in first.note
    assert "selected by hydrodamp from" in first.source


def test_commands_of_other_models_are_kept(campaign: Campaign, flat: Vehicle) -> None:
    given = DampingModel.from_table({"N": "u|u|*rudder"}, key="gain")
    model = QUICK.select(flat, campaign.train, [given])
    assert "N_u|u|*rudder" in model.labels


def test_alone_it_takes_commands_without_actuators_and_is_graded(
    campaign: Campaign, flat: Vehicle
) -> None:
    bare = replace(flat, actuators=())
    model = QUICK.select(bare, campaign.train)
    assert {"rpm", "rudder"} <= set(model.commands)
    problem = prepare(bare, campaign.train, model)
    fit = WeakForm().identify(problem, model)
    assert set(graded(problem, fit).grades) == set(model.labels)
    more = model.with_terms({"X": "1"})
    assert set(more.labels) == {*model.labels, "X_1"}


def test_too_short_a_log_is_refused(campaign: Campaign) -> None:
    with pytest.raises(MethodError, match="give a longer log"):
        QUICK.select(campaign.vehicle, campaign.train.between(0.0, 1.0))


def test_a_replay_that_always_diverges_is_refused(campaign: Campaign) -> None:
    offered = find_model("linear")
    problem = prepare(campaign.vehicle, campaign.train, offered)
    wild = Damping(offered, np.full(36, 1e4))
    blocks, lost = replay_blocks(problem, offered, wild, 10.0)
    assert len(blocks) == 0
    assert lost > 0
    with pytest.raises(MethodError, match="blocks of the log can be replayed"):
        select_around(problem, offered, wild, 10.0)


def test_an_axis_without_a_stable_brake_is_given_one(
    campaign: Campaign, flat: Vehicle, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hydrodamp.identification.sparse._MOST", 1)
    monkeypatch.setattr("hydrodamp.identification.sparse._OFTEN", 1.0)
    offered = DampingModel.from_table({"X": "u|u|", "Y": "v v|r| ur", "N": "r"}, key="sparse")
    problem = prepare(flat, campaign.train, offered)
    start = Damping(offered, np.array([-3.0, -10.0, 0.0, 0.0, -10.0]))
    made, _ = select_around(problem, offered, start, 10.0)
    assert {"X_u|u|", "N_r"} <= set(made.model.labels)
    assert {"Y_v", "Y_v|r|"} & set(made.model.labels)


@pytest.mark.parametrize("windows", [(), (-1.0,)])
def test_settings_out_of_range_are_refused(windows: tuple[float, ...]) -> None:
    with pytest.raises(MethodError, match="windows"):
        Sparse(windows)


def made(n: int, rms: float | None, push: float) -> Round:
    model = replace(find_model("prestero"), terms=(find_model("linear").terms[0][:n],) + ((),) * 5)
    return Round(model, "Said.", rms, push)


def test_among_rounds_those_that_dissipate_come_first_then_the_fewest() -> None:
    rounds = [made(3, 0.10, -1.0), made(2, 0.105, -1.0), made(1, 0.2, -1.0), made(1, 0.01, 5.0)]
    assert best_round(rounds)[0] is rounds[1]


def test_without_one_that_dissipates_the_replay_counts() -> None:
    rounds = [made(2, 0.1, 3.0), made(1, None, -1.0)]
    best, why = best_round(rounds)
    assert best is rounds[0]
    assert "replays the training data" in why
