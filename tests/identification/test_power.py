"""Power of damping: linear in the coefficients, its worst, and the box it is sought in."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.cli.export import operating_box_of
from hydrodamp.identification.dissipativity import (
    OperatingBox,
    PowerRegressor,
    is_damping_term,
    max_damping_power,
    operating_box,
)
from value_changes import set_values

UNDER_WAY = OperatingBox([1, -0.5, -0.2, -0.1, -0.2, -0.4], [3, 0.5, 0.2, 0.1, 0.2, 0.4])
LINEAR = hd.catalog["linear"]


def velocities(box, n=500, seed=3):
    return box.at(np.random.default_rng(seed).uniform(size=(n, 6)))


@pytest.mark.parametrize("key", list(hd.catalog))
def test_rows_times_coefficients_is_the_power(key, true_damping):
    damping = true_damping(hd.catalog[key])
    rows, nu = PowerRegressor(damping.model), velocities(UNDER_WAY)
    expected = damping.power(nu)  # at a propulsion ratio of one
    scale = np.abs(expected).max()
    np.testing.assert_allclose(rows.rows(nu) @ damping.coefficients, expected, atol=1e-12 * scale)
    np.testing.assert_allclose(rows.power(damping.coefficients, nu), expected, atol=1e-12 * scale)


def test_what_is_damping():
    assert all(is_damping_term(hd.Term.parse(term)) for term in ("u", "V_v|r|"))
    others = ("uv(eta-1)", "down_y", "1", "u|u|*rudder", "rpm*|rpm|")
    assert not any(is_damping_term(hd.Term.parse(term)) for term in others)


def test_the_worst_power_of_a_quadratic_form_is_at_a_corner():
    """X_v + Y_u = 2 couples: P = -u^2 + 2 u v + v^2 grows with v, falls with u beyond v."""
    damping = hd.Damping.from_dict(None, {"X_u": -1, "X_v": 2, "Y_v": 1})
    box = OperatingBox([1, -3, 0, 0, 0, 0], [4, 3, 0, 0, 0, 0])
    worst = max_damping_power(damping, box)
    assert worst.power == pytest.approx(-(3.0**2) + 2 * 3 * 3 + 3**2, rel=1e-6)
    np.testing.assert_allclose(np.abs(worst.velocity[:2]), [3, 3], rtol=1e-3)


def test_the_search_finds_what_dense_sampling_finds(true_damping):
    damping = true_damping(hd.catalog["gertler-hagen"])
    worst = max_damping_power(damping, UNDER_WAY)
    assert np.all((worst.velocity >= UNDER_WAY.low) & (worst.velocity <= UNDER_WAY.high))
    assert worst.power >= damping.power(velocities(UNDER_WAY, 100_000)).max()
    assert worst.power == pytest.approx(float(damping.power(worst.velocity)))


@pytest.mark.parametrize("surge", [(0.5, 2.0), (-1.0, 1.0)])
def test_the_export_searches_the_box_of_reports(vehicle, exact_log, true_damping, surge):
    """Not to rest where the vehicle was under way."""
    log = exact_log(true_damping(LINEAR))
    log = set_values(log, "velocity", (np.s_[:, 0], np.linspace(*surge, log.n)))
    problem = hd.prepare(vehicle, log, LINEAR)
    fit = hd.LeastSquares().identify(problem, LINEAR)
    box, exported = operating_box(problem), operating_box_of(fit)
    np.testing.assert_allclose(exported.low, box.low)
    np.testing.assert_allclose(exported.high, box.high)


@pytest.fixture
def boxed(vehicle, exact_log, true_damping):
    def build(forward=0.0, **settings):
        log = exact_log(true_damping(LINEAR), forward=forward)
        problem = hd.prepare(replace(vehicle, **settings), log, LINEAR)
        return problem, operating_box(problem)

    return build


def test_under_way_the_box_keeps_away_from_rest(boxed):
    problem, box = boxed(3.0)
    low, high = np.quantile(problem.inputs.velocity[:, 0], [0.01, 0.99])
    assert (box.low[0], box.high[0]) == pytest.approx((low / 1.25, 1.25 * high))
    assert box.min_abs[0] == box.low[0] > 0.0


def test_a_hovering_vehicle_has_a_box_around_rest(boxed):
    _, box = boxed()
    np.testing.assert_array_equal(box.low, -box.high)
    assert not box.min_abs.any()


def test_astern_is_under_way_too(boxed):
    _, box = boxed(-3.0)
    assert box.low[0] < box.high[0] < 0.0
    assert box.min_abs[0] == -box.high[0]
    assert box.max_abs[0] == -box.low[0]


def test_an_outlier_does_not_set_the_box(vehicle, boxed):
    problem, box = boxed(3.0)
    outlier = 100, lambda velocity: velocity + 4.5  # m/s, rad/s; less than 5 g in 0.1 s
    log = set_values(problem.log, "velocity", outlier)
    other = operating_box(hd.prepare(vehicle, log, LINEAR))
    np.testing.assert_allclose(other.max_abs, box.max_abs, rtol=0.05)


def test_locked_velocities_have_no_interval(boxed):
    _, box = boxed(axes=("X", "Y", "N"))
    np.testing.assert_array_equal(box.max_abs > 0, [True, True, False, False, False, True])
    assert "w" not in str(box)
