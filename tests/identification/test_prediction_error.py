"""Prediction errors of the filter: noise, efficiency under pushes, and score tests of the form."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import kstest

import hydrodamp as hd
from hydrodamp.identification.adequacy import Adequacy, Form, ScoreTest
from hydrodamp.identification.continuation import make_objective
from hydrodamp.identification.held_out_replay import information_uncertainty
from hydrodamp.identification.prediction_error import (
    FilteredOutputs,
    estimate_noise,
    filter_windows,
    initial_noise,
    project_states,
)
from hydrodamp.identification.score_test import further_terms
from hydrodamp.kernels.kalman import Noise
from hydrodamp.simulation.campaign.conditions import Conditions, true_damping
from hydrodamp.simulation.campaign.reenact import CampaignSetup

MODEL = hd.catalog["prestero"].with_terms({"K": "up"}, key="truth")
TAU = 2.0
PUSH = np.array([0.5, 0.55, 0.12, 0.0005, 0.08, 0.36])


class Pushed(Conditions):
    """Ornstein-Uhlenbeck pushes of the published strength, with white errors of the sensors."""

    def sample_disturbances(self, seed, n_runs, n_samples, period=0.1):
        rng, decay = np.random.default_rng(seed), np.exp(-period / TAU)
        pushes = rng.standard_normal((n_samples, n_runs, 6))
        for k in range(1, n_samples):
            pushes[k] = decay * pushes[k - 1] + np.sqrt(1.0 - decay**2) * pushes[k]
        return pushes * PUSH


@pytest.fixture(scope="module")
def truth():
    values = true_damping().as_dict()
    return np.array([values.get(label, 0.0) for label in MODEL.labels])


def simulate(conditions):
    (campaign,) = CampaignSetup.of("sname").simulate(range(3, 4), 45.0, conditions)
    return hd.prepare(campaign.vehicle, replace(campaign.train, acceleration=None), MODEL)


@pytest.fixture(scope="module")
def pushed():
    return simulate(Pushed())


@pytest.fixture(scope="module")
def objective(pushed):
    return make_objective(pushed, MODEL)


@pytest.fixture(scope="module")
def noise(objective, truth):
    return estimate_noise(objective, truth, initial_noise(objective))


@pytest.mark.slow
def test_the_likelihood_finds_strength_and_time_constant_of_the_pushes(noise):
    """Four runs of 45 s hold 45 correlation times of 4 s: 15 % of a strength, 2 sigma 30 %."""
    is_strong = PUSH > 0.3  # the others are hidden by the errors of the sensors
    np.testing.assert_allclose(noise.push[is_strong], PUSH[is_strong], rtol=0.35)
    assert 1.0 < noise.time_constant < 4.0


@pytest.mark.slow
def test_a_strength_is_zero_where_nothing_pushes(truth):
    """The estimate of a variance that is zero is zero half of the time (Self and Liang 1987)."""
    objective = make_objective(simulate(Conditions()), MODEL)
    noise = estimate_noise(objective, truth, initial_noise(objective))
    assert np.sum(noise.push == 0.0) >= 3


@pytest.mark.slow
def test_innovations_at_the_truth_are_white_with_variance_one(objective, truth, noise):
    windows = objective.windows(np.inf)
    innovations, _, slopes = filter_windows(windows, truth, noise, windows.entries)
    innovations, _ = project_states(windows, innovations, slopes)
    n = len(innovations)
    np.testing.assert_allclose(np.mean(innovations**2, axis=0), 1.0, atol=4.0 * np.sqrt(2.0 / n))
    lag = np.mean(innovations[1:] * innovations[:-1], axis=0)
    assert np.all(np.abs(lag) < 4.0 / np.sqrt(n))


@pytest.mark.slow
def test_slopes_are_derivatives_of_the_innovations_with_the_gains_held(objective, truth, noise):
    """Without pushes there are no gains on the velocity: differences are exact derivatives."""
    silent = replace(noise, push=np.zeros(6))
    windows = objective.windows(np.inf)
    outputs, std = FilteredOutputs(silent), np.ones(6)
    windows = replace(windows, outputs=outputs)
    label = MODEL.index("N_r|r|")
    step = 1e-5 * abs(truth[label]) * (np.arange(len(truth)) == label)
    ahead, behind = (outputs.averages(windows, truth + each, std) for each in (step, -step))
    slope = (behind - ahead) / (2.0 * step[label])
    column = outputs.linearise(windows, truth, std).columns[:, 6 + label]
    np.testing.assert_allclose(column, slope, atol=1e-6 * np.abs(slope).max())


@pytest.mark.slow
def test_the_objective_of_the_innovations_is_their_likelihood(objective, truth, noise):
    """Mean log residuals differ as ``log |C| + log mean |r|²/2``, also where C follows κ."""
    filtered = replace(objective, outputs=FilteredOutputs(noise), noise_std=np.zeros(6))
    windows, likelihoods, costs = filtered.windows(np.inf), [], []
    for coefficients in (truth, 1.5 * truth):
        innovations, log_std, _ = filter_windows(windows, coefficients, noise)
        spread = 0.5 * np.log(np.mean(innovations**2, axis=0))
        likelihoods.append(log_std.mean(axis=0) + spread)
        costs.append(np.log(filtered.residual_std(coefficients, windows)))
    assert np.ptp(likelihoods, axis=0).max() > 0.01
    np.testing.assert_allclose(np.diff(costs, axis=0), np.diff(likelihoods, axis=0), atol=1e-9)


@pytest.mark.slow
def test_the_estimate_is_efficient_where_an_autopilot_answers_pushes(pushed, objective, truth):
    """Cramer-Rao: the squared errors over their variances have a mean of one."""
    (campaign,) = CampaignSetup.of("sname").simulate(range(3, 4), 45.0, Pushed())
    sensor = np.std(pushed.inputs.velocity - campaign.exact_train.velocity, axis=0)
    noise = Noise(PUSH, sensor, np.full(6, 1e-6), TAU, pushed.inputs.time[1])
    windows = objective.windows(np.inf)
    innovations, _, slopes = filter_windows(windows, truth, noise, windows.entries)
    _, slopes = project_states(windows, innovations, slopes)
    columns = slopes.reshape(-1, len(truth))
    bound = np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)))
    ratio = {}
    for key in ("oe", "recommended"):
        error = hd.find_method(key).identify(pushed, MODEL).damping.coefficients - truth
        ratio[key] = np.sqrt(np.median((error / bound) ** 2))
    assert ratio["recommended"] < 1.4
    assert ratio["recommended"] < 0.8 * ratio["oe"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "form", "term"),
    [(MODEL, Form.ADEQUATE, ""), (hd.catalog["prestero"], Form.EFFECTIVE, "K_")],
)
def test_a_missing_term_is_found_on_its_axis(pushed, model, form, term):
    """The truth has a roll moment of p u, which Prestero's form lacks; predictions allow for it."""
    fit = hd.Recommended().identify(pushed, model)
    adequacy, uncertainty = fit.adequacy, fit.uncertainty
    assert adequacy.form is form
    if form is Form.ADEQUATE:  # the covariance is in proportion to the inverse information
        ratio = uncertainty.covariance / uncertainty.noise
        assert np.ptp(ratio) < 1e-9 * ratio[0, 0]
        assert ratio[0, 0] >= 1.0
        assert not fit.form_errors
    else:
        level, _, std = fit.form_errors["K"]
        assert (level / std) ** 2 > 0.5 * (1.0 - fit.held_out_r_squared["K"])
    least = min(adequacy.tests, key=lambda axis: adequacy.tests[axis].probability)
    assert not term or least == "K"
    assert all(each.startswith(term) for each in adequacy.tests["K"].terms)


