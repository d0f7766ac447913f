"""Values of a vehicle that are guesses are estimated with the damping; contradictions are named."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.data.log import Segment
from hydrodamp.identification import output_error
from hydrodamp.identification.estimated_vehicle import estimated_vehicle
from hydrodamp.identification.identifiability import add_grades
from hydrodamp.identification.parameter_estimates import describe_changes
from hydrodamp.identification.parameters import Parameter, vehicle_parameters, wrench_parameters
from hydrodamp.identification.prediction_error import minimise_prediction_errors
from hydrodamp.simulation.checks import with_gains
from hydrodamp.validation.diagnostics import diagnose_comparison
from hydrodamp.vehicle.file import format_vehicle, parse_vehicle

TRUTH = hd.Damping.from_dict(None, {"X_u": -8.0, "Y_v": -40.0, "Y_r": 3.0, "N_v": 2.0, "N_r": -6.0})
RIGID = np.diag([18.0, 18.0, 0, 0, 0, 3.0])
ADDED = np.diag([2.0, 14.0, 0, 0, 0, 2.0])
BOAT = hd.Vehicle("boat", RIGID + ADDED, 0.0, 0.0, axes=("X", "Y", "N"), added_mass=ADDED)


def sail(seed, n=600):
    """Return a noisy log at 10 Hz with the true wrench, which changes every 2 s."""
    rng = np.random.default_rng(seed)
    wrench = np.zeros((n, 6))
    wrench[:, [0, 1, 5]] = np.repeat(rng.uniform([2, -15, -4], [10, 15, 4], (n // 20, 3)), 20, 0)
    log = hd.Log(
        0.1 * np.arange(n),
        np.eye(n, 6) * 0.5,  # from 0.5 m/s ahead
        ("u", "v", "r"),
        wrench=wrench,
        segments=(Segment("1", 0, n),),
    )
    velocity = hd.simulate(BOAT, TRUTH, log).velocity
    noise = rng.standard_normal(velocity.shape) * BOAT.free * 2e-3
    return replace(log, velocity=velocity + noise)


def with_sway(added, std=(0, 0.5, 0, 0, 0, 0), origin="formula"):
    """Return the boat with a guess of its added mass in sway."""
    guess = ADDED + np.diag([0, added - ADDED[1, 1], 0, 0, 0, 0])
    prior = {"std": {"added_mass": std}, "origin": {"added_mass": origin}}
    return replace(BOAT, mass_matrix=RIGID + guess, added_mass=guess, **prior)


@pytest.fixture(scope="module")
def contradicted_fit():
    """A fit of output error from a guess that is wrong, and its problem."""
    problem = hd.prepare(with_sway(60.0), sail(1), TRUTH.model)
    return problem, hd.OutputError().identify(problem, TRUTH.model)


@pytest.mark.slow
def test_a_wrong_guess_is_estimated_by_default_and_contradicted(contradicted_fit):
    problem, fit = contradicted_fit
    vehicle = problem.vehicle
    assert (fit.status, fit.unconverged) == (hd.Status.OK, ())
    estimate = fit.estimates["A_Y"]
    assert estimate.is_determined
    assert estimate.is_contradicted
    assert estimate.value == pytest.approx(14.0, rel=0.1)
    assert fit.vehicle.added_mass[1, 1] == pytest.approx(estimate.value, rel=1e-12)
    assert not fit.vehicle.std
    assert "sway added mass: " in str(hd.compare((fit,), vehicle, sail(2)).verdict())
    words = " instead of the file's 60 (formula from the sizes of the hull): contradicted."
    assert any("sway added mass: " in text and words in text for text in fit.remarks)
    exact = hd.OutputError(estimate=None).identify(problem, TRUTH.model)
    assert (exact.estimates, exact.vehicle) == ({}, vehicle)
    # each fit is replayed and graded with the vehicle that it has estimated
    table = hd.compare((fit, exact), vehicle, sail(2))
    first, second = (row.rms for row in table.rows)
    assert first < 0.5 * second
    graded, _ = add_grades(problem, fit)
    assert graded.grades["Y_v"].word == "determined"
    with warnings.catch_warnings():  # of coefficients that belong to another vehicle
        warnings.simplefilter("error", hd.HydrodampWarning)
        assert diagnose_comparison(table, problem).problem.vehicle == fit.vehicle
        bands = [hd.predict_error(each, fit, sail(2)) for each in (vehicle, fit.vehicle)]
    np.testing.assert_array_equal(bands[0].velocity, bands[1].velocity)


@pytest.mark.slow
def test_a_right_guess_is_not_contradicted():
    problem = hd.prepare(with_sway(17.0), sail(1), TRUTH.model)
    estimates = hd.OutputError().identify(problem, TRUTH.model).estimates
    assert [*estimates] == ["A_Y"]
    assert not any(each.is_contradicted for each in estimates.values())


@pytest.mark.slow
def test_the_gain_of_a_recorded_wrench_is_estimated_and_replayed():
    train, test = (replace(log, wrench=2.0 * log.wrench) for log in (sail(1), sail(2)))
    boat = replace(BOAT, std={"wrench_gain": 0.3})
    problem = hd.prepare(boat, train, TRUTH.model)
    fit = hd.OutputError().identify(problem, TRUTH.model)
    np.testing.assert_allclose(fit.vehicle.wrench_gain[[0, 1, 5]], 0.5, rtol=0.05)
    assert all(each.is_contradicted for each in fit.estimates.values())
    assert "gain of the recorded wrench on Y: 0.5" in " ".join(fit.remarks)
    assert fit.damping["Y_v"] == pytest.approx(-40.0, rel=0.05)
    exact = hd.OutputError(estimate=None).identify(problem, TRUTH.model)
    first, second = (row.rms for row in hd.compare((fit, exact), boat, test).rows)
    assert first <= 1.01 * second  # without products, a scale of the axis has the same motion
    assert parse_vehicle(format_vehicle(fit.vehicle)) == fit.vehicle


def test_a_calibrated_wrench_and_gains_of_commands_leave_no_gain_to_estimate():
    problem = hd.prepare(replace(BOAT, std={"wrench_gain": 0}), sail(1), TRUTH.model)
    assert not [*wrench_parameters(problem, TRUTH.model)]
    model = with_gains(BOAT, sail(1), TRUTH.model)
    assert not [*wrench_parameters(hd.prepare(BOAT, sail(1), model), model)]


@pytest.mark.parametrize(
    ("theta", "error", "is_contradicted"), [(0.9, 0.1, False), (1.1, 0.1, True), (1.3, 0.5, False)]
)
def test_a_contradiction_allows_for_the_errors_of_prior_and_estimate(theta, error, is_contradicted):
    guess = Parameter("B", "N", 0.5, 100.0, origin="assumed")
    assert guess.estimate(theta, error).is_contradicted == is_contradicted
    assert not replace(guess, origin="").estimate(theta, error).is_contradicted
    assert not guess.estimate(theta, error, "The model lacks terms.").is_contradicted


def test_changed_values_are_named_contradicted_ones_first():
    sway = Parameter("A_Y", "kg", 0.3, 16.0, "logarithm", "formula")
    estimates = {
        "A_X": replace(sway, label="A_X").estimate(0.1, 0.1),  # the interval contains the file's
        "A_Y": sway.estimate(np.log(24.0 / 16.0), 0.05),
        "A_N": replace(sway, label="A_N").estimate(0.5, 0.05, "Too wide."),
        "B": Parameter("B", "N", 1.0, 100.0, origin="assumed").estimate(4.0, 0.5),
    }
    assert [*describe_changes(estimates)] == [
        "buoyancy: 104 ± 0.98 N instead of the file's 100 (assumed): contradicted.",
        "sway added mass: 24 ± 2.4 kg instead of the file's 16 (formula from the sizes of the "
        "hull): estimated.",
    ]


def test_what_has_no_std_is_exact():
    labels = [each.label for each in vehicle_parameters(with_sway(14.0))]
    assert labels == ["A_Y"]
    assert vehicle_parameters(BOAT) == ()
    hull = hd.Vehicle.from_hull(1.33, 0.19, 30.5)
    assert [each.label[0] for each in vehicle_parameters(hull)] == [*"AAAAAAB"]
    planar = replace(hull, axes=("X", "Y", "N"))
    assert [each.label for each in vehicle_parameters(planar)] == ["A_X", "A_Y", "A_N"]


@pytest.mark.slow
def test_another_vehicle_is_not_replaced_by_that_of_a_fit(contradicted_fit):
    _, fit = contradicted_fit
    other = replace(BOAT, name="other")
    assert estimated_vehicle(other, fit) is other
    heavy = with_sway(60.0)
    heavy = replace(heavy, mass_matrix=heavy.mass_matrix + np.diag([9.0, 9.0, 0, 0, 0, 0]))
    assert estimated_vehicle(heavy, fit) is heavy
    assert estimated_vehicle(with_sway(60.0), fit) is fit.vehicle


@pytest.mark.slow
def test_terms_that_a_free_vehicle_lacks_are_not_tested_again_with_a_known_vehicle(monkeypatch):
    """The fit with the values of the file is that of a file without standard deviations."""
    rounds = []

    def count(*arguments):
        rounds.append(arguments)
        return minimise_prediction_errors(*arguments)

    monkeypatch.setattr(output_error, "minimise_prediction_errors", count)
    model, log = hd.DampingModel.from_table({"X": "u", "N": "r"}, key="few"), sail(4)
    guess = replace(BOAT, std={"added_mass": (0.3, 0.3, 0, 0, 0, 0.3)})
    joint = hd.Recommended().identify(hd.prepare(guess, log, model), model)
    assert all(each.is_held for each in joint.estimates.values())
    assert len(rounds) == 1
    known = hd.Recommended().identify(hd.prepare(BOAT, log, model), model)
    assert len(rounds) == 2
    assert joint.damping.coefficients == pytest.approx(known.damping.coefficients, rel=1e-12)
    assert joint.adequacy.form is known.adequacy.form
    assert joint.adequacy.missing
