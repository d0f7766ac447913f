"""The plan of a dive: feasibility, predictions, and refusals."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.experiment_design.autopilot_design import design_autopilot
from hydrodamp.experiment_design.closed_loop import Trajectories
from hydrodamp.experiment_design.context import PlanningContext
from hydrodamp.experiment_design.ensemble import prior_damping
from hydrodamp.experiment_design.guidance import Manoeuvre
from hydrodamp.experiment_design.optimise import Optimiser
from hydrodamp.experiment_design.verification import SimulatedEstimates, enforce_envelope
from hydrodamp.simulation.damping_estimate import hull_damping
from hydrodamp.simulation.problem import vehicle_stamp

ENVELOPE = hd.Envelope(speed=(0.8, 1.6))


@pytest.mark.slow
def test_a_plan_has_a_prediction_for_every_coefficient(planned, known):
    assert [item.label for item in planned.predictions] == list(known.model.labels)
    assert all(0.0 < item.cramer_rao_bound < item.std_error for item in planned.predictions)
    for item in planned.predictions:  # nothing but values is known
        assert item.combined_std_error == pytest.approx(item.std_error, rel=1e-12)
    assert planned.predictions[0].value == -8.0
    assert "A dive of" in str(planned)


@pytest.mark.slow
def test_a_plan_is_feasible(planned):
    assert planned.feasibility_rate >= 0.95
    assert np.abs(planned.track.command("rudder")).max() <= 0.4
    assert np.abs(planned.track.position[:, :2]).max() <= 80.0
    assert set(planned.setpoints) == {"speed", "rpm", "heading"}
    assert planned.mode == "waypoints"


@pytest.mark.slow
def test_standard_errors_are_smaller_without_model_form_error(planned):
    """Predictions include the model-form error of the ensemble."""
    problem = hd.prepare(planned.vehicle, planned.track, planned.model)
    fit = hd.Recommended().identify(problem, planned.model)
    predicted = [item.std_error for item in planned.predictions]
    assert 0.05 < np.median(np.sqrt(np.diag(fit.damping.covariance)) / predicted) < 1.2


def test_the_grade_is_that_of_half_of_the_members():
    good, bad = (
        SimpleNamespace(grades={"X_u": grade}, causes={})
        for grade in (hd.Grade.DETERMINED, hd.Grade.NOT_DETERMINED)
    )
    ones = np.ones((4, 1))
    for members, expected in (((good, good, good, bad), good), ((good, bad, bad, bad), bad)):
        result = SimulatedEstimates(ones, ones[:, None], members)
        assert result.grades(["X_u"]) == [expected.grades["X_u"]]


def test_the_damping_estimated_from_a_hull_is_dissipative():
    vehicle = hd.fleet["remus100"]
    drag = hull_damping(vehicle)
    velocity = np.random.default_rng(1).normal(size=(200, 6)) * [0.3, 0.3, 0.3, 0.2, 0.2, 0.2]
    velocity[:, 0] += 1.5
    assert drag.power(velocity).max() < 0.0
    # Published: X_u|u| -1.62 (Prestero 2001, table 4.1), a factor of two.
    assert drag["X_u|u|"] == pytest.approx(-3.0, rel=0.4)
    assert "published" in prior_damping(hd.fleet["vt690"], hd.catalog["fossen"], None).source


def check_refused(match, vehicle, model, *arguments, **settings):
    with pytest.raises(hd.HydrodampError, match=match):
        hd.plan(vehicle, model, *arguments, **settings)


@pytest.mark.slow
def test_a_prior_with_standard_errors_counts(boat, known):
    errors = np.array([0.5, 3.0, np.nan, 0.4, 0.0])
    prior = replace(known, covariance=np.diag(errors**2))
    context = PlanningContext.of(boat, known.model, 60.0, prior, ENVELOPE, 0)
    assert context.prior_std_errors.tolist() == [0.5, 3.0, np.inf, 0.4, np.inf]
    ensemble = context.simulator.ensemble
    samples = np.array([damping.coefficients for damping in ensemble.dampings])
    drag, sway = (samples[:, ensemble.extended_model.index(label)] for label in ("X_u|u|", "Y_v"))
    assert np.std(drag[1:]) == pytest.approx(0.5, rel=0.4)
    assert np.abs(sway + 30.0).max() <= 2 * 0.3 * 30.0  # at most 30 %, twice


@pytest.mark.slow
def test_impossible_plans_are_refused(boat, known):
    model, settings = known.model, {"damping": known, "envelope": ENVELOPE}
    alias = model.with_terms({"X": "u^2"})
    check_refused(r"not identifiable.* X_u\^2, X_u\|u\|", boat, alias, 60.0, **settings)
    check_refused("`duration` must be from 60 s", boat, model, 5.0)
    check_refused(r"to 86400 s \(24 h\); got 10000000", boat, model, 1e7)
    check_refused("cannot be steered", hd.fleet["bluerov2"], hd.catalog["fossen"], 60.0)
    gained = hd.Damping.from_dict(None, known.as_dict() | {"X_actuation_X": 0.1})
    check_refused("has gains of the actuators' wrench", boat, model, 60.0, damping=gained)
    narrow = hd.Envelope(commands={"rpm": {"lowest": 0, "highest": 10}})
    check_refused("cannot be reached with `rpm`", boat, model, 60.0, damping=known, envelope=narrow)
    still = hd.Envelope(commands={"rpm": {"lowest": 0, "highest": 1e-3}})
    check_refused("cannot be reached with `rpm`", boat, model, 60.0, damping=known, envelope=still)
    strange = hd.Envelope(commands={"fin": {"lowest": -1, "highest": 1}})
    check_refused("`commands` has fin", boat, model, 60.0, damping=known, envelope=strange)
    foreign = replace(known, vehicle=vehicle_stamp(replace(boat, mass_matrix=2 * boat.mass_matrix)))
    check_refused("mass matrix", boat, model, 60.0, damping=foreign)
    gains = model.with_terms({"N": "u|u|*thruster"})
    check_refused("no gains of thruster", boat, gains, 60.0, damping=known)


@pytest.mark.slow
def test_an_unreachable_speed_is_refused_with_the_reachable_speed(boat, known):
    # 2e-5 rpm^2 = 8 u^2: 1.58 m/s at 1000 rpm with the nominal damping.
    def envelope(speed):
        limits = {"rpm": {"lowest": 0, "highest": 1000}}
        return hd.Envelope(speed=(0.8, speed), commands=limits)

    match = r"`speed` up to 2 m/s .*`rpm` of 1000 the vehicle reaches 1\.[56]"
    check_refused(match, boat, known.model, 60.0, damping=known, envelope=envelope(2.0))
    PlanningContext.of(boat, known.model, 60.0, known, envelope(1.4), 0)


def test_a_propeller_without_a_limit_is_assumed_to_push_a_tenth_of_the_weight(boat, known):
    autopilot = design_autopilot(boat, known, ENVELOPE)
    rpm = autopilot.full_ahead[autopilot.propeller]
    assert 2e-5 * rpm**2 == pytest.approx(0.1 * 300.0)
    assert "No limit of `rpm` is given: 1225 is assumed" in autopilot.assumptions[1]
    fast = hd.Envelope(speed=(8, 12))
    match = "cannot be reached with `rpm` from -122.* to 122.*No limit of `rpm` is given"
    check_refused(match, boat, known.model, 60.0, damping=known, envelope=fast)


@pytest.mark.slow
def test_a_fin_without_a_rate_moves_at_a_rate_that_is_stated(planned, boat, known):
    assert "No rate of `rudder` is given: 1 rad/s is assumed" in planned.assumptions[0]
    step = np.diff(planned.track.command("rudder")) / planned.envelope.period
    assert 0.0 < np.abs(step).max() <= 1.0 + 1e-9
    slow = hd.Envelope(speed=(0.8, 1.6), commands={"rudder": {"rate": 0.2}})
    autopilot = design_autopilot(boat, known, slow)
    assert autopilot.rates[0] == 0.2
    assert "rudder" not in " ".join(autopilot.assumptions)


def test_time_at_limits_is_counted(boat, known):
    autopilot = design_autopilot(boat, known, ENVELOPE)
    commands = np.zeros((100, 1, 2))
    commands[:, 0, 0] = 0.1
    commands[40:60, 0, 0] = 0.4  # at the limit, and 0.3 rad there and back in one period of 0.1 s
    result = Trajectories(commands, commands, commands, commands, 0.1)
    assert result.saturation(autopilot)["rudder"] == pytest.approx([0.21])


@pytest.mark.slow
def test_time_at_limits_costs_in_the_objective(boat, known):
    """Of two dives with the same information the one at its limits is worse, unit or not."""
    context = PlanningContext.of(boat, known.model, 60.0, known, ENVELOPE, 0)
    few = context.simulator.with_members([0, 1])
    calm, wild = (Manoeuvre("zigzag", 0.5, 0.9, (0.0, k, 0.0)) for k in (0.05, 1.0))
    settings = few, context.time_scale, context.samples, context.prior_information
    optimiser = Optimiser(*settings, np.ones(len(known.model.labels)))
    _, _, saturated = optimiser.evaluate([calm, wild])
    assert saturated["rudder"][0].max() < 0.05 < saturated["rudder"][1].min()


@pytest.mark.slow
def test_a_vehicle_that_hovers_is_planned_from_rest():
    thrusters = tuple(
        hd.Thruster(f"t{k}", (a, b, 0.0), (0.7, c, 0.0), gain=40.0, limit=1.0)
        for k, (a, b, c) in enumerate(
            [(0.2, 0.1, -0.7), (0.2, -0.1, 0.7), (-0.2, 0.1, 0.7), (-0.2, -0.1, -0.7)]
        )
    )
    mass, axes = np.diag([20.0, 25.0, 1.0]), ("X", "Y", "N")
    rov = hd.Vehicle("rov", mass, 110.0, 110.0, actuators=thrusters, axes=axes)
    known = hd.Damping.from_dict(None, {"X_u|u|": -30.0, "Y_v|v|": -50.0, "N_r|r|": -1.0})
    context = PlanningContext.of(rov, known.model, 60.0, known, hd.Envelope(speed=(0.0, 0.8)), 0)
    assert context.mode == "overlays"
    assert enforce_envelope(context, context.baseline).feasibility_rate >= 0.95
    check_refused("mode 'waypoints'", rov, known.model, 60.0, mode="waypoints")


@pytest.mark.slow
@pytest.mark.parametrize(("mode", "blames"), [("setpoints", False), ("waypoints", True)])
def test_only_waypoints_are_blamed_where_no_manoeuvre_determines_more(
    boat, known, monkeypatch, mode, blames
):
    def weak(context, *_):
        return enforce_envelope(context, [one.attenuate(0.1) for one in context.baseline])

    monkeypatch.setattr("hydrodamp.experiment_design.plan.optimise", weak)
    result = hd.plan(boat, known.model, 60.0, damping=known, envelope=ENVELOPE, mode=mode)
    assert len(result.notes) == 1
    assert ("waypoints" in result.notes[0]) == blames


@pytest.mark.slow
def test_a_vehicle_with_a_propeller_alone_is_planned_for():
    propeller = (hd.Propeller("rpm", thrust=2e-5),)
    sled = hd.Vehicle("sled", [[30.0]], 300.0, 300.0, actuators=propeller, axes=("X",))
    known = hd.Damping.from_dict(None, {"X_u|u|": -8.0})
    result = hd.plan(sled, known.model, 60.0, damping=known, envelope=ENVELOPE)
    assert (result.saturation, [*result.setpoints]) == ({}, ["speed", "rpm"])
