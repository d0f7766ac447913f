"""Where damping feeds the motion, by polynomials whose roots are known, and what is said of it."""

import math

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.operating_range import (
    energy_injection_warnings,
    join_ranges,
    range_exceedance_warnings,
    unstable_speed_ranges,
    velocity_ranges,
)

AHEAD = {"u": (1.0, 2.0)}


def damping(**values):
    return hd.Damping.from_dict(None, values)


@pytest.mark.parametrize(
    ("values", "name", "found"),
    [
        ({"M_q": -2.0, "M_q|q|": -0.5}, "q", []),
        ({"M_q": -2.0, "M_q|q|": 0.5}, "q", [(4.0, math.inf)]),
        ({"M_q": 2.0, "M_q|q|": 0.5}, "q", [(0.0, math.inf)]),
        ({"Y_v": 1.0, "Y_v|v|": -2.0}, "v", [(0.0, 0.5)]),
        ({"Y_v": 1.0, "Y_vV": -2.0}, "v", [(0.0, 0.5)]),  # V is |v| where w is zero
        ({"Y_vV_v": 2.0}, "v", [(0.0, math.inf)]),
        ({"N_r": -2.0, "N_r|r|": 3.0, "N_r^3": -1.0}, "r", [(1.0, 2.0)]),
        ({"Z_w": -2.0, "Z_w|q|": 9.0, "Z_wV_v": 9.0, "Z_1": 5.0}, "w", []),  # not its own
    ],
)
def test_feeding_lies_between_the_roots_of_the_own_polynomial(values, name, found):
    assert unstable_speed_ranges(damping(**values), name) == [pytest.approx(one) for one in found]


def test_an_even_term_feeds_one_way():
    drag = damping(**{"X_u^2": -3.0})
    assert unstable_speed_ranges(drag, "u", 1.0) == []
    assert unstable_speed_ranges(drag, "u", -1.0) == [(0.0, math.inf)]
    assert not list(energy_injection_warnings(drag, AHEAD))  # never sailed astern
    assert list(energy_injection_warnings(drag, {"u": (-1.0, 2.0)}))


def test_surge_damps_a_vehicle_under_way():
    lift = damping(**{"Z_w": 5.0, "Z_uw": -3.0, "Z_w|w|": 0.5})
    assert unstable_speed_ranges(lift, "w") == [(0.0, math.inf)]
    assert unstable_speed_ranges(lift, "w", 1.0, surge=2.0) == [(2.0, math.inf)]


@pytest.mark.parametrize("key", list(hd.catalog))
@pytest.mark.parametrize("name", "uvwpqr")
def test_feeding_is_where_power_is_positive(key, name):
    model = hd.catalog[key]
    rng = np.random.default_rng(len(key))
    found = hd.Damping(model, rng.normal(size=model.n_coefficients))
    place = "uvwpqr".index(name)
    for sign in (1.0, -1.0):
        speeds = rng.uniform(0.01, 5.0, 200)
        velocity = np.zeros((200, 6))
        velocity[:, place] = sign * speeds
        power = found.power(velocity)
        inside = [
            any(a < x < b for a, b in unstable_speed_ranges(found, name, sign)) for x in speeds
        ]
        np.testing.assert_array_equal(inside, power > 0.0)


def test_it_is_told_near_the_range_and_beyond_but_not_far_from_it():
    wrong = damping(**{"M_q": -2.0, "M_q|q|": 0.5, "Y_v": 1.0, "Y_v|v|": -2.0})
    (said,) = energy_injection_warnings(wrong, {"q": (-2.8, 2.8), "v": (-1.0, 1.0)})
    assert said == "The damping feeds energy into q beyond 4 rad/s: a replay may run away there."
    assert not list(energy_injection_warnings(wrong, {"q": (-2.6, 2.6)}))
    (said,) = energy_injection_warnings(wrong, {**AHEAD, "v": (-0.4, 0.4), "q": (-5.0, 5.0)})
    assert "into v up to 0.5 m/s, q beyond 4 rad/s (at 1 m/s of surge): a replay" in said


def test_a_test_beyond_the_training_is_told():
    training = {"u": (1.0, 2.0), "q": (-2.6, 2.6)}
    (said,) = range_exceedance_warnings(
        training, {"u": (1.0, 2.1), "q": (-4.9, 4.9), "r": (-1.0, 1.0)}
    )
    assert said == "Beyond the training data: q reaches 4.9 rad/s in the test, 2.6 in training."
    assert not list(range_exceedance_warnings(training, training))
    assert not list(range_exceedance_warnings({}, training))


def test_ranges_of_free_axes_without_outliers():
    time = np.linspace(0.0, 20.0, 4001)
    velocity = np.outer(np.sin(time), [0.0, 0.5, 0.0, 0.0, 0.0, 2.0])
    velocity[:, 0] = 1.5 + 0.5 * np.sin(time)
    velocity[7] = 99.0
    found = velocity_ranges(velocity, ("X", "Y", "N"))
    assert found == {
        "u": pytest.approx((1.0, 2.0), abs=0.01),
        "v": pytest.approx((-0.5, 0.5), abs=0.01),
        "r": pytest.approx((-2.0, 2.0), abs=0.01),
    }
    both = join_ranges({"u": (1.0, 2.0), "v": (-1.0, 1.0)}, {"u": (0.5, 1.5), "r": (-3.0, 3.0)})
    assert both == {"u": (0.5, 2.0), "v": (-1.0, 1.0), "r": (-3.0, 3.0)}


def test_a_fit_knows_what_it_was_trained_on(vehicle, exact_log):
    truth = damping(**{"X_u": -9.0, "M_q": -5.0, "M_q|q|": 40.0})
    log = exact_log(truth, n=300)
    fit = hd.identify(truth.model, vehicle, log, hd.LeastSquares())
    assert fit.training_range == velocity_ranges(log.velocity, vehicle.axes)
    assert any("The damping feeds energy into q" in said for said in fit.summary_lines)
