"""Process noise of a navigation filter: from the fit to its file."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov

import hydrodamp as hd
from hydrodamp.control.design import design_control
from hydrodamp.kernels.kalman import Noise
from hydrodamp.report.control_report import noise_document, write_control
from hydrodamp.simulation.damping_estimate import published_damping

NOISE = Noise(np.arange(1.0, 7.0), np.full(6, 0.01), np.full(6, 0.3), 2.0, 0.1)
VEHICLE = hd.fleet["vt690"]


def designed():
    return design_control(VEHICLE, published_damping(VEHICLE), [1.5])


@pytest.mark.slow
def test_the_filter_states_have_the_covariance_of_the_pushes():
    document = noise_document(designed(), NOISE)
    (speed,) = document["speeds"]
    a, pushes = np.array(speed["a"]), slice(10, 16)
    assert len(document["states"]) == len(a) == 16
    covariance = solve_continuous_lyapunov(a[pushes, pushes], -np.diag(document["q_push"]))
    assert np.sqrt(covariance.diagonal()) == pytest.approx(NOISE.push)
    # a push of 1 N m in yaw turns the vehicle by the inverse of its mass matrix
    assert a[:6, 15] == pytest.approx(np.linalg.inv(VEHICLE.mass_matrix)[:, 5])
    # white acceleration that has the spectrum of the push at low frequency
    inverse = np.linalg.inv(VEHICLE.mass_matrix)
    expected = inverse @ np.diag(2.0 * 2.0 * NOISE.push**2) @ inverse
    assert np.array(document["q_velocity"]) == pytest.approx(expected)


@pytest.mark.slow
def test_a_push_on_a_locked_axis_moves_nothing():
    axes = tuple("XYZMN")
    design = replace(designed(), vehicle=replace(VEHICLE, axes=axes))
    accelerations = np.array(noise_document(design, NOISE)["speeds"][0]["a"])[:6, 10:]
    free = [0, 1, 2, 4, 5]
    expected = np.zeros((6, 6))
    expected[np.ix_(free, free)] = np.linalg.inv(VEHICLE.mass_matrix[np.ix_(free, free)])
    assert accelerations == pytest.approx(expected)


@pytest.mark.slow
def test_the_file_is_written_where_the_fit_has_noise(tmp_path):
    write_control(designed(), tmp_path, NOISE)
    assert (tmp_path / "process_noise.json").is_file()
    write_control(designed(), tmp_path, None)
    assert not (tmp_path / "process_noise.json").exists()


@pytest.mark.slow
def test_the_recommended_method_estimates_the_noise_of_the_sensors():
    campaign, model = hd.reenact(duration=60.0), hd.catalog["fossen"]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    noise = hd.find_method("recommended").identify(problem, model).noise
    # of the simulated DVL [m/s]; the model lacks terms of sway
    assert noise.sensor[[0, 2]] == pytest.approx(0.0133, rel=0.05)
    assert hd.LeastSquares().identify(problem, model).noise is None
