"""Added mass and buoyancy of a simulated vehicle, estimated from wrong priors."""

import re
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.files import as_json
from hydrodamp.identification.command_response import respond
from hydrodamp.identification.continuation import make_objective
from hydrodamp.identification.fit import correlation
from hydrodamp.identification.fit_files import fit_document, read_fit
from hydrodamp.identification.gauss_newton import Iterate
from hydrodamp.identification.grades import critical_value
from hydrodamp.identification.parameters import (
    VEHICLE_PARAMETERS,
    Parameter,
    rebuild_plant,
    vehicle_parameters,
)
from hydrodamp.identification.rebuilt_outputs import fix_parameters, free_parameters
from hydrodamp.simulation.replay import replay

MODEL = hd.catalog["prestero"]


@pytest.fixture(scope="module")
def simulated():
    """A noisy replay of known damping of the VT 690, whose thrust and fins are known."""
    campaign = hd.reenact(seed=2, duration=60.0)
    problem = hd.prepare(campaign.vehicle, campaign.exact_train, MODEL)
    motion = replay(problem, hd.LeastSquares().identify(problem, MODEL).damping)
    noise = np.random.default_rng(0).standard_normal(motion.velocity.shape)
    velocity = motion.velocity + noise * ([0.013] * 3 + [2e-3] * 3)
    return campaign.vehicle, replace(campaign.exact_train, velocity=velocity, acceleration=None)


def with_added_mass(vehicle, logarithms):
    """Return a vehicle whose added mass is scaled by axis."""
    factor = np.exp(0.5 * np.array(logarithms))
    added = vehicle.added_mass * np.outer(factor, factor)
    mass = vehicle.mass_matrix - vehicle.added_mass + added
    return replace(vehicle, mass_matrix=mass, added_mass=added)


@pytest.mark.slow
def test_models_with_other_channels_share_a_problem(simulated):
    """The channels of a problem are those of all models; each has a plant of its own."""
    vehicle, log = simulated
    name, *_ = log.command_names
    models = MODEL, MODEL.with_terms({"X": f"{name}*{name}"}, key="gains")
    problem = hd.prepare(replace(vehicle, actuators=()), log, models)
    parameters = vehicle_parameters(vehicle, ("added-mass",))
    for model in models:
        rebuilt = rebuild_plant(problem, model, parameters)(np.zeros(len(parameters)))
        assert rebuilt.inputs.channels.shape[1] == rebuilt.equations.plant.n_channels


@pytest.mark.slow
def test_added_mass_and_buoyancy_are_within_their_intervals(simulated):
    vehicle, log = simulated
    wrong = with_added_mass(vehicle, [0.3, -0.3, 0.25, 0.0, 0.2, -0.25])
    problem = hd.prepare(replace(wrong, buoyancy=1.005 * vehicle.buoyancy), log, MODEL)
    result = hd.OutputError(estimate=("added-mass", "buoyancy")).identify(problem, MODEL)
    true = {f"A_{axis}": vehicle.added_mass[k, k] for k, axis in enumerate("XYZKMN")}
    true["B"] = vehicle.buoyancy
    assert true.keys() == result.estimates.keys()
    inside = [
        abs(each.value - true[label]) <= critical_value() * each.standard_error
        for label, each in result.estimates.items()
    ]
    assert sum(inside) >= 6
    assert result.estimates["A_N"].value == pytest.approx(true["A_N"], rel=0.1)
    assert result.estimates["B"].value == pytest.approx(true["B"], rel=1e-3)
    assert result.vehicle.buoyancy == result.estimates["B"].value
    assert np.linalg.eigvalsh(result.vehicle.mass_matrix).min() > 0.0


@pytest.mark.slow
def test_free_gains_leave_the_scale_open_and_the_result_says_so(simulated):
    vehicle, log = simulated
    model = hd.catalog["fossen"].with_terms({"N": ("rudder",)}, key="gains")
    bare = replace(vehicle, actuators=())
    problem = hd.prepare(bare, log, model)
    result = hd.OutputError(estimate=("added-mass",)).identify(problem, model)
    cause = result.estimates["A_N"].cause
    assert cause.startswith("The gains of commands on N are free")
    assert f"The log does not determine A_N: the prior is kept. {cause}" in result.remarks
    assert "known ballast" in cause
    assert result.vehicle.added_mass[5, 5] == bare.added_mass[5, 5]


