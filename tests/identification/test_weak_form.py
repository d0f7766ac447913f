"""The weak form: exact for its quadrature, selection of the support, remarks."""

import numpy as np
import pytest

import hydrodamp as hd
import oracle
from hydrodamp.errors import MethodError
from hydrodamp.identification.differentiation import smooth_velocity
from hydrodamp.identification.least_squares import WeakForm
from hydrodamp.identification.weak_form import (
    WeakRegression,
    iterate_test_functions,
    select_support,
    step_equations,
    variance_inflation,
)

LINEAR = hd.catalog["linear"]
PUSHED = hd.DampingModel.from_table({"X": "u push"}, key="pushed")
AS_MEASURED = WeakRegression(windows=())


def surge_log(velocity, time=None, **more):
    """A log of surge alone."""
    n = len(velocity)
    motion = np.outer(velocity, [1, 0, 0, 0, 0, 0])
    clock = np.arange(n) / 10 if time is None else time
    return hd.Log.from_arrays(clock, motion, attitude=np.zeros((n, 3)), **more)


def jerky_clock(n, seed):
    return np.cumsum(np.random.default_rng(seed).choice([0.1, 0.2], n))


@pytest.fixture
def linear_problem(vehicle, exact_log, true_damping):
    damping = true_damping(LINEAR)
    return hd.prepare(vehicle, exact_log(damping), LINEAR), damping


def pushed_problem(vehicle, seed=3, n=600, **more):
    """M du/dt = -30 u + push by the midpoint rule, the push held, on an irregular clock."""
    rng, mass = np.random.default_rng(seed), vehicle.mass_matrix[0, 0]
    time, push = jerky_clock(n, seed), rng.uniform(-20, 20, n)
    velocity = np.zeros(n)
    for k, h in enumerate(np.diff(time)):
        half = 15.0 * h / mass
        velocity[k + 1] = (velocity[k] * (1 - half) + push[k] * h / mass) / (1 + half)
    log = surge_log(velocity, time, commands={"push": push}, **more)
    return hd.prepare(vehicle, log, PUSHED)


class TestSteps:
    """Equation 1 from sample to sample."""

    def test_step_equations_are_those_of_the_adaptive_identifier(self):
        """Held fins and propeller, term by term, as the NumPy reference of the core takes them."""
        campaign = hd.reenact(duration=3.0)
        problem = hd.prepare(campaign.vehicle, campaign.train, hd.catalog["gertler-hagen"])
        inputs = problem.inputs.select(slice(0, 31))
        expected = oracle.steps_between(problem.equations.plant, inputs)
        design, target = step_equations(problem, 0, 31, problem.inputs.velocity)
        n_known = problem.equations.n_known
        np.testing.assert_allclose(design, expected.xi[:, n_known:], rtol=1e-12)
        known = expected.xi[:, :n_known] @ problem.equations.known
        residual = expected.gain / expected.h[:, None] - expected.forcing - known
        np.testing.assert_allclose(target, residual, rtol=1e-9, atol=1e-9)


class TestBumps:
    """Positions of test functions and weights of steps."""

    @pytest.mark.parametrize("support", [0.05, 0.7, 3.0, 40.0])
    def test_weights_are_the_integral_of_the_bump_over_each_step(self, support):
        time = jerky_clock(400, 4)
        for bumps in iterate_test_functions(time, support, 4):
            np.testing.assert_allclose(bumps.weights.sum(axis=1), 1.0, rtol=1e-12)
            middle = len(bumps.centres) // 2
            fine = np.linspace(-0.5, 0.5, 20_001) * support + bumps.centres[middle]
            height = (1 - (2 * (fine - bumps.centres[middle]) / support) ** 2) ** 2
            edges = time[bumps.start : bumps.stop]
            expected = np.histogram(fine, edges, weights=height)[0] / height.sum()
            weights = bumps.weights.toarray()[middle]
            np.testing.assert_allclose(weights, expected, atol=2e-4)

    def test_spacing_is_uniform_across_chunks(self):
        time = np.arange(30_000) / 10
        centres = np.concatenate([bumps.centres for bumps in iterate_test_functions(time, 2.0, 4)])
        np.testing.assert_allclose(np.diff(centres), 0.5, rtol=1e-9)
        assert centres[0] - 1.0 == pytest.approx(time[-1] - centres[-1] - 1.0, abs=1e-6)

    def test_variance_inflation_is_the_sum_of_overlaps(self):
        s = np.linspace(-1, 1, 4001)
        phi = (1 - s**2) ** 2
        lags = [np.sum(phi[500 * j :] * phi[: len(phi) - 500 * j]) for j in range(9)]
        assert variance_inflation(8) == pytest.approx(1 + 2 * sum(lags[1:]) / lags[0], rel=1e-3)
        assert variance_inflation(1) == 1.0


