"""Manoeuvres of a ship: closed forms, symmetry, similitude, limits, and models that diverge."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import hydrodamp as hd
from hydrodamp.errors import HydrodampError
from hydrodamp.experiment_design import ship_manoeuvres
from hydrodamp.experiment_design.ship_manoeuvres import evaluate_ship, imo_limits
from hydrodamp.report.manoeuvre_report import describe_conditions, describe_verdict
from hydrodamp.simulation.checks import estimate_length
from hydrodamp.simulation.problem import vehicle_stamp
from hydrodamp.vehicle.file import parse_vehicle
from hydrodamp.vehicle.template import vehicle_template
from similitude import coefficient_scales, scale_vehicle

#: Nomoto's ship: T r' + r = K delta, without sway; K and T by coefficients of yaw and rudder.
GAIN, LAG, ANGLE = 0.2, 4.0, np.radians(10.0)
SHIP = hd.Vehicle("ship", np.diag([1e3, 1e3, 1e3]), 0.0, 0.0, axes=("X", "Y", "N"))
NOMOTO = {  # X_vr is against the Coriolis force m v r, Y_ur against m u r
    "X_u|u|": -10.0, "X_rps": 1.0, "X_vr": -1e3, "Y_ur": 1e3, "Y_v": -1e3,
    "N_r": -1e3 / LAG, "N_rudder": 1e3 * GAIN / LAG,
}  # fmt: skip


def numbers(result):
    return {(each.manoeuvre, each.side, each.name): each for each in result.characteristics}


def evaluate(coefficients, **settings):
    settings = {"speed": 2.0, "length": 4.0, "rudder_rate": 100.0} | settings
    damping = hd.Damping.from_dict(None, coefficients)
    return evaluate_ship(settings.pop("vehicle", SHIP), damping, **settings)


@pytest.fixture(scope="module")
def nomoto():
    return evaluate(NOMOTO)


@pytest.mark.slow
def test_the_turning_circle_is_that_of_nomoto(nomoto):
    values = {key[1:]: each.value for key, each in numbers(nomoto).items()}
    rate = GAIN * np.radians(35.0)
    assert values["starboard", "steady yaw rate"] == pytest.approx(np.degrees(rate), rel=1e-3)
    assert values["starboard", "steady speed"] == pytest.approx(2.0)
    assert values["starboard", "final diameter"] == pytest.approx(2.0 * 2.0 / rate / 4.0, rel=1e-3)

    def motion(t, x):
        return [(rate - x[0]) / LAG, x[0], 2 * np.cos(x[1]), 2 * np.sin(x[1])]

    headings = [lambda t, x: x[1] - np.pi / 2.0, lambda t, x: x[1] - np.pi]
    end = solve_ivp(motion, (0.0, 1e2), np.zeros(4), events=headings, rtol=1e-10).y_events
    for name, k, axis in (("advance", 0, 2), ("transfer", 0, 3), ("tactical diameter", 1, 3)):
        assert values["starboard", name] == pytest.approx(end[k][0, axis] / 4.0, rel=2e-3)


@pytest.mark.slow
def test_the_zigzag_is_that_of_nomoto(nomoto):
    heading, rate, overshoots = 0.0, 0.0, []
    for sign in (1.0, -1.0, 1.0):

        def motion(t, x, steady=sign * GAIN * ANGLE):
            return [(steady - x[0]) / LAG, x[0]]

        ends = [lambda t, x, s=sign: x[1] - s * ANGLE if t > 0.1 else -s, lambda t, x: x[0]]
        end = solve_ivp(motion, (0.0, 5e2), [rate, heading], events=ends, rtol=1e-10).y_events
        if sign * rate < 0.0:
            overshoots.append(np.degrees(np.abs(end[1][0, 1]) - ANGLE))
        rate, heading = end[0][-1]
    for name, angle in zip(("first overshoot", "second overshoot"), overshoots, strict=True):
        value = numbers(nomoto)["zigzag 10/10", "starboard", name].value
        assert value == pytest.approx(angle, abs=0.05)


@pytest.mark.slow
def test_stopping_is_that_of_a_constant_thrust_astern(nomoto):
    # m u' = -T - k u^2 with T = k U^2: the track is m ln(2) / 2k.
    reach = numbers(nomoto)["stopping", "", "track reach"]
    assert reach.value == pytest.approx(1e3 * np.log(2.0) / 20.0 / 4.0, rel=1e-4)
    assert (reach.limit, reach.band, nomoto.probability) == (15.0, None, None)


@pytest.mark.slow
def test_both_sides_of_a_symmetric_ship_are_equal_whatever_the_sign_of_the_rudder(nomoto):
    opposite = numbers(evaluate(NOMOTO | {"N_rudder": -NOMOTO["N_rudder"]}))
    for (manoeuvre, side, name), each in numbers(nomoto).items():
        other = {"starboard": "port", "port": "starboard", "": ""}[side]
        for end in (other, side):
            assert opposite[manoeuvre, end, name].value == pytest.approx(each.value, abs=1e-9)


FORM = {  # with hull lift and cross-flow drag
    "X_u|u|": -10.0, "X_rps": 1.0, "Y_uv": -300.0, "N_uv": -400.0, "N_ur": -1200.0,
    "N_r|r|": -3e3, "Y_u^2*rudder": -60.0, "N_u^2*rudder": 120.0,
}  # fmt: skip


@pytest.mark.slow
def test_ratios_to_the_length_are_those_of_a_larger_ship():
    damping = hd.Damping.from_dict(None, FORM)
    scales = coefficient_scales(damping.model, 25.0)
    larger = replace(damping, coefficients=damping.coefficients * scales)
    small = evaluate_ship(SHIP, damping, 2.0, length=4.0)
    large = evaluate_ship(scale_vehicle(SHIP, 25.0), larger, 10.0, length=100.0)
    for first, second in zip(small.characteristics, large.characteristics, strict=True):
        if first.unit in ("L", "deg"):
            assert second.value == pytest.approx(first.value, rel=1e-6, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("lever", "is_unstable"), [(-100.0, False), (-400.0, True)])
def test_only_an_unstable_ship_has_a_loop(lever, is_unstable):
    width = numbers(evaluate(FORM | {"N_uv": lever}))["spiral", "", "loop width"].value
    assert width > 0.5 if is_unstable else width == 0.0


def draw_rudders(monkeypatch, spread, neutral=0.0):
    """Return the numbers of draws of the rudder's coefficient alone, and the result."""
    monkeypatch.setattr(ship_manoeuvres, "N_DRAWS", 20)
    gain, known = NOMOTO["N_rudder"], {"r": (-0.01, 0.01)}
    damping = hd.Damping.from_dict(None, NOMOTO | {"N_1": -neutral * gain})
    is_rudder = np.array([label == "N_rudder" for label in damping.model.labels])
    damping = replace(damping, covariance=np.diag(is_rudder * (spread * gain) ** 2))
    fit = hd.Fit(damping, "ls", hd.Status.OK, training_range=known, vehicle=SHIP)
    result = evaluate_ship(SHIP, damping, 2.0, fit=fit, length=4.0, rudder_rate=100.0)
    return numbers(result), result