@pytest.mark.slow
def test_a_model_that_lacks_terms_determines_nothing_and_keeps_the_vehicle():
    campaign, model = hd.reenact(seed=1, duration=15.0), hd.catalog["fossen"]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    result = hd.OutputError(estimate=("added-mass", "buoyancy")).identify(problem, model)
    plain = hd.OutputError().identify(problem, model)
    assert [each.grade.word for each in result.estimates.values()] == ["not determined"] * 7
    assert result.vehicle == campaign.vehicle
    assert {each.value - each.prior for each in result.estimates.values()} == {0.0}
    assert np.array_equal(result.damping.coefficients, plain.damping.coefficients)
    words = r"^Averages of the residuals of [u-wp-r] are [\d.]+ times the sensor noise \(white"
    assert re.match(words, result.estimates["A_N"].cause)
    assert "the model lacks terms, or sensor errors are coloured" in result.remarks[-1]
    assert "take the values from a towing tank or strip theory" in result.remarks[-1]


def determined_errors(seed, model):
    """Return the relative errors of the determined added masses."""
    campaign = hd.reenact(seed=seed, duration=40.0)
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    result = hd.Recommended(estimate=("added-mass",)).identify(problem, model)
    return [
        abs(each.value / each.prior - 1.0)
        for each in result.estimates.values()  # the priors are true
        if each.is_determined
    ]


