"""Froude similitude: a larger vehicle and its log have the same dimensionless results.

Lengths scale by λ, times and speeds by √λ, masses and forces by λ³; gravity and density do not
change. Adaptive identifiers are not here: their initial coefficients are the paper's, in SI units.
"""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.identifiability import grade_fit
from similitude import coefficient_scales, record_wrench, scale_log, scale_vehicle

RATIOS = (0.1, 10.0, 160.0)
REPLAY_ROUNDING = 1e-3  # Runge-Kutta steps do not grow beyond 0.05 s
MODEL = hd.catalog["prestero"]
METHODS = {
    **{key: hd.find_method(key) for key in ("ls", "weak", "ridge", "dissipative")},
    "oe": hd.OutputError(),
    "recommended": hd.Recommended(),
    "rls": hd.RecursiveLeastSquares(start=hd.Damping(MODEL, np.zeros(MODEL.n_coefficients))),
}


@pytest.fixture(scope="module")
def campaign():
    """A vehicle without actuators, and two logs with the wrench."""
    made = hd.reenact(seed=1, duration=40.0)
    logs = (record_wrench(made.vehicle, log) for log in (made.train, made.test))
    return scale_vehicle(made.vehicle, 1.0), *logs


@pytest.fixture(scope="module")
def results(campaign):
    """Identify with a method at a ratio, once: the fit, its grades and its replay."""
    kept = {}

    def result(key, ratio):
        if (key, ratio) not in kept:
            vehicle = scale_vehicle(campaign[0], ratio)
            train, test = (scale_log(log, ratio) for log in campaign[1:])
            problem = hd.prepare(vehicle, train, [MODEL])
            fit = METHODS[key].identify(problem, MODEL)
            grades = grade_fit(problem, fit).grades
            step = min(0.05, 0.05 * np.sqrt(ratio))
            replay = hd.simulate(vehicle, fit.damping, test, max_step=step)
            error = replay.velocity - test.velocity
            kept[key, ratio] = fit, grades, np.sqrt(np.mean(error**2, axis=0))
        return kept[key, ratio]

    return result


@pytest.mark.slow
@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("key", METHODS)
def test_coefficients_intervals_grades_and_replays_scale(results, key, ratio):
    (fit, grades, error), (reference, expected_grades, expected_error) = (
        results(key, each) for each in (ratio, 1.0)
    )
    scales = coefficient_scales(MODEL, ratio)
    np.testing.assert_allclose(
        fit.damping.coefficients / scales, reference.damping.coefficients, rtol=1e-6, atol=1e-9
    )
    assert (fit.status, fit.rank, grades) == (reference.status, reference.rank, expected_grades)
    if reference.uncertainty is not None:
        assert fit.uncertainty is not None
        ratio_of_errors = fit.uncertainty.standard_errors / reference.uncertainty.standard_errors
        np.testing.assert_allclose(ratio_of_errors, scales, rtol=1e-6)
    root = np.sqrt(ratio)
    speeds = np.repeat([root, 1.0 / root], 3)
    np.testing.assert_allclose(error / speeds, expected_error, rtol=REPLAY_ROUNDING)
