"""Dissipative least squares: proof, search, price, margin, and what cannot be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.dissipation import certificate, cutting_planes
from hydrodamp.identification.dissipation.cone_program import Nearest
from hydrodamp.identification.dissipation.dissipative import Dissipative, dissipative_solution
from hydrodamp.identification.dissipation.dissipative_set import DissipativeSet, project_dissipative
from hydrodamp.identification.dissipation.operating_box import OperatingBox, operating_box
from hydrodamp.identification.dissipation.power import worst_power
from hydrodamp.identification.dissipation.price import price
from hydrodamp.identification.rows import Differenced

EXACT = Differenced(hd.RecordedAcceleration())
UNIT = OperatingBox([-1] * 6, [1] * 6)
UNDER_WAY = OperatingBox([1, -0.5, -0.2, -0.1, -0.2, -0.4], [3, 0.5, 0.2, 0.1, 0.2, 0.4])
HOVERING = OperatingBox(-UNDER_WAY.high, UNDER_WAY.high)
LINEAR, PRESTERO = hd.catalog["linear"], hd.catalog["prestero"]
PLANAR = LINEAR.restricted_to("XYN")


def inside(box: OperatingBox, n: int = 20_000) -> np.ndarray:
    return box.at(np.random.default_rng(0).uniform(size=(n, 6)))


def drag(model: hd.DampingModel) -> hd.Damping:
    """Return drag on the own velocity of each axis, zero elsewhere."""
    own = {f"{axis}_{nu}" for axis, nu in zip(hd.AXES, hd.VELOCITIES, strict=True)}
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


def test_the_nearest_linear_damping_around_rest_is_highams(true_damping):
    """Frobenius norm: keep the antisymmetric part, drop positive eigenvalues (Higham 1988)."""
    damping = true_damping(LINEAR)
    matrix = damping.coefficients.reshape(6, 6)
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
    expected = (matrix - matrix.T) / 2 + (vectors * np.minimum(values, 0.0)) @ vectors.T
    found = project_dissipative(damping, UNIT, np.eye(36))
    np.testing.assert_allclose(found.coefficients.reshape(6, 6), expected, atol=1e-6)


def test_search_and_proof_agree_where_the_proof_is_exact(true_damping):
    damping = true_damping(PLANAR)
    proven = DissipativeSet(PLANAR, UNIT).nearest(damping.coefficients, np.eye(9))
    searched = DissipativeSet(PLANAR, UNIT, certify=False).nearest(damping.coefficients, np.eye(9))
    assert proven.certified
    assert not searched.certified
    assert searched.done
    np.testing.assert_allclose(searched.coefficients, proven.coefficients, atol=2e-3)


@pytest.mark.parametrize(
    ("key", "box"),
    [
        *((key, UNDER_WAY) for key in ("mcfarland-whitcomb", "linear", "coe", "prestero")),
        *((key, UNIT) for key in ("mcfarland-whitcomb", "linear", "fossen")),
    ],
)
def test_a_proof_holds(key, box, true_damping):
    """No velocity of the box is found at which proven coefficients push."""
    damping = true_damping(hd.catalog[key])
    root = np.eye(damping.model.n_coefficients)
    found = DissipativeSet(damping.model, box).nearest(damping.coefficients, root)
    projected = replace(damping, coefficients=found.coefficients)
    assert found.certified
    assert projected.power(inside(box)).max() <= found.bound + 1e-12
    assert worst_power(projected, box).power <= 1e-4 * np.abs(projected.power(inside(box))).max()


def test_signed_products_around_rest_are_checked_by_search(true_damping):
    """Either sign of a parameter at rest leaves its matrix no interior, so no proof."""
    damping = true_damping(PRESTERO)
    found = DissipativeSet(PRESTERO, HOVERING).nearest(damping.coefficients, np.eye(30))
    assert not found.certified
    power = replace(damping, coefficients=found.coefficients).power(inside(HOVERING))
    assert power.max() < 1e-4 * np.abs(power).max()


def test_a_box_away_from_rest_costs_less(true_damping):
    """Forward drag pays for a coupling that no box around rest allows."""
    damping = hd.Damping.from_dict(None, {"X_u": -2.0, "N_v": 1.0, "N_r": -0.1})
    away = OperatingBox([1, -0.5, 0, 0, 0, -0.5], [2, 0.5, 0, 0, 0, 0.5])
    around = OperatingBox([-2, *away.low[1:]], away.high)
    kept = project_dissipative(damping, away, np.eye(3))
    np.testing.assert_allclose(kept.coefficients, damping.coefficients, atol=1e-5)
    assert abs(project_dissipative(damping, around, np.eye(3))["N_v"]) < 1e-3


def test_what_dissipates_already_is_least_squares(vehicle, exact_log):
    truth = drag(PRESTERO)
    log = exact_log(replace(truth, coefficients=truth.coefficients), forward=3.0, n=900)
    rng = np.random.default_rng(1)
    problem = hd.prepare(
        vehicle, replace(log, wrench=log.wrench + rng.normal(0, 0.3, log.wrench.shape)), PRESTERO
    )
    plain = hd.LeastSquares(hd.RecordedAcceleration()).identify(problem, PRESTERO)
    fit = Dissipative(EXACT).identify(problem, PRESTERO)
    assert worst_power(plain.damping, operating_box(problem)).power < 0
    size = np.abs(plain.damping.coefficients).max()
    np.testing.assert_allclose(
        fit.damping.coefficients, plain.damping.coefficients, atol=1e-4 * size
    )
    assert any("costs nothing" in remark for remark in fit.remarks)
    assert fit.remarks[0].startswith("Certified: 48 matrix inequalities prove")


def test_the_price_of_damping_that_pushes(vehicle, pushing):
    problem = pushing(vehicle)
    box = operating_box(problem)
    method = Dissipative(EXACT, box=replace(box, low=-box.high))
    fit = method.identify(problem, LINEAR)
    assert fit.damping["Y_v"] == pytest.approx(0.0, abs=0.05)
    assert fit.damping["N_r"] == pytest.approx(-20.0, rel=0.2)
    assert fit.remarks[0].startswith("Certified: 1 matrix inequality proves")
    assert fit.remarks[1].startswith("The constraint costs")
    assert "Y" in fit.remarks[1]
    assert fit.damping.covariance is None
    assert fit.status is hd.Status.OK


def test_the_price_is_the_growth_of_the_residual(vehicle, pushing):
    """By hand, from the rows: on one axis sqrt(sum of squares)."""
    problem = pushing(vehicle)
    noisy = replace(
        problem.inputs,
        wrench=problem.inputs.wrench + np.random.default_rng(0).normal(size=(900, 6)),
    )
    problem = replace(problem, inputs=noisy)
    rows, triangle = EXACT.rows(problem), EXACT.rows(problem).triangle()
    plain = hd.LeastSquares(hd.RecordedAcceleration()).identify(problem, LINEAR).damping
    moved = replace(plain, coefficients=plain.coefficients * 1.1)

    def left(damping: hd.Damping) -> np.ndarray:
        return np.linalg.norm(rows.design @ damping.matrix.T - rows.target, axis=0)

    weights = 900.0 / left(plain) ** 2
    cost = price(triangle, weights, LINEAR, moved.coefficients)
    np.testing.assert_allclose(cost.by_axis, left(moved) / left(plain) - 1, rtol=1e-6)
    assert cost.total == pytest.approx(np.sqrt(np.mean((left(moved) / left(plain)) ** 2)) - 1)
    assert not price(triangle, weights, LINEAR, plain.coefficients).active


def test_terms_that_do_not_fit_are_checked(vehicle, pushing):
    table = {"X": "u", "Y N": "v r vV uv(eta-1)"}
    model = hd.DampingModel.from_table(table, key="with-v")
    problem = pushing(vehicle, model)
    box = operating_box(problem)
    around = replace(box, low=-box.high)
    fit = Dissipative(EXACT, box=around).identify(problem, model)
    assert fit.remarks[0].startswith("Checked, not proven: the worst power found on u -")
    assert "rounds of cutting planes" in fit.remarks[0]
    assert "2 coefficients of terms with commands" in fit.remarks[-1]
    greatest = np.abs(fit.damping.power(inside(around))).max()
    assert fit.damping.power(inside(around)).max() < 1e-4 * greatest


def test_a_margin_takes_at_least_that_share_of_the_energy(vehicle, pushing):
    problem = pushing(vehicle)
    for method in (Dissipative(EXACT, margin=0.05), Dissipative(EXACT, None, 0.05, False)):
        fit = method.identify(problem, LINEAR)
        nu = inside(operating_box(problem))
        energy = np.sum((nu @ vehicle.mass_matrix) * nu, axis=1)
        assert np.max(fit.damping.power(nu) + 0.05 * energy) < 1e-3


def test_a_margin_that_nothing_can_meet_says_what_to_loosen(vehicle, pushing):
    model = hd.DampingModel.from_table({"X": "u", "Y": "v", "N": "v"}, key="bare")
    problem = pushing(vehicle, LINEAR)
    problem = hd.prepare(vehicle, problem.log, model)
    box = OperatingBox([-1] * 6, [1] * 6)
    with pytest.raises(hd.MethodError, match=r"lower `margin`.*such as Z_w"):
        Dissipative(EXACT, box=box, margin=0.1).identify(problem, model)


@pytest.mark.parametrize("margin", [-0.1, np.nan, np.inf])
def test_a_margin_is_a_rate(margin):
    with pytest.raises(hd.MethodError, match="`margin` must be a rate"):
        Dissipative(margin=margin)


def test_a_gain_stays_free(vehicle, exact_log):
    """A rudder that pushes is no damping."""
    truth = drag(LINEAR)
    log = exact_log(truth, forward=3.0, n=900)
    rudder = 0.3 * np.sign(np.sin(log.time))
    wrench = log.wrench.copy()
    wrench[:, 5] -= 9.2 * rudder * log.velocity[:, 0] ** 2
    log = replace(log, wrench=wrench, command_names=("rudder",), commands=rudder[:, None])
    model = LINEAR.with_terms({"N": "u^2*rudder", "Z": "1 down_z"})
    fit = Dissipative(EXACT).identify(hd.prepare(vehicle, log, model), model)
    assert fit.damping["N_u^2*rudder"] == pytest.approx(9.2, rel=1e-6)
    assert "Left free, for they are no damping: 3 coefficients" in fit.remarks[-1]


def test_a_model_without_damping_has_nothing_to_constrain(vehicle, exact_log):
    model = hd.DampingModel.from_table({"X N": "1"}, key="trim")
    problem = hd.prepare(vehicle, exact_log(drag(LINEAR), n=900), model)
    plain = hd.LeastSquares(hd.RecordedAcceleration()).identify(problem, model)
    fit = Dissipative(EXACT).identify(problem, model)
    np.testing.assert_allclose(fit.damping.coefficients, plain.damping.coefficients, rtol=1e-9)
    assert fit.remarks == ("No term is damping: there was nothing to constrain.",)


def test_three_degrees_of_freedom(vehicle, pushing):
    planar = replace(vehicle, axes=("X", "Y", "N"))
    problem = pushing(planar)
    fit = Dissipative(EXACT, box=UNIT, margin=0.01).identify(problem, LINEAR)
    assert fit.model.labels == tuple(f"{axis}_{nu}" for axis in "XYN" for nu in "uvr")
    matrix = fit.damping.coefficients.reshape(3, 3)
    assert np.linalg.eigvalsh(matrix + matrix.T).max() < 0.0
    assert " w " not in fit.remarks[0]


def test_aliased_columns_are_named(vehicle, exact_log):
    model = hd.catalog["uncoupled"]
    problem = hd.prepare(vehicle, exact_log(drag(model), forward=3.0, n=900), model)
    fit = Dissipative(EXACT).identify(problem, model)
    assert fit.status is hd.Status.RANK_DEFICIENT
    assert fit.rank == 24 - 2
    assert ("X_u", "X_|u|") in fit.aliased
    assert fit.damping["X_u"] == pytest.approx(fit.damping["X_|u|"], rel=1e-3)


def test_too_few_samples_is_a_status(vehicle, exact_log):
    model = hd.catalog["mcfarland-whitcomb"]
    problem = hd.prepare(vehicle, exact_log(drag(LINEAR), n=30), model)
    fit = Dissipative(EXACT).identify(problem, model)
    assert fit.status is hd.Status.TOO_FEW_SAMPLES


def test_a_dear_proof_is_compared_with_the_search(vehicle, exact_log):
    """Around rest the matrices forbid what Prestero's products need."""
    truth = drag(PRESTERO).as_dict() | {"Y_ur": 8.0, "N_uv": -9.0, "Y_uv": -20.0, "N_ur": -10.0}
    log = exact_log(hd.Damping.from_dict(PRESTERO, truth), forward=2.0, n=900)
    rng = np.random.default_rng(1)
    log = replace(log, wrench=log.wrench + rng.normal(0, 0.1, log.wrench.shape))
    problem = hd.prepare(vehicle, log, PRESTERO)
    box = OperatingBox([-3.0, *UNDER_WAY.low[1:]], UNDER_WAY.high)
    fit = Dissipative(EXACT, box=box).identify(problem, PRESTERO)
    assert fit.remarks[0].startswith("Certified")
    assert fit.remarks[2].startswith("Most of that is the price of the proof")