@pytest.mark.slow
@pytest.mark.parametrize("key", ["fossen", "prestero", "linear"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_no_mass_is_determined_with_a_model_that_lacks_terms_of_the_truth(seed, key):
    assert determined_errors(seed, hd.catalog[key]) == []


@pytest.mark.slow
def test_the_terms_of_the_truth_determine_all_masses():
    errors = determined_errors(1, hd.published["vt690-sname2022"].model)
    assert len(errors) == 6
    assert max(errors) <= 0.1


@pytest.mark.slow
def test_faults_are_told(simulated):
    vehicle, log = simulated
    with pytest.raises(MethodError, match="added-mass, center-of-gravity, buoyancy"):
        hd.OutputError(estimate=("mass",))
    whole = hd.prepare(replace(vehicle, added_mass=None), log, MODEL)
    with pytest.raises(MethodError, match="give `rigid_body` and `added_mass` apart"):
        hd.OutputError(estimate=("added-mass",)).identify(whole, MODEL)


def average_residuals(objective, windows, vector):
    """The averages of the residuals at coefficients and parameters, unweighted."""
    return objective.outputs.averages(windows, vector, np.ones(len(objective.counts)))


def assert_slopes_are_differences(objective, windows, vector):
    """The columns of the parameters, against central differences over ten steps."""
    rows = objective.outputs.linearise(windows, vector, np.ones(len(objective.counts))).columns
    is_regular = rows.any(axis=1)
    assert is_regular.mean() > 0.4
    averages = average_residuals(objective, windows, vector)
    assert np.array_equal(rows[is_regular, -1], averages[is_regular])
    first = objective.n_coefficients
    for k in range(first, len(vector)):
        change = np.zeros(len(vector))
        change[k] = 1e-3 * objective.scale[k]
        ends = [average_residuals(objective, windows, vector + s * change) for s in (1.0, -1.0)]
        slope = (ends[1] - ends[0])[is_regular] / (2.0 * change[k])
        error = rows[is_regular, len(windows.initial_state_std) + k] - slope
        assert np.max(np.abs(error)) < 0.01 * np.max(np.abs(slope))


@pytest.fixture(scope="module")
def joint():
    """The objective of a log with all parameters of the vehicle, at the truth."""
    campaign, truth = hd.reenact(seed=2, duration=20.0), hd.published["vt690-sname2022"]
    problem = hd.prepare(campaign.vehicle, campaign.train, truth.model)
    parameters = vehicle_parameters(campaign.vehicle, VEHICLE_PARAMETERS)
    rebuild = rebuild_plant(problem, truth.model, parameters)
    objective = free_parameters(make_objective(problem, truth.model), parameters, rebuild)
    return objective, np.append(truth.coefficients, np.zeros(len(parameters)))


@pytest.mark.slow
def test_slopes_on_all_vehicle_parameters_are_differences_also_of_parts_of_a_log(joint):
    objective, vector = joint
    assert len(vector) == objective.n_coefficients + 10
    moved = vector + 0.01 * (np.arange(len(vector)) >= len(vector) - 10) * objective.scale
    part = objective.restrict(np.array([[400, 600], [20, 180]]))
    for each in (objective, part):
        assert_slopes_are_differences(each, each.windows(2.0), moved)


@pytest.mark.slow
def test_inputs_are_rebuilt_too_for_the_same_samples(joint):
    """A lag of the commands, on the complete log and on parts of it in another order."""
    objective, vector = joint
    problem = objective.problem
    lag = Parameter("lag", "s", problem.log.time_scale)

    def rebuild(theta):
        log = respond(problem.log, problem.log.command_names, {"lag": 0.3 + theta[0]})
        return problem.with_log(log)

    base = make_objective(problem, problem.models[0])
    lagged = free_parameters(base, (lag,), rebuild)
    values = np.append(vector[: base.n_coefficients], 0.0)
    bounds = np.array([[400, 600], [20, 180]])
    for each in (lagged, lagged.restrict(bounds)):
        assert_slopes_are_differences(each, each.windows(2.0), values)
    fixed, _ = fix_parameters(lagged.restrict(bounds), Iterate(values, ()))
    samples = np.r_[400:600, 20:180]
    assert np.array_equal(fixed.problem.inputs.channels, rebuild([0.0]).inputs.channels[samples])


@pytest.mark.slow
def test_free_masses_widen_the_intervals_of_the_coefficients_that_they_couple(joint):
    objective, vector = joint
    windows = objective.windows(5.0)
    linearisation = objective.linearise(vector, windows, objective.residual_std(vector, windows))
    result = Iterate(vector, (linearisation,))
    known, free = (
        np.sqrt(np.diag(np.linalg.inv(each.gauss_newton(iterate)[0])))[: each.n_coefficients]
        for each, iterate in (fix_parameters(objective, result), (objective, result))
    )
    labels = hd.published["vt690-sname2022"].model.labels
    ratio = dict(zip(labels, (free / known).tolist(), strict=True))
    assert min(ratio.values()) >= 1.0 - 1e-9
    assert ratio["N_uv"] > 1.5


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_joint_fit_covers_the_truth_and_survives_a_file(seed, tmp_path):
    campaign = hd.reenact(seed=seed, duration=40.0)
    truth = hd.published["vt690-sname2022"]
    problem = hd.prepare(campaign.vehicle, campaign.train, truth.model)
    fit = hd.OutputError(estimate=("added-mass",)).identify(problem, truth.model)
    assert fit.estimates["A_N"].is_determined
    assert fit.estimates["A_N"].value == pytest.approx(fit.vehicle.added_mass[5, 5], rel=1e-12)
    error = np.abs(fit.damping.coefficients - truth.coefficients)
    half = fit.uncertainty.critical_value() * fit.uncertainty.standard_errors
    assert np.mean(error <= half) > 0.9
    problem = hd.prepare(fit.vehicle, campaign.train, truth.model)
    conditional, free = (
        dict(zip(truth.model.labels, each.uncertainty.noise_only.standard_errors, strict=True))
        for each in (hd.OutputError().identify(problem, truth.model), fit)
    )
    assert all(free[label] > 1.2 * conditional[label] for label in ("N_v|v|", "N_r|r|"))
    path = tmp_path / "fit.json"
    path.write_text(as_json(fit_document(fit)), "utf-8")
    saved = read_fit(path)
    assert (saved.estimates, saved.vehicle) == (fit.estimates, fit.vehicle)


def assert_joint_covariance_is_that_of_the_errors(fit):
    """Coefficients first, then free parameters; positive semidefinite, with cross terms."""
    joint, p = fit.joint_covariance, fit.model.n_coefficients
    free = {label: each for label, each in fit.estimates.items() if not each.is_held}
    assert fit.joint_labels == (*fit.model.labels, *free)
    assert np.array_equal(joint[:p, :p], fit.damping.covariance)
    assert np.array_equal(joint, joint.T)
    errors = [each.standard_error for each in free.values()]
    np.testing.assert_allclose(np.sqrt(joint.diagonal())[p:], errors, rtol=1e-12)
    scaled = correlation(joint)
    assert np.linalg.eigvalsh(scaled).min() > -1e-10
    assert np.abs(scaled[p:, :p]).max() > 0.3


@pytest.mark.slow
def test_a_mass_that_is_not_determined_keeps_its_prior_and_the_others_are_estimated_without_it():
    campaign, truth = hd.reenact(seed=1, duration=30.0), hd.published["vt690-sname2022"]
    problem = hd.prepare(campaign.vehicle, campaign.train, truth.model)
    fit = hd.OutputError(estimate=("added-mass",)).identify(problem, truth.model)
    assert [label for label, each in fit.estimates.items() if each.cause] == ["A_X"]
    assert fit.estimates["A_X"].cause == "The standard error is at least 70 % of the prior's."
    held, masses = fit.estimates["A_X"], fit.vehicle.added_mass.diagonal()
    assert held.value == held.prior == masses[0] == campaign.vehicle.added_mass[0, 0]
    assert abs(held.joint_estimate / held.prior - 1.0) > 1e-3
    assert f"A_X {held.prior:.4g} kg (prior, not determined; joint" in " ".join(fit.remarks)
    assert masses[1:] == pytest.approx([fit.estimates[f"A_{axis}"].value for axis in "YZKMN"])
    assert fit.vehicle.estimate == ()
    assert_joint_covariance_is_that_of_the_errors(fit)
