"""Operating ranges, and energy injection by polynomials whose roots are known."""

import math

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.dissipativity import (
    energy_injection_warnings,
    join_ranges,
    range_exceedance_warnings,
    unstable_speed_ranges,
    velocity_ranges,
)

AHEAD = {"u": (1.0, 2.0)}


def make_damping(**values):
    return hd.Damping.from_dict(None, values)


@pytest.mark.parametrize(
    ("values", "name", "expected"),
    [
        ({"M_q": -2.0, "M_q|q|": -0.5}, "q", []),
        ({"M_q": -2.0, "M_q|q|": 0.5}, "q", [(4.0, math.inf)]),
        ({"M_q": 2.0, "M_q|q|": 0.5}, "q", [(0.0, math.inf)]),
        ({"Y_v": 1.0, "Y_v|v|": -2.0}, "v", [(0.0, 0.5)]),
        ({"Y_v": 1.0, "Y_vV": -2.0}, "v", [(0.0, 0.5)]),  # V is |v| where w is zero
        ({"Y_vV_v": 2.0}, "v", [(0.0, math.inf)]),
        ({"N_r": -2.0, "N_r|r|": 3.0, "N_r^3": -1.0}, "r", [(1.0, 2.0)]),
        ({"Z_w": -2.0, "Z_w|q|": 9.0, "Z_wV_v": 9.0, "Z_1": 5.0}, "w", []),  # of other velocities
    ],
)
def test_energy_injection_lies_between_the_roots_of_the_power(values, name, expected):
    found = unstable_speed_ranges(make_damping(**values), name)
    assert found == [pytest.approx(interval) for interval in expected]


def test_an_even_term_injects_energy_in_one_direction():
    drag = make_damping(**{"X_u^2": -3.0})
    assert unstable_speed_ranges(drag, "u", 1.0) == []
    assert unstable_speed_ranges(drag, "u", -1.0) == [(0.0, math.inf)]
    assert not list(energy_injection_warnings(drag, AHEAD))  # no data astern
    assert list(energy_injection_warnings(drag, {"u": (-1.0, 2.0)}))


def test_surge_damps_a_vehicle_under_way():
    lift = make_damping(**{"Z_w": 5.0, "Z_uw": -3.0, "Z_w|w|": 0.5})
    assert unstable_speed_ranges(lift, "w") == [(0.0, math.inf)]
    assert unstable_speed_ranges(lift, "w", 1.0, surge=2.0) == [(2.0, math.inf)]


@pytest.mark.parametrize("key", list(hd.catalog))
@pytest.mark.parametrize("name", "uvwpqr")
def test_unstable_ranges_are_those_of_positive_power(key, name):
    model = hd.catalog[key]
    rng = np.random.default_rng(len(key))
    damping = hd.Damping(model, rng.normal(size=model.n_coefficients))
    index = "uvwpqr".index(name)
    for sign in (1.0, -1.0):
        speeds = rng.uniform(0.01, 5.0, 200)
        velocity = np.zeros((200, 6))
        velocity[:, index] = sign * speeds
        power = damping.power(velocity)
        ranges = unstable_speed_ranges(damping, name, sign)
        inside = [any(a < x < b for a, b in ranges) for x in speeds]
        np.testing.assert_array_equal(inside, power > 0.0)


def test_energy_injection_is_reported_up_to_1_5_times_the_range():
    wrong = make_damping(**{"M_q": -2.0, "M_q|q|": 0.5, "Y_v": 1.0, "Y_v|v|": -2.0})
    (message,) = energy_injection_warnings(wrong, {"q": (-2.8, 2.8), "v": (-1.0, 1.0)})
    assert "injects energy into q beyond 4 rad/s:" in message
    assert not list(energy_injection_warnings(wrong, {"q": (-2.6, 2.6)}))
    (message,) = energy_injection_warnings(wrong, {**AHEAD, "v": (-0.4, 0.4), "q": (-5.0, 5.0)})
    assert "into v up to 0.5 m/s, q beyond 4 rad/s (at a surge of 1 m/s):" in message


def test_test_data_beyond_the_training_range_are_reported():
    training = {"u": (1.0, 2.0), "q": (-2.6, 2.6)}
    test = {"u": (1.0, 2.1), "q": (-4.9, 4.9), "r": (-1.0, 1.0)}
    (message,) = range_exceedance_warnings(training, test)
    assert message.endswith(": q reaches 4.9 rad/s in the test, 2.6 in training.")
    assert not list(range_exceedance_warnings(training, training))
    assert not list(range_exceedance_warnings({}, training))


def test_ranges_of_free_axes_without_outliers():
    time = np.linspace(0.0, 20.0, 4001)
    velocity = np.outer(np.sin(time), [0.0, 0.5, 0.0, 0.0, 0.0, 2.0])
    velocity[:, 0] = 1.5 + 0.5 * np.sin(time)
    velocity[7] = 99.0
    ranges = velocity_ranges(velocity, ("X", "Y", "N"))
    assert ranges == {
        "u": pytest.approx((1.0, 2.0), abs=0.01),
        "v": pytest.approx((-0.5, 0.5), abs=0.01),
        "r": pytest.approx((-2.0, 2.0), abs=0.01),
    }
    joined = join_ranges({"u": (1.0, 2.0), "v": (-1.0, 1.0)}, {"u": (0.5, 1.5), "r": (-3.0, 3.0)})
    assert joined == {"u": (0.5, 2.0), "v": (-1.0, 1.0), "r": (-3.0, 3.0)}


def test_a_fit_stores_its_training_range(vehicle, exact_log):
    truth = make_damping(**{"X_u": -9.0, "M_q": -5.0, "M_q|q|": 40.0})
    log = exact_log(truth, n=300)
    fit = hd.identify(truth.model, vehicle, log, hd.LeastSquares())
    assert fit.training_range == velocity_ranges(log.velocity, vehicle.axes)
    assert any("injects energy into q" in line for line in fit.summary_lines)