@pytest.mark.slow
def test_velocities_beyond_the_log_are_those_of_both_sides_and_of_the_draws(monkeypatch):
    values, result = draw_rudders(monkeypatch, 0.02, neutral=0.1)
    rates = np.radians(values["turning circle", "port", "steady yaw rate"].draws)
    assert rates[0] == pytest.approx(GAIN * (np.radians(35.0) + 0.1), rel=1e-3)
    assert result.extrapolation["turning circle"]["r"][:2] == pytest.approx(
        (0.01, rates[0]), rel=1e-3
    )
    drawn = result.drawn_extrapolation["turning circle"]["r"]
    assert drawn == pytest.approx((0.01, np.quantile(rates[1:], 0.95)), rel=1e-3)


@pytest.mark.slow
def test_the_draws_follow_the_covariance(monkeypatch):
    values, result = draw_rudders(monkeypatch, 0.02)
    rate = values["turning circle", "port", "steady yaw rate"]
    assert np.std(rate.draws[1:]) == pytest.approx(0.02 * rate.value, rel=0.4)
    assert rate.band[0] < rate.value < rate.band[1]
    assert rate.completed_share == 1.0
    assert result.probability in (0.0, 1.0)


def test_an_estimate_may_be_outside_the_band_of_the_draws_that_succeed():
    way = ship_manoeuvres.Characteristic("stopping", "", "way", "L", np.array([0.0, 1, 2, np.nan]))
    assert (way.is_outside, way.completed_share) == (True, 2 / 3)


