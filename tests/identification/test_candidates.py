"""Candidates: what may be chosen, what is one and the same, what brakes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hydrodamp.basis.term import Term
from hydrodamp.data.log import Log
from hydrodamp.identification.sparse import (
    brakes,
    candidates,
    degree,
    distinct,
    drag,
    kept,
    moved,
    under_way,
)
from hydrodamp.models.catalog import find_model
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.campaign.reenact import Campaign, reenact
from hydrodamp.simulation.problem import prepare


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    return reenact(duration=20.0)


def test_under_way_all_candidates_are_products_of_two_velocities(campaign: Campaign) -> None:
    offered = candidates(campaign.vehicle, campaign.train)
    assert {degree(term) for term in offered.basis} == {2}
    assert set(find_model("prestero").labels) <= set(offered.labels)
    assert "Y_ur(eta-1)" in offered.labels
    assert "Z_u^2(eta-1)" not in offered.labels  # Gertler and Hagen have it on K alone


def test_a_vehicle_that_hovers_is_offered_linear_terms(campaign: Campaign) -> None:
    time = np.arange(0.0, 10.0, 0.1)
    log = Log.from_arrays(time, np.sin(time)[:, None] * np.eye(6)[0])
    offered = candidates(replace(campaign.vehicle, actuators=()), log)
    assert {"X_u", "N_r"} <= set(offered.labels)
    assert not any(term.needs_propulsion for term in offered.basis)


def test_terms_are_added(campaign: Campaign) -> None:
    own = DampingModel.from_table({"X": "1 u^2|u|"}, key="own")
    offered = candidates(campaign.vehicle, campaign.train, [own])
    assert {"X_1", "X_u^2|u|", "Y_v|v|"} <= set(offered.labels)
    assert "Y_v" not in offered.labels
    assert [offered.labels[place] for place in np.flatnonzero(kept(offered))] == ["X_1"]


def test_of_equal_columns_the_one_that_reverses_with_the_motion_stays(
    campaign: Campaign,
) -> None:
    model = DampingModel.from_table({"X": "u^2 u|u|", "Y": "uv v|u| v|v|"}, key="mine")
    problem = prepare(campaign.vehicle, campaign.train, model)
    assert distinct(problem, model).labels == ("X_u|u|", "Y_v|u|", "Y_v|v|")


def test_columns_of_zeros_go(campaign: Campaign) -> None:
    time = np.arange(0.0, 10.0, 0.1)
    log = Log.from_arrays(
        time,
        np.sin(time)[:, None] * np.eye(6)[0],
        attitude=np.zeros((len(time), 3)),
        commands={"idle": np.zeros(len(time))},
    )
    model = DampingModel.from_table({"X": "u", "Y": "v", "N": "idle"}, key="mine")
    problem = prepare(replace(campaign.vehicle, actuators=()), log, model)
    assert distinct(problem, model).labels == ("X_u",)


def test_what_brakes_takes_power_at_any_velocity() -> None:
    velocity = np.random.default_rng(3).normal(size=(500, 6))
    model = find_model("gertler-hagen").with_terms({"Y": "v|r| v", "Z": "w|w|"})
    ratio = np.linspace(0.5, 1.5, 500)
    values = model.basis.evaluate(velocity, propulsion_ratio=ratio)
    for axis, (places, terms) in enumerate(zip(drag(model), model.terms, strict=True)):
        named = {model.labels[place].split("_", 1)[1] for place in places}
        for term in terms:
            power = -velocity[:, axis] * values[:, model.basis.index(term)]
            assert (str(term) in named) == bool(np.all(power <= 0.0))


def test_a_command_does_not_brake() -> None:
    assert not brakes(5, Term.parse("r*|rudder|"))


def test_commands_are_offered_on_the_axes_that_they_move(campaign: Campaign) -> None:
    bare, log = replace(campaign.vehicle, actuators=()), campaign.train
    found = moved(bare, log, [])
    assert found is not None
    assert {"X_rpm", "Y_u|u|*rudder", "M_u|u|*elevator", "N_u|u|*rudder"} <= set(found.labels)
    assert not {"Y_elevator", "Z_rudder", "K_rpm"} & set(found.labels)
    given = DampingModel.from_table({"Y N": "u|u|*rudder", "X": "rpm"}, key="own")
    rest = moved(bare, log, [given])
    assert rest is not None
    assert rest.commands == ("elevator",)


def test_commands_that_something_takes_are_not_offered(campaign: Campaign) -> None:
    assert moved(campaign.vehicle, campaign.train, []) is None
    recorded = replace(campaign.train, wrench=np.zeros((campaign.train.n, 6)))
    assert moved(replace(campaign.vehicle, actuators=()), recorded, []) is None


@pytest.mark.parametrize(
    ("surge", "expected"), [((1.0, 2.0), True), ((-2.0, -1.0), True), ((-1.0, 1.0), False)]
)
def test_under_way_is_surge_of_one_sign(surge: tuple[float, float], expected: bool) -> None:
    velocity = np.zeros((100, 6))
    velocity[:, 0] = np.linspace(*surge, 100)
    assert under_way(velocity) is expected