def _failing(root, point, inequalities):
    n = len(point)
    return Nearest(np.full(n, np.nan), np.zeros(0), np.zeros(0), "NumericalError")


def test_a_solver_that_fails_is_a_status(vehicle, pushing, monkeypatch):
    problem = pushing(vehicle)
    for module in (certificate, cutting_planes):
        monkeypatch.setattr(module, "nearest", _failing)
    fit = Dissipative(EXACT, box=UNIT).identify(problem, LINEAR)
    assert fit.status is hd.Status.FAILED
    with pytest.raises(hd.MethodError, match="the solver found no dissipative coefficients"):
        project_dissipative(hd.Damping.from_dict(None, {"X_u": 1.0}), UNIT)


def test_an_unfinished_proof_is_no_proof(true_damping, monkeypatch):
    """The solver says solved, the eigenvalues say otherwise: the search takes over."""

    def careless(root, point, inequalities):
        further = np.zeros(inequalities.n_free + inequalities.n_multipliers)
        return Nearest(point, further, np.zeros(0), "Solved")

    damping = true_damping(PLANAR)
    monkeypatch.setattr(certificate, "nearest", careless)
    found = DissipativeSet(PLANAR, UNIT).nearest(damping.coefficients, np.eye(9))
    assert not found.certified
    assert found.rounds > 0