@pytest.mark.slow
def test_a_draw_that_turns_to_the_other_side_has_no_overshoot(monkeypatch):
    values, _ = draw_rudders(monkeypatch, 1.5)
    turning, first, second = list(values.values())[15:18]  # of the zigzag 10/10 to port
    assert 0.0 < turning.completed_share < 1.0
    for each in (first, second):
        assert not np.any(np.isfinite(each.draws) & np.isnan(turning.draws))
        assert np.nanmin(each.draws) >= 0.0


@pytest.mark.parametrize("length", [3.0, 7.0, 161.0])
def test_the_length_is_that_of_a_hull_without_its_added_mass(length):
    sizes = {"length": length, "beam": length / 6.0, "draft": length / 15.0}
    text = vehicle_template("tanker", None, "ship", block_coefficient=0.8, **sizes)
    assert estimate_length(parse_vehicle(text)) == pytest.approx(length, rel=0.01)


def test_limits_are_those_of_the_resolution():
    for ratio, first, second in ((5.0, 10.0, 25.0), (20.0, 15.0, 32.5), (40.0, 20.0, 40.0)):
        limits = imo_limits(ratio)
        assert limits["zigzag 10/10", "first overshoot"] == first
        assert limits["zigzag 10/10", "second overshoot"] == second


FAILING = {"N_r": 1e4 / LAG, "N_wind_speed": 1.0}, {"X_rps": 0.0, "X_rps^2": 1.0, "N_1": 60.0}


@pytest.mark.slow
@pytest.mark.parametrize("change", FAILING, ids=["diverges", "turns"])
def test_a_manoeuvre_that_the_model_cannot_hold_keeps_the_numbers_before(change, snapshot):
    result = evaluate(NOMOTO | change)
    lacking = [" ".join(key) for key, each in numbers(result).items() if each.value is None]
    assert [describe_verdict(result), *describe_conditions(result), *lacking] == snapshot


@pytest.mark.slow
def test_a_motion_that_diverges_at_once_has_no_extrapolation():
    damping = hd.Damping.from_dict(None, NOMOTO | {"N_r": 1e9})
    damping = replace(damping, covariance=np.diag((0.1 * damping.coefficients) ** 2))
    fit = hd.Fit(damping, "ls", hd.Status.OK, training_range={"u": (0.5, 1.0)}, vehicle=SHIP)
    result = evaluate_ship(SHIP, damping, 2.0, fit=fit, length=4.0, rudder_rate=100.0)
    assert (result.extrapolation["turning circle"], result.probability) == ({}, 0.0)


FOREIGN = {"vehicle": vehicle_stamp(replace(SHIP, weight=9.0, buoyancy=9.0))}
WRONG = [
    ({"coefficients": np.full(7, np.nan)}, {}), ({"covariance": np.full((7, 7), np.nan)}, {}),
    (FOREIGN, {}), (NOMOTO | {"N_1": 1e6}, {}), ({}, {"rudder": "wheel"}),
    ({}, {"propeller": "rudder"}), ({}, {"rudder": "rps"}), ({}, {"speed": 0.0}),
    ({}, {"speed": None}), ({}, {"length": -1.0}), ({}, {"rudder_rate": 0.0}),
    ({}, {"vehicle": replace(SHIP, axes=("X", "N"))}),
    ({"X_u|u|": -10.0, "X_rps": 1.0, "Y_v": -1e3, "N_r": -1e3}, {}),
]  # fmt: skip


@pytest.mark.parametrize(("change", "settings"), WRONG)
def test_wrong_input_is_refused(change, settings, refused):
    """A change of the coefficients of Nomoto's ship, or other coefficients."""
    damping = hd.Damping.from_dict(None, change if "X_rps" in change else NOMOTO)
    damping = damping if "X_rps" in change else replace(damping, **change)
    settings = {"vehicle": SHIP, "speed": 2.0, "length": 4.0, "damping": damping} | settings
    refused(HydrodampError, evaluate_ship, **settings)
