"""Dissipative least squares: search, price, margin, and what cannot be."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.basis.term import AXES, VELOCITIES
from hydrodamp.identification import dissipative
from hydrodamp.identification.dissipativity import (
    OperatingBox,
    PowerRegressor,
    max_damping_power,
    operating_box,
)
from hydrodamp.identification.regression import PointwiseRegression

EXACT = PointwiseRegression(hd.RecordedAcceleration())
UNIT = OperatingBox([-1] * 6, [1] * 6)
UNDER_WAY = OperatingBox([1, -0.5, -0.2, -0.1, -0.2, -0.4], [3, 0.5, 0.2, 0.1, 0.2, 0.4])
HOVERING = OperatingBox(-UNDER_WAY.high, UNDER_WAY.high)
LINEAR, PRESTERO = hd.catalog["linear"], hd.catalog["prestero"]
PLANAR = LINEAR.restricted_to("XYN")


def inside(box, n=20_000):
    return box.at(np.random.default_rng(0).uniform(size=(n, 6)))


def drag(model):
    """Return drag on the own velocity of each axis, zero elsewhere."""
    own = {f"{axis}_{nu}" for axis, nu in zip(AXES, VELOCITIES, strict=True)}
    own |= {f"{label}|{label[-1]}|" for label in own}
    return hd.Damping(model, [-20.0 if label in own else 0.0 for label in model.labels])


@pytest.fixture
def pushing(exact_log):
    """A log of damping that pushes in sway, and its problem."""

    def build(vehicle, model=LINEAR, forward=3.0, n=900):
        values = drag(model).as_dict()
        values["Y_v"] = 5.0
        log = exact_log(hd.Damping.from_dict(model, values), forward=forward, n=n)
        return hd.prepare(vehicle, log, model)

    return build


def nearest(damping, box):
    """Return the nearest coefficients that dissipate, in the plain norm."""
    power, root = PowerRegressor(damping.model), np.eye(damping.model.n_coefficients)
    return dissipative.project_dissipative(power, box, root, damping.coefficients)[0]


@pytest.mark.slow
def test_the_nearest_linear_damping_around_rest_is_highams(true_damping):
    """Frobenius norm: keep the antisymmetric part, drop positive eigenvalues (Higham 1988)."""
    damping = true_damping(PLANAR)
    matrix = damping.coefficients.reshape(3, 3)
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
    expected = (matrix - matrix.T) / 2 + (vectors * np.minimum(values, 0.0)) @ vectors.T
    found = nearest(damping, UNIT)
    np.testing.assert_allclose(found.reshape(3, 3), expected, atol=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("key", "box"),
    [(key, UNDER_WAY) for key in ("mcfarland-whitcomb", "coe", "prestero", "gertler-hagen")]
    + [("fossen", HOVERING)],
)
def test_no_velocity_of_the_box_pushes(key, box, true_damping):
    damping = true_damping(hd.catalog[key])
    power = replace(damping, coefficients=nearest(damping, box)).power(inside(box))
    assert power.max() <= 1e-4 * np.abs(power).max()


@pytest.mark.slow
def test_a_box_away_from_rest_costs_less():
    """Forward drag pays for a coupling that no box around rest allows."""
    damping = hd.Damping.from_dict(None, {"X_u": -2.0, "N_v": 1.0, "N_r": -0.1})
    away = OperatingBox([1, -0.5, 0, 0, 0, -0.5], [2, 0.5, 0, 0, 0, 0.5])
    around = OperatingBox([-2, *away.low[1:]], away.high)
    np.testing.assert_allclose(nearest(damping, away), damping.coefficients)
    assert abs(nearest(damping, around)[1]) < 1e-2


@pytest.mark.slow
def test_a_set_without_interior_gives_the_last_coefficients_that_make_sense():
    """Around rest N_v alone must vanish: no tightening can be met."""
    found = nearest(hd.Damping.from_dict(None, {"X_u": -1.0, "N_v": 1.0}), UNIT)
    np.testing.assert_allclose(found, [-1.0, 0.0], atol=1e-2)


@pytest.mark.slow
def test_the_rounds_can_run_out(vehicle, pushing, monkeypatch):
    monkeypatch.setattr(dissipative, "_MAX_ITERATIONS", 1)
    fit = hd.Dissipative(EXACT, box=UNIT).identify(pushing(vehicle), LINEAR)
    assert "1 cutting-plane iterations (the maximum)" in fit.remarks[0]


@pytest.mark.slow
def test_what_dissipates_already_is_least_squares(vehicle, exact_log):
    log = exact_log(drag(PRESTERO), forward=3.0, n=900)
    noise = np.random.default_rng(1).normal(0, 0.3, log.wrench.shape)
    problem = hd.prepare(vehicle, replace(log, wrench=log.wrench + noise), PRESTERO)
    plain = hd.LeastSquares(hd.RecordedAcceleration()).identify(problem, PRESTERO)
    fit = hd.Dissipative(EXACT).identify(problem, PRESTERO)
    assert max_damping_power(plain.damping, operating_box(problem)).power < 0
    found, expected = (each.damping.coefficients for each in (fit, plain))
    np.testing.assert_allclose(found, expected, atol=1e-4 * np.abs(expected).max())
    assert "The constraint is inactive" in fit.remarks[0]


@pytest.mark.slow
def test_the_price_is_the_growth_of_the_residual(vehicle, pushing):
    """By hand, from the rows: root mean square over axes of the growth of each."""
    problem = pushing(vehicle)
    noise = np.random.default_rng(0).normal(size=(900, 6))
    noisy = replace(problem.inputs, wrench=problem.inputs.wrench + noise)
    problem = replace(problem, inputs=noisy)
    rows, box = EXACT.rows(problem), operating_box(problem)
    plain = hd.LeastSquares(hd.RecordedAcceleration()).identify(problem, LINEAR)
    fit = hd.Dissipative(EXACT, box=replace(box, low=-box.high)).identify(problem, LINEAR)
    left = [
        np.linalg.norm(rows.design @ each.damping.matrix.T - rows.target, axis=0)
        for each in (fit, plain)
    ]
    total = 100.0 * (np.sqrt(np.mean((left[0] / left[1]) ** 2)) - 1.0)
    assert f"increases the RMS residual by {total:.2g} %" in fit.remarks[0]


@pytest.mark.slow
def test_what_was_checked_and_left_free_is_said(vehicle, pushing):
    table = {"X": "u", "Y N": "v r vV uv(eta-1)"}
    model = hd.DampingModel.from_table(table, key="with-v")
    problem = pushing(vehicle, model)
    box = operating_box(problem)
    around = replace(box, low=-box.high)
    fit = hd.Dissipative(EXACT, box=around).identify(problem, model)
    assert fit.remarks[0].startswith("Dissipative by search, not proven")
    assert "cutting-plane iterations" in fit.remarks[0]
    assert "(eta-1) are unconstrained" in fit.remarks[0]
    greatest = np.abs(fit.damping.power(inside(around))).max()
    assert fit.damping.power(inside(around)).max() < 1e-4 * greatest


def test_a_gain_stays_free(vehicle, exact_log):
    """A rudder that pushes is no damping."""
    log = exact_log(drag(LINEAR), forward=3.0, n=900)
    rudder = 0.3 * np.sign(np.sin(log.time))
    wrench = log.wrench - np.outer(9.2 * rudder * log.velocity[:, 0] ** 2, np.eye(6)[5])
    log = replace(log, wrench=wrench, command_names=("rudder",), commands=rudder[:, None])
    model = LINEAR.with_terms({"N": "u^2*rudder", "Z": "1 down_z"})
    fit = hd.Dissipative(EXACT).identify(hd.prepare(vehicle, log, model), model)
    assert fit.damping["N_u^2*rudder"] == pytest.approx(9.2, rel=1e-6)


def test_a_model_without_damping_has_nothing_to_constrain(vehicle, exact_log):
    model = hd.DampingModel.from_table({"X N": "1"}, key="trim")
    problem = hd.prepare(vehicle, exact_log(drag(LINEAR), n=900), model)
    plain = hd.LeastSquares(hd.RecordedAcceleration()).identify(problem, model)
    fit = hd.Dissipative(EXACT).identify(problem, model)
    np.testing.assert_allclose(fit.damping.coefficients, plain.damping.coefficients, rtol=1e-9)
    assert fit.remarks == ("The model has no damping term: there is no constraint.",)