@pytest.mark.parametrize("metric", [-np.eye(2), np.eye(3), np.full((2, 2), np.nan)])
def test_a_metric_is_positive_definite(metric):
    damping = hd.Damping.from_dict(None, {"X_u": 1.0, "Y_v": 1.0})
    with pytest.raises(hd.MethodError, match="`metric` must be a positive definite matrix"):
        project_dissipative(damping, UNIT, metric)


def test_the_metric_says_which_coefficient_gives_way():
    """u v (X_v + Y_u) = 0 around rest: the dear one stays."""
    damping = hd.Damping.from_dict(None, {"X_v": 1.0, "Y_u": 1.0})
    found = project_dissipative(damping, UNIT, np.diag([1.0, 1e4]))
    np.testing.assert_allclose(found.coefficients, [-1.0, 1.0], atol=1e-3)


def test_a_projection_can_ask_for_a_reserve():
    damping = hd.Damping.from_dict(None, {"X_u": -0.5, "N_r": -3.0})
    found = project_dissipative(damping, UNIT, reserve=np.diag([1.0, 0, 0, 0, 0, 1.0]))
    np.testing.assert_allclose(found.coefficients, [-1.0, -3.0], atol=1e-5)


def test_a_set_without_interior_gives_the_last_coefficients_that_make_sense():
    """Around rest N_v alone must vanish: no tightening can be met."""
    damping = hd.Damping.from_dict(None, {"X_u": -1.0, "N_v": 1.0})
    wanted = DissipativeSet(damping.model, UNIT, certify=False)
    found = wanted.nearest(damping.coefficients, np.eye(2))
    np.testing.assert_allclose(found.coefficients, [-1.0, 0.0], atol=1e-2)


def test_the_rounds_can_run_out(true_damping):
    damping = true_damping(LINEAR)
    wanted = DissipativeSet(LINEAR, UNIT, certify=False)
    found = wanted.nearest(damping.coefficients, np.eye(36), rounds=1)
    assert not found.done
    assert found.rounds == 1


def test_a_solution_needs_no_problem(vehicle, pushing):
    """From a triangle and weights alone, as folds and other methods have them."""
    problem = pushing(vehicle)
    triangle = EXACT.rows(problem).triangle()
    wanted = Dissipative(EXACT).wanted(problem, LINEAR)
    found = dissipative_solution(triangle, np.ones(6), wanted)
    assert found.certified
    assert found.coefficients.shape == (36,)
