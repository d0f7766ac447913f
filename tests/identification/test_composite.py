"""The composite identifier: its proof, online equals batch and NumPy, one pass finds the truth."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.differentiation import regressor_mean_square
from hydrodamp.identification.weak_form import step_equations

LINEAR = hd.catalog["linear"]
METHOD = hd.CompositeIdentifier(memory=20.0)


def states(method, problem, model):
    """Yield the state after every sample of a log."""
    starts = set(problem.segments[:, 0].tolist())
    state = method.init(problem, model, problem.inputs.sample(0))
    for k in range(1, problem.n_samples):
        sample = problem.inputs.sample(k)
        state = state.restart(sample) if k in starts else method.step(state, sample)
        yield state


@pytest.mark.slow
@pytest.mark.parametrize("memory", [5.0, np.inf])
@pytest.mark.parametrize("block", [0.3, 2.1])
@pytest.mark.parametrize("seed", [3, 4])
def test_the_lyapunov_function_never_grows(seed, block, memory, driven, discrete_log, true_damping):
    """V does not grow over any step, whatever its length, the truth and the initial estimate."""
    model = hd.catalog["prestero"]
    truth = true_damping(model, seed=seed)
    problem = hd.prepare(driven, discrete_log(truth, n=600), model)
    start = hd.Damping(model, np.random.default_rng(seed).normal(size=model.n_coefficients) * 30.0)
    method = hd.CompositeIdentifier(memory=memory, start=start, block=block)
    law = method.bind(problem, model).settings
    free, energies = problem.vehicle.free, []
    for state in states(method, problem, model):
        error = state.coefficients - truth.coefficients
        scaled = np.divide(error, law.unit, out=np.zeros(len(error)), where=law.unit > 0.0)
        momentum = (problem.vehicle.mass_matrix @ state.velocity_error)[free]
        now = 0.5 * momentum @ state.velocity_error[free]
        for axis in range(6):
            part = scaled[law.starts[axis] : law.starts[axis + 1]]
            gain = np.eye(len(part)) + law.information(axis, state.values)
            now += 0.5 * part @ gain @ part / law.gamma[axis]
        energies.append(now)
    rounding = 1e-9 * np.array(energies[:-1]) + 1e-24 * energies[0]
    assert np.all(np.diff(energies) <= rounding)
    assert energies[-1] < 1e-3 * energies[0]


def test_the_core_takes_the_steps_of_a_numpy_loop(driven, discrete_log, true_damping):
    model, kappa = hd.catalog["fossen"], 1.0
    problem = hd.prepare(driven, discrete_log(true_damping(model), n=150), model)
    bound = METHOD.bind(problem, model)
    law, mass = bound.settings, driven.mass_matrix
    n_known, keep = problem.equations.n_known, 1.0 - law.forgetting
    matrix = bound.table[n_known:].copy()
    index = [slice(*law.starts[axis : axis + 2]) for axis in range(6)]
    rows = [law.rows[each] - n_known for each in index]
    unit = [law.unit[each] for each in index]
    s = [np.zeros((len(each), len(each))) for each in rows]
    old, q = [each.copy() for each in s], [np.zeros(len(each)) for each in rows]
    for first, stop in problem.segments.tolist():
        design, target = step_equations(problem, first, stop, problem.inputs.velocity)
        error, terms, right, elapsed = np.zeros(6), np.zeros(design.shape[1]), np.zeros(6), 0.0
        for x, y, h in zip(design, target, np.diff(problem.inputs.time[first:stop]), strict=True):
            gain = [
                law.gamma[i] * unit[i] * np.linalg.solve(np.eye(len(u)) + old[i], u * x[rows[i]])
                for i, u in enumerate(unit)
            ]
            stiffness = np.array([gain[i] @ x[rows[i]] for i in range(6)])
            lhs = 2.0 / h * mass + np.diag(law.a + 0.5 * h * stiffness)
            middle = np.linalg.solve(lhs, 2.0 / h * mass @ error + x @ matrix - y)
            error = 2.0 * middle - error
            share = law.rate * h / (1.0 + law.rate * h)
            terms, right = terms + share * (x - terms), right + share * (y - right)
            elapsed += h
            is_end = elapsed + h / 2 >= law.block
            for i, u in enumerate(unit):
                matrix[rows[i], i] -= h * gain[i] * middle[i]
                phi = u * terms[rows[i]]
                s[i] += h / law.block * np.outer(phi, phi)
                q[i] += h / law.block * phi * right[i]
                if is_end and len(u):
                    lag = q[i] - s[i] @ (matrix[rows[i], i] / u)
                    left = np.eye(len(u)) + old[i] + kappa * s[i]
                    matrix[rows[i], i] += u * np.linalg.solve(left, kappa * lag)
                    old[i], s[i], q[i] = s[i].copy(), keep * s[i], keep * q[i]
            elapsed = 0.0 if is_end else elapsed
    expected = matrix[law.rows - n_known, law.axes]
    fit = METHOD.identify(problem, model)
    np.testing.assert_allclose(fit.damping.coefficients, expected, rtol=1e-7)


@pytest.mark.slow
def test_one_pass_replays_within_half_again_of_least_squares():
    """With sensor noise; a filter of half the correlation time is 1.6 to 1.8 times as far off."""
    campaign = hd.reenact(seed=2)
    models = [hd.catalog[key] for key in ("linear", "prestero", "fossen")]
    problem = hd.prepare(campaign.vehicle, campaign.train, models)

    def errors(method):
        fits = hd.identify_all(problem, models, method)
        rows = hd.compare(fits, campaign.vehicle, campaign.test).rows
        return np.array([np.inf if row.rms is None else row.rms for row in rows])

    one_pass = errors(hd.CompositeIdentifier())
    assert np.all(np.isfinite(one_pass))
    assert np.all(one_pass <= 1.5 * errors(hd.LeastSquares()))


def test_the_prior_holds_ten_typical_blocks_and_no_more_than_the_memory(prepared):
    problem = prepared(LINEAR, n=120)
    law = hd.CompositeIdentifier(block=0.8).bind(problem, LINEAR).settings
    square = regressor_mean_square(problem)[law.rows - problem.equations.n_known]
    excited = square > 0.0
    np.testing.assert_allclose((law.unit**-2.0)[excited], 10.0 * square[excited])
    short = hd.CompositeIdentifier(block=0.8, memory=1.6).bind(problem, LINEAR).settings
    np.testing.assert_allclose((short.unit**-2.0)[excited], 2.0 * square[excited])
    assert law.rate == pytest.approx(8.0 / 0.8)