def test_the_statistic_is_chi_squared_where_nothing_is_missing():
    rng = np.random.default_rng(1)
    tests = [ScoreTest(float(np.sum(rng.standard_normal(7) ** 2)), 7, 1000) for _ in range(200)]
    assert kstest([each.probability for each in tests], "uniform").pvalue > 0.01
    tiny = ScoreTest(500.0, 10, 100_000)  # of a long log
    assert not any(each.rejects(6) for each in (*tests, tiny))


@pytest.mark.parametrize(
    ("statistic", "r_squared", "form", "axes"),
    [
        (9.0, {"X": 0.2, "N": 0.1}, Form.ADEQUATE, ()),
        (200.0, {"X": 0.9, "N": 0.7}, Form.EFFECTIVE, ("N",)),
        (200.0, {"X": 0.9, "N": 0.3}, Form.INADEQUATE, ("N",)),
    ],
)
def test_the_form_follows_tests_and_held_out_replays(statistic, r_squared, form, axes):
    tests = {"X": ScoreTest(8.0, 9, 2000), "N": ScoreTest(statistic, 10, 2000, ("N_r|u|",))}
    adequacy = Adequacy.judge(tests, dict.fromkeys(r_squared, 0.0), r_squared)
    assert (adequacy.form, adequacy.axes) == (form, axes)
    adequate = "Form: adequate (score tests find nothing missing)."
    assert (str(adequacy) == adequate) == (form is Form.ADEQUATE)
    assert ('N: "r|u|"' in adequacy.describe("linear")[-1]) == (form is not Form.ADEQUATE)


