"""Laws of all methods, or of all that work online: statuses, and online as in a batch."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError, OutlierWarning, ProblemError
from hydrodamp.identification.regression import PointwiseRegression
from hydrodamp.identification.weak_form import WeakRegression

LINEAR, ROWS = hd.catalog["linear"], PointwiseRegression()
ONLINE = [
    hd.AdaptiveIdentifier(a=20, gamma=20, passes=1),
    hd.CompositeIdentifier(memory=20.0),
    hd.RecursiveLeastSquares(block=1.0, memory=300.0),
]
ALL = [hd.find_method(key) for key in hd.METHODS]


def by_key(method):
    return method.key


@pytest.mark.parametrize("key", ["linear", "fossen", "prestero"])
@pytest.mark.parametrize(
    ("method", "rtol"),
    [
        (hd.CompositeIdentifier(), 1e-5),
        (hd.WeakForm(WeakRegression(windows=())), 1e-9),
        (hd.WeakForm(), 0.05),
        (hd.Ridge(), 0.05),
    ],
)
def test_true_coefficients_are_recovered_from_exact_data(key, method, rtol, prepared, true_damping):
    """In one pass, to the rounding of the midpoint rule where nothing is smoothed."""
    truth = true_damping(hd.catalog[key])
    fit = method.identify(prepared(truth.model, n=1500), truth.model)
    assert fit.status is hd.Status.OK
    np.testing.assert_allclose(fit.damping.coefficients, truth.coefficients, rtol=rtol)


@pytest.mark.parametrize("method", ONLINE, ids=by_key)
@pytest.mark.parametrize("key", ["linear", "gertler-hagen"])
def test_batch_is_the_fold_of_the_online_step_bit_for_bit(key, method, prepared):
    model = hd.catalog[key]
    problem = prepared(model, n=120)
    starts = set(problem.segments[:, 0].tolist())
    state = method.init(problem, model, problem.inputs.sample(0))
    for k in range(1, problem.n_samples):
        sample = problem.inputs.sample(k)
        state = state.restart(sample) if k in starts else method.step(state, sample)
    fit = method.identify(problem, model)
    np.testing.assert_array_equal(state.damping.coefficients, fit.damping.coefficients)
    assert state.damping.vehicle == fit.damping.vehicle
    arrays = [each for each in vars(state).values() if isinstance(each, np.ndarray)]
    assert not any(each.flags.writeable for each in arrays)
    with pytest.raises(ProblemError, match="time must advance"):
        method.step(state, problem.inputs.sample(3))


@pytest.mark.parametrize("method", ONLINE[1:], ids=by_key)
def test_settings_by_term_need_a_log(method, prepared):
    with pytest.raises(MethodError, match="from a log"):
        method.bind(prepared(LINEAR, n=30).equations, LINEAR)


@pytest.mark.parametrize(
    "method",
    [
        hd.LeastSquares(),
        hd.Ridge(ROWS),
        hd.Ridge(ROWS, prior=hd.published["vt690-sname2022"]),
        hd.Dissipative(ROWS),
    ],
)
def test_too_few_samples_are_a_status(method, vehicle, exact_log, true_damping):
    log = exact_log(true_damping(LINEAR), n=30)
    fit = hd.identify(hd.catalog["mcfarland-whitcomb"], vehicle, log, method)
    assert fit.status is hd.Status.TOO_FEW_SAMPLES
    assert not fit.status.usable
    assert hd.identify(LINEAR, vehicle, log, hd.LeastSquares()).status is hd.Status.OK


@pytest.mark.parametrize("method", ALL, ids=by_key)
def test_a_model_without_a_term_on_the_free_axes_is_a_status(method, vehicle):
    log = hd.Log.from_arrays(
        np.arange(30) / 10, {"p": np.ones(30)}, attitude=np.zeros((30, 3)), wrench=np.zeros((30, 6))
    )
    rolling = replace(vehicle, axes=("K",))
    fit = hd.identify(hd.catalog["pitch-yaw"], rolling, log, method)  # its K row is empty
    assert fit.status is hd.Status.EMPTY
    assert not fit.status.usable


@pytest.mark.parametrize(
    "method", [hd.AdaptiveIdentifier(), hd.LeastSquares(), hd.RecursiveLeastSquares(block=0.2)]
)
def test_numbers_beyond_float64_are_a_status(method, vehicle):
    """The sum of two wrenches of 1.5e308 N overflows: the outcome is a status, not a crash."""
    wrench = np.outer(np.full(20, 1.5e308), np.eye(6)[0])
    log = hd.Log.from_arrays(
        np.arange(20) / 10, np.ones((20, 6)), attitude=np.zeros((20, 3)), wrench=wrench
    )
    with np.errstate(all="ignore"), pytest.warns(OutlierWarning, match="`X`: 20 of 20"):
        fit = hd.identify(hd.catalog["coe"], vehicle, log, method)
    assert fit.status is hd.Status.FAILED
    assert np.isnan(fit.damping.coefficients).all()


def test_a_log_shorter_than_the_first_row_is_a_status(vehicle, exact_log, true_damping):
    problem = hd.prepare(vehicle, exact_log(true_damping(LINEAR), n=30).between(0.0, 0.9), LINEAR)
    fit = hd.RecursiveLeastSquares(block=1.0).identify(problem, LINEAR)
    assert fit.status is hd.Status.TOO_FEW_SAMPLES