class TestWeakForm:
    """Estimates."""

    def test_joins_are_never_crossed(self, bare):
        """A jump of the velocity between segments leaves no trace."""
        logs = [pushed_problem(bare, seed=seed, n=300).log for seed in (3, 8)]
        velocity = np.concatenate([logs[0].velocity, logs[1].velocity + 3.0 * np.eye(6)[0]])
        push = [log.command("push") for log in logs]
        log = hd.Log.from_arrays(
            np.concatenate([logs[0].time, logs[0].time[-1] + 0.1 + logs[1].time]),
            velocity,
            attitude=np.zeros((600, 3)),
            commands={"push": np.concatenate([push[0], push[1] + 90.0])},
            segment=np.repeat(["a", "b"], 300),
        )
        fit = WeakForm(AS_MEASURED).identify(hd.prepare(bare, log, PUSHED), PUSHED)
        np.testing.assert_allclose(fit.damping.coefficients, [-30.0, 1.0], rtol=1e-9)

    def test_all_models_share_one_triangle(self, vehicle, exact_log, true_damping):
        models = (LINEAR, hd.catalog["fossen"])
        problem = hd.prepare(vehicle, exact_log(true_damping(LINEAR)), models)
        fits = WeakForm().identify_all(problem, models)
        for fit, model in zip(fits, models, strict=True):
            expected = WeakForm().identify(problem, model).damping.coefficients
            np.testing.assert_array_equal(fit.damping.coefficients, expected)


class TestChoice:
    """Support and smoothing windows are selected from the log and reported."""

    def noisy(self, level, n=4000, rate=1.0):
        time = np.arange(n) / 10
        rng = np.random.default_rng(2)
        velocity = np.sin(rate * time) + np.sin(0.31 * rate * time)
        return surge_log(velocity + level * rng.standard_normal(n), wrench=np.zeros((n, 6)))

    def test_more_noise_gives_a_longer_support(self, bare):
        logs = [self.noisy(level) for level in (0.0, 0.03, 0.1, 0.6)]
        lengths = [select_support(hd.prepare(bare, log, LINEAR))[0] for log in logs]
        assert lengths == sorted(lengths)
        assert lengths[0] == pytest.approx(0.4)
        assert lengths[-1] > 4 * lengths[0]

    def test_a_vehicle_at_rest_has_noise_alone(self, bare):
        noise = 0.01 * np.random.default_rng(0).standard_normal(1000)
        problem = hd.prepare(bare, surge_log(noise, wrench=np.zeros((1000, 6))), LINEAR)
        assert select_support(problem)[1] == 1.0

    def test_short_segments_bound_the_support(self, bare):
        """Ten seconds of strong noise: a quarter of that at most."""
        length, noise = select_support(hd.prepare(bare, self.noisy(0.5, n=101, rate=0.5), LINEAR))
        assert length <= 2.5 * (1 + 1e-12)
        assert noise > 0.1

    @pytest.mark.slow
    def test_a_longer_log_has_the_same_support(self, bare):
        """Five hours: the motion determines the support, not the length of the log."""
        logs = [self.noisy(0.1, n=n) for n in (4_000, 200_000)]
        lengths = [select_support(hd.prepare(bare, log, LINEAR))[0] for log in logs]
        assert lengths[1] == pytest.approx(lengths[0], rel=0.2)

    def test_windows_follow_the_noise(self, bare):
        clean, noisy = (hd.prepare(bare, self.noisy(level), LINEAR) for level in (0.0, 0.1))
        change = smooth_velocity(clean, (5, 9, 15))[0] - clean.inputs.velocity
        assert np.std(change[:, 0]) < 1e-3 * np.std(clean.inputs.velocity[:, 0])
        assert smooth_velocity(noisy, ())[1] == (1,) * 6
        velocity, windows, _ = smooth_velocity(noisy, (5, 9, 15))
        assert windows[0] > 1
        exact = clean.inputs.velocity
        errors = [np.std(v - exact) for v in (velocity, noisy.inputs.velocity)]
        assert errors[0] < 0.6 * errors[1]

    def test_support_and_smoothing_are_reported(self, bare):
        log = self.noisy(0.1, n=1000)
        segment = np.where(np.arange(1000) < 5, "short", "long")
        cut = surge_log(log.velocity[:, 0], wrench=log.wrench, segment=segment)
        problem = hd.prepare(bare, cut, LINEAR)
        fit = WeakForm(WeakRegression(2.0)).identify(problem, LINEAR)
        assert "span 2 s (20 samples). 1 shorter" in fit.remarks[0]
        assert "smoothed" in fit.remarks[1]
        assert fit.n_samples == 995


def test_a_support_longer_than_every_segment_is_refused(linear_problem):
    problem, _ = linear_problem
    with pytest.raises(MethodError, match="no segment of the log is as long"):
        WeakForm(WeakRegression(support=1e4)).identify(problem, LINEAR)