@pytest.mark.parametrize("correlations", [{"X": 0.2}, {"X": np.nan}, {}])
def test_a_form_with_coloured_or_unknown_innovations_is_not_adequate(correlations):
    adequacy = Adequacy.judge({"X": ScoreTest(8.0, 9, 2000)}, correlations, {"X": 0.9})
    assert (adequacy.form, adequacy.axes) == (Form.EFFECTIVE, ("X",))


@pytest.mark.parametrize("r_squared", [{}, dict.fromkeys("XYZKMN", 0.1)])
def test_the_form_is_a_line_with_the_missing_share_of_each_axis_and_the_terms_to_add(
    r_squared, tmp_path
):
    tests = {k: ScoreTest(310.0 - 40 * n, 10, 2000, (f"{k}_u|u|",)) for n, k in enumerate("XYZK")}
    adequacy = Adequacy.judge(tests, {}, r_squared)
    head = "inadequate for u v w p q r" if r_squared else "effective"
    text = f"Form: {head}; missing terms, in % of the unexplained motion: X 15, Y 13, Z 11, K 9."
    form, advice = adequacy.describe("fossen")
    assert form == text
    entry = '{name: more, extends: fossen, terms: {X: "u|u|", Y: "u|u|", Z: "u|u|"}}'
    assert advice.endswith(f"add terms in a model file: `{entry}`.")
    assert "as a set" in advice or r_squared
    (tmp_path / "more.yaml").write_text(entry)
    (model,) = hd.read_models(tmp_path / "more.yaml")
    assert "Z_u|u|" in model.labels


@pytest.mark.parametrize(("share", "is_small"), [(0.05, True), (0.3, False)])
def test_a_small_missing_share_is_named_so(share, is_small):
    tests = {"K": ScoreTest(10.0 + share * 2000, 10, 2000, ("K_p|u|",))}
    advice = Adequacy.judge(tests, {"K": 0.0}, {}).describe("fossen")[1]
    assert ("small compared to noise and pushes" in advice) == is_small


def test_standard_errors_of_an_adequate_form_are_of_no_model_form_error():
    scatter = hd.Uncertainty(np.diag([4.0]), 9.0, "blocks", np.diag([1.0]), 5.0, 10)
    assert "model-form error dominates" in str(scatter)
    adequate = information_uncertainty(np.diag([1.0]), scatter)  # scaled to the scatter
    assert adequate.standard_errors == pytest.approx([2.0])
    assert "model-form" not in str(adequate)


def test_an_axis_with_all_published_terms_is_tested_with_products_of_velocities():
    model = hd.catalog["gertler-hagen"]
    rows = further_terms(model).terms
    assert all(rows)
    assert not set(rows[5]) & set(model.terms[5])
