"""The robust identifier: fold, truth, gains, leakage, dead zone, bounds, projection, mean."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.online.gains import ByStep
from hydrodamp.identification.online.limits import OwnDrag, Within
from hydrodamp.identification.online.projection import OntoDissipative, inverted, joined
from hydrodamp.identification.online.recursive import RecursiveLeastSquares
from hydrodamp.identification.online.robust import RobustIdentifier, tail_start
from hydrodamp.identification.online.whitening import ByExcitation, second_moments
from hydrodamp.identification.rows.velocity_noise import median_step, signal_to_noise

NEUTRAL = RobustIdentifier(a=20.0, gamma=20.0, limits=None, passes=1, tail=0.0)


@pytest.fixture
def prepared(driven, discrete_log, true_damping):
    def build(key, n=300):
        truth = true_damping(hd.catalog[key])
        return hd.prepare(driven, discrete_log(truth, n=n), truth.model), truth

    return build


@pytest.mark.parametrize("tail", [1.0, 0.4])
@pytest.mark.parametrize("method", [NEUTRAL, RobustIdentifier(passes=2, dead_zone=1.0)])
def test_batch_is_the_fold_of_the_online_step_bit_for_bit(prepared, method, tail):
    method = replace(method, tail=tail, leakage=1e-3)
    problem, truth = prepared("gertler-hagen", 90)
    starts = set(problem.segments[:, 0].tolist())
    samples = [problem.inputs.sample(k) for k in range(problem.n_samples)]
    steps = problem.n_samples - len(starts)
    state = method.init(problem, truth.model, samples[0])
    for _ in range(method.passes):
        state, count = state.restarted(samples[0]), 0
        for k, sample in enumerate(samples[1:], start=1):
            if k in starts:
                state = state.restarted(sample)
                continue
            state = state.averaging() if count == tail_start(steps, tail) else state
            state, count = method.step(state, sample), count + 1
    fit = method.identify(problem, truth.model)
    np.testing.assert_array_equal(state.mean.coefficients, fit.damping.coefficients)
    last = replace(method, tail=0.0).identify(problem, truth.model)
    np.testing.assert_array_equal(state.damping.coefficients, last.damping.coefficients)
    assert state.damping.vehicle == fit.damping.vehicle
    with pytest.raises(hd.ProblemError, match="time must advance"):
        method.step(state, samples[3])
    with pytest.raises(ValueError, match="read-only"):
        state.adapting.coefficients[0] = 1.0


def test_with_neutral_settings_it_is_the_adaptive_identifier(prepared):
    problem, truth = prepared("linear", 90)
    plain = hd.AdaptiveIdentifier(a=20.0, gamma=20.0)
    found = NEUTRAL.identify(problem, truth.model).damping.coefficients
    expected = plain.identify(problem, truth.model).damping.coefficients
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    scaled = replace(NEUTRAL, a=hd.ByNoise(), gamma=hd.ByTerm(), passes=3)
    other = hd.AdaptiveIdentifier(a=hd.ByNoise(), gamma=hd.ByTerm(), passes=3)
    found = scaled.identify(problem, truth.model)
    expected = other.identify(problem, truth.model)
    np.testing.assert_allclose(
        found.damping.coefficients, expected.damping.coefficients, rtol=1e-7, atol=1e-9
    )
    assert found.status is expected.status
    ours, theirs = NEUTRAL.history(problem, truth.model), plain.history(problem, truth.model)
    np.testing.assert_allclose(ours.coefficients, theirs.coefficients, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(ours.velocity_error, theirs.velocity_error, rtol=1e-6, atol=1e-9)
    assert ours.labels == theirs.labels


@pytest.mark.parametrize("key", ["linear", "prestero", "gertler-hagen"])
def test_it_finds_the_truth_where_the_data_excite_it(key, prepared):
    """Without noise fast feedback settles in a few passes; the truth has any sign, so no bounds."""
    problem, truth = prepared(key, 1500)
    gains = ByExcitation(settling=10.0, ridge=1e-6)
    method = RobustIdentifier(gamma=gains, limits=None, passes=40)
    fit = method.identify(problem, truth.model)
    assert fit.status is hd.Status.SETTLED
    np.testing.assert_allclose(fit.damping.coefficients, truth.coefficients, rtol=1e-3)


def test_gain_matrices_make_all_directions_settle_alike(prepared):
    """Gamma C has eigenvalues of a / settling but for the ridge, where C is well conditioned."""
    problem, truth = prepared("linear")
    method = RobustIdentifier(gamma=ByExcitation(settling=50.0, ridge=1e-9))
    bound = method.bind(problem, truth.model)
    entries, a = bound.robustness.entries, bound.robustness.a
    moments = second_moments(problem)
    xi = problem.regressor()
    np.testing.assert_allclose(moments, xi.T @ xi / len(xi), rtol=1e-10, atol=1e-14)
    for axis, gain in enumerate(entries.squares(bound.robustness.gains)):
        rows = entries.rows[entries.of(axis)]
        rates = np.linalg.eigvals(gain @ moments[np.ix_(rows, rows)])
        np.testing.assert_allclose(rates, a[axis] / 50.0, rtol=1e-5)


def test_fast_feedback_goes_by_the_step(prepared):
    problem, truth = prepared("linear", 90)
    a = RobustIdentifier(a=ByStep(30.0)).bind(problem, truth.model).robustness.a
    assert median_step(problem) == pytest.approx(0.1)
    np.testing.assert_allclose(a, 30.0 / 0.1 * np.diag(problem.vehicle.mass_matrix))


def test_a_term_that_is_zero_throughout_stays_put(vehicle):
    rng = np.random.default_rng(1)
    velocity = rng.normal(size=(60, 6)) * [1, 1, 1, 0, 1, 1]
    log = hd.Log.from_arrays(
        np.arange(60) / 10, velocity, attitude=np.zeros((60, 3)), wrench=np.zeros((60, 6))
    )
    model = hd.DampingModel.from_table({"X": "u p", "K": "p"}, key="mine")
    fit = hd.identify(model, vehicle, log, RobustIdentifier(limits=None, project=OntoDissipative()))
    assert fit.damping["X_p"] == 0.0
    assert fit.damping["K_p"] == -1.0


def test_leakage_leads_back_to_the_reference_at_its_rate(vehicle):
    """Nothing is excited, so each step shrinks the distance by (1 - hs/2) / (1 + hs/2)."""
    n, rate = 101, 0.3
    still = hd.Log.from_arrays(
        np.arange(n) / 10, np.zeros((n, 6)), attitude=np.zeros((n, 3)), wrench=np.zeros((n, 6))
    )
    model, given = hd.catalog["fossen"], {"X_u": -9.0, "N_r": -4.0}
    reference = hd.Damping.from_dict(None, given)
    flat = replace(vehicle, center_of_gravity=(0.0, 0.0, 0.0))
    problem = hd.prepare(flat, still, model)
    method = replace(NEUTRAL, leakage=rate, reference=reference)
    state = method.init(problem, model, problem.inputs.sample(0))
    assert state.damping["X_u"] == -9.0
    away = replace(state.adapting, coefficients=state.adapting.coefficients + 2.0)
    state = replace(state, adapting=away)
    for k in range(1, n):
        state = method.step(state, problem.inputs.sample(k))
    shrunk = ((1 - 0.05 * rate) / (1 + 0.05 * rate)) ** (n - 1)
    expected = method.init(problem, model, problem.inputs.sample(0)).damping.coefficients
    np.testing.assert_allclose(state.damping.coefficients, expected + 2.0 * shrunk, rtol=1e-9)


def test_the_dead_zone_has_the_size_that_noise_makes(prepared):
    """The root of the sum of M_ii sigma_i^2, with sigma from fourth differences."""
    problem, truth = prepared("linear", 90)
    bound = replace(NEUTRAL, dead_zone=3.0).bind(problem, truth.model)
    variance = problem.inputs.velocity.var(axis=0) / signal_to_noise(problem)
    expected = 3.0 * np.sqrt(variance @ np.diag(problem.vehicle.mass_matrix))
    assert bound.robustness.dead_zone == pytest.approx(expected)
    asleep = replace(NEUTRAL, dead_zone=1e9).identify(problem, truth.model)
    np.testing.assert_array_equal(asleep.damping.matrix, -np.eye(6))


def test_bounds_are_kept_and_named_by_label(prepared):
    problem, truth = prepared("fossen", 600)
    wrong = [label for label in truth.model.labels if truth[label] > 0.0]
    assert wrong  # the truth drives on some axes; the bound says it must not
    method = replace(NEUTRAL, gamma=hd.ByTerm(5.0), passes=5)
    free = method.identify(problem, truth.model).damping
    kept = replace(method, limits=OwnDrag()).identify(problem, truth.model).damping
    assert max(free.coefficients) > 0.0
    assert max(kept.coefficients) <= 0.0
    narrow = replace(method, limits=Within((("X_u", -0.4, 0.2), ("N_r", -np.inf, -3.0))))
    found = narrow.identify(problem, truth.model).damping
    assert -0.4 <= found["X_u"] <= 0.2
    assert found["N_r"] <= -3.0
    with pytest.raises(hd.MethodError, match="X_u must not exclude"):
        Within((("X_u", 1.0, 0.0),))


def test_a_projection_is_applied_to_the_result(prepared):
    problem, truth = prepared("linear", 600)
    method = RobustIdentifier(limits=None, passes=2)
    free = method.identify(problem, truth.model).damping
    kept = replace(method, project=OntoDissipative()).identify(problem, truth.model).damping
    box = hd.operating_box(problem)
    size = hd.worst_power(free, box).power
    assert size > 0.0
    assert hd.worst_power(kept, box).power < 1e-3 * size


def test_damping_that_dissipates_is_left_alone(prepared):
    problem, _ = prepared("fossen", 90)
    model = hd.catalog["fossen"]
    damping = hd.Damping(model, -np.ones(model.n_coefficients))
    metric = np.eye(model.n_coefficients)
    assert OntoDissipative()(problem, damping, metric) is damping


def test_metrics_of_gains_that_hold_a_coefficient():
    gain = np.array([[4.0, 0.0, 2.0], [0.0, 0.0, 0.0], [2.0, 0.0, 3.0]])
    found = inverted(gain)
    np.testing.assert_allclose(found[[0, 2]][:, [0, 2]], np.linalg.inv(gain[[0, 2]][:, [0, 2]]))
    assert not found[1].any()
    metric = joined([found, np.zeros((1, 1))])
    np.linalg.cholesky(metric)
    assert metric[1, 1] == metric[3, 3] == pytest.approx(np.diag(found)[[0, 2]].mean())
    np.testing.assert_array_equal(joined([np.zeros((2, 2))]), np.eye(2))


def test_the_mean_is_that_of_the_last_pass_over_time(prepared):
    problem, truth = prepared("linear", 90)
    method = replace(NEUTRAL, passes=3, tail=0.25)
    history = method.history(problem, truth.model)
    steps = len(history.time) // 3
    last = history.coefficients[3 * steps - round(0.25 * steps) :]
    expected = last.mean(axis=0)  # an even clock
    found = method.identify(problem, truth.model).damping.coefficients
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)
    assert method.history(problem, truth.model, every=10).time.shape == (3 * (steps // 10),)
    with pytest.raises(hd.MethodError, match="at least 1"):
        method.history(problem, truth.model, every=0)


def test_unsettled_coefficients_say_so(prepared):
    problem, truth = prepared("linear", 300)
    slow = replace(NEUTRAL, gamma=0.05)
    assert slow.identify(problem, truth.model).status is hd.Status.NOT_SETTLED
    twice = replace(slow, passes=2)
    assert twice.identify(problem, truth.model).status is hd.Status.NOT_SETTLED


def test_outcomes_that_are_no_numbers(vehicle):
    n = 20
    wrench = np.zeros((n, 6))
    wrench[:, 0] = 1.5e308
    log = hd.Log.from_arrays(
        np.arange(n) / 10, np.ones((n, 6)), attitude=np.zeros((n, 3)), wrench=wrench
    )
    with np.errstate(all="ignore"):
        fit = hd.identify(hd.catalog["coe"], vehicle, log, RobustIdentifier())
    assert fit.status is hd.Status.FAILED
    planar = replace(vehicle, axes=("X", "Y", "N"), center_of_gravity=(0.0, 0.0, 0.0))
    quiet = replace(log, wrench=np.zeros((n, 6)))
    rolling = hd.DampingModel.from_table({"K": "p"}, key="roll")
    assert hd.identify(rolling, planar, quiet, RobustIdentifier()).status is hd.Status.EMPTY
    single = hd.Log.from_arrays(
        np.array([0.0, 0.1]), np.ones((2, 6)), attitude=np.zeros((2, 3)), wrench=np.zeros((2, 6))
    )
    once = replace(NEUTRAL, a=20.0)
    assert hd.identify(hd.catalog["coe"], vehicle, single, once).status.usable


def test_locked_axes_and_empty_rows_are_left_out(vehicle, exact_log):
    """In the plane: the model's heave, roll and pitch rows are dropped."""
    truth = hd.Damping.from_dict(None, {"X_u": -3.0, "Y_v": -20.0, "K_p": -1.0, "N_r": -5.0})
    planar = replace(vehicle, axes=("X", "Y", "N"), center_of_gravity=(0.0, 0.0, 0.0))
    log = exact_log(truth, n=600)
    fit = hd.identify(truth.model, planar, log, RobustIdentifier())
    assert fit.model.labels == ("X_u", "Y_v", "N_r")
    assert np.isfinite(fit.damping.coefficients).all()


