"""Added mass and buoyancy of a simulated vehicle, estimated from wrong priors."""

import re
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import critical_value
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
    return replace(
        vehicle, mass_matrix=vehicle.mass_matrix - vehicle.added_mass + added, added_mass=added
    )


@pytest.mark.slow
def test_added_mass_and_buoyancy_are_within_their_intervals(simulated):
    vehicle, log = simulated
    wrong = with_added_mass(vehicle, [0.3, -0.3, 0.25, 0.0, 0.2, -0.25])
    wrong = replace(wrong, buoyancy=1.005 * vehicle.buoyancy)
    problem = hd.prepare(wrong, log, MODEL)
    result = hd.estimate_vehicle_parameters(problem, MODEL, ["added-mass", "buoyancy"])
    true = dict(zip(("A_X", "A_Y", "A_Z", "A_K", "A_M", "A_N"), vehicle.added_mass.diagonal(),
                    strict=True)) | {"B": vehicle.buoyancy}  # fmt: skip
    assert true.keys() == result.parameters.keys()
    half = critical_value()
    inside = [
        abs(each.value - true[label]) <= half * each.standard_error
        for label, each in result.parameters.items()
    ]
    assert sum(inside) >= 6
    assert result.parameters["A_N"].value == pytest.approx(true["A_N"], rel=0.1)
    assert result.parameters["B"].value == pytest.approx(true["B"], rel=1e-3)
    assert result.vehicle.buoyancy == result.parameters["B"].value
    assert np.linalg.eigvalsh(result.vehicle.mass_matrix).min() > 0.0


@pytest.mark.slow
def test_free_gains_leave_the_scale_open_and_the_result_says_so(simulated):
    vehicle, log = simulated
    model = hd.catalog["fossen"].with_terms({"N": ("rudder",)}, key="gains")
    bare = replace(vehicle, actuators=())
    problem = hd.prepare(bare, log, model)
    result = hd.estimate_vehicle_parameters(problem, model, ["added-mass"])
    assert result.remarks[0].startswith("The gains of commands on N are free")
    assert "known ballast" in str(result)
    assert not result.parameters["A_N"].is_determined
    assert result.parameters["A_N"].cause
    assert result.vehicle.added_mass[5, 5] == bare.added_mass[5, 5]


@pytest.mark.slow
def test_a_model_that_lacks_terms_determines_nothing_and_keeps_the_vehicle():
    campaign, model = hd.reenact(seed=1, duration=15.0), hd.catalog["fossen"]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    result = hd.estimate_vehicle_parameters(problem, model, ["added-mass", "buoyancy"])
    assert [each.grade.word for each in result.parameters.values()] == ["not determined"] * 7
    assert result.vehicle == campaign.vehicle
    words = r"^Averages of the residuals of [u-wp-r] are [\d.]+ times the sensor noise \(white"
    assert re.match(words, result.parameters["A_N"].cause)
    assert "the model lacks terms, or sensor errors are coloured" in result.remarks[0]
    assert "take the values from a towing tank or strip theory" in result.remarks[0]


def determined_errors(seed, model):
    """Return the relative errors of the determined added masses."""
    campaign = hd.reenact(seed=seed, duration=40.0)
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    result = hd.estimate_vehicle_parameters(problem, model, ["added-mass"])
    return [
        abs(each.value / each.prior - 1.0)
        for each in result.parameters.values()  # the priors are true
        if each.is_determined
    ]


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "key"), [(1, "fossen"), (2, "prestero"), (3, "linear")])
def test_no_mass_is_determined_with_a_model_that_lacks_terms_of_the_truth(seed, key):
    assert determined_errors(seed, hd.catalog[key]) == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1])
def test_the_terms_of_the_truth_determine_all_masses(seed):
    errors = determined_errors(seed, hd.published["vt690-sname2022"].model)
    assert len(errors) == 6
    assert max(errors) <= 0.1


@pytest.mark.slow
def test_faults_are_told(simulated):
    vehicle, log = simulated
    problem = hd.prepare(vehicle, log, MODEL)
    with pytest.raises(MethodError, match="added-mass, center-of-gravity, buoyancy"):
        hd.estimate_vehicle_parameters(problem, MODEL, ["mass"])
    whole = hd.prepare(replace(vehicle, added_mass=None), log, MODEL)
    with pytest.raises(MethodError, match="give `rigid_body` and `added_mass` apart"):
        hd.estimate_vehicle_parameters(whole, MODEL)