@pytest.mark.parametrize("method", [RobustIdentifier(a=1.0), RecursiveLeastSquares()])
def test_absurd_commands_are_said_to_be_absurd(vehicle, method):
    n = 20
    log = hd.Log.from_arrays(
        np.arange(n) / 10,
        np.ones((n, 6)),
        attitude=np.zeros((n, 3)),
        wrench=np.zeros((n, 6)),
        commands={"fin": np.full(n, 1e200)},
    )
    model = hd.DampingModel.from_table({"X": "u", "N": "u|u|*fin"}, key="mine")
    with np.errstate(all="ignore"), pytest.raises(hd.MethodError, match="not finite"):
        hd.identify(model, vehicle, log, method)


@pytest.mark.parametrize(
    "settings",
    [
        {"a": -1.0},
        {"gamma": (1.0, 2.0)},
        {"leakage": -0.1},
        {"dead_zone": np.nan},
        {"passes": 0},
        {"passes": 1.5},
        {"tail": 1.1},
    ],
)
def test_settings_that_make_no_sense_are_refused(settings):
    with pytest.raises(hd.MethodError, match=next(iter(settings))):
        RobustIdentifier(**settings)


@pytest.mark.parametrize("settings", [{"settling": 0.0}, {"ridge": -1.0}])
def test_gains_by_excitation_must_be_positive(settings):
    with pytest.raises(hd.MethodError, match="positive"):
        ByExcitation(**settings)
    with pytest.raises(hd.MethodError, match="positive"):
        ByStep(0.0)


@pytest.mark.parametrize(
    "settings", [{"a": ByStep()}, {"gamma": ByExcitation()}, {"dead_zone": 1.0}]
)
def test_settings_by_data_need_a_log(prepared, settings):
    problem, truth = prepared("linear", 90)
    NEUTRAL.bind(problem.columns, truth.model)
    with pytest.raises(hd.MethodError, match="from a log"):
        replace(NEUTRAL, **settings).bind(problem.columns, truth.model)
