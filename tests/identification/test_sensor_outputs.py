"""Output error on sensors at their own times, against simulations with known coefficients."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.conditioning.sensor_log import rebuild_velocities
from hydrodamp.data.attitude import rotation_matrices
from hydrodamp.errors import ProblemError
from hydrodamp.identification import parameter_estimates
from hydrodamp.identification.continuation import make_objective
from hydrodamp.identification.gauss_newton import Iterate
from hydrodamp.identification.held_out_replay import PieceNormals
from hydrodamp.identification.identifiability import grade_fit
from hydrodamp.identification.information import find_indirect_coefficients
from hydrodamp.identification.multiple_shooting import VelocityOutputs
from hydrodamp.identification.parameter_estimates import estimate_parameters
from hydrodamp.simulation.replay import replay
from value_changes import set_values

from .sensors import euler_angles, integrate_position, sample, without

ARM = np.array([0.6, -0.1, 0.2])
MODEL = hd.catalog["linear"]


@pytest.fixture(scope="module")
def exact(campaign):
    """A replay of known linear damping: velocities without noise, and the problem."""
    problem = hd.prepare(campaign.vehicle, campaign.exact_train, MODEL)
    fit = hd.LeastSquares().identify(problem, MODEL)
    motion = replay(problem, fit.damping)
    log = replace(campaign.exact_train, velocity=motion.velocity, acceleration=None)
    return campaign.vehicle, log, fit.damping


@pytest.fixture(scope="module")
def prepare(exact):
    """The problem of a log that has sensors in place of some velocities."""
    vehicle, log, _ = exact
    return lambda *sensors, missing="uvw": hd.prepare(
        vehicle, without(log, *missing, measurements=sensors), MODEL
    )


@pytest.fixture(scope="module")
def sensors(exact):
    return {each.name: each for each in all_sensors(exact[1])}


def all_sensors(log, estimate=()):
    """Every kind of sensor, with a lever arm."""
    position, rotations = integrate_position(log), rotation_matrices(log.attitude)
    rates = log.velocity[:, 3:]
    at_arm = log.velocity[:, :3] + np.cross(rates, ARM)
    settings = {"lever_arm": ARM, "estimate": estimate}
    return (
        sample(log, "usbl", "position", position + rotations @ ARM, 1.0, 1e-3, **settings),
        sample(log, "dvl", "velocity", at_arm, 0.5, 1e-3, **settings),
        sample(log, "bottom", "ground_velocity", at_arm, 0.7, 1e-3, **settings),
        sample(log, "gyro", "rates", rates, 0.25, 1e-4, estimate=estimate[:1]),
        sample(log, "ahrs", "attitude", euler_angles(log), 0.4, 1e-3, estimate=estimate[:1]),
        sample(log, "accelerometer", "specific_force", rates, 0.3, 1e-2, **settings),
    )


@pytest.fixture(scope="module")
def linearised(exact, prepare):
    """Windows of all sensors with all parameters, and random values of them."""
    _, log, damping = exact
    sensors = all_sensors(log, estimate=("bias", "delay", "lever_arm"))
    moving = [replace(each, estimate=(*each.estimate, "current")) for each in sensors[:3:2]]
    objective = make_objective(prepare(*moving, *sensors[1:2], *sensors[3:]), MODEL)
    rng = np.random.default_rng(5)
    theta = 0.01 * rng.standard_normal(len(objective.scale) - MODEL.n_coefficients)
    windows = objective.windows(1.5)  # fifteen samples: residuals are not averaged
    return objective, windows, np.concatenate([damping.coefficients, theta])


def stacked(objective, windows, parameters):
    return np.concatenate(
        [each.residuals[:, 0] for each in objective.outputs.residuals(windows, parameters)]
    )


@pytest.mark.slow
def test_slopes_are_the_derivatives_of_the_residuals(linearised):
    """Jᵀε of the linearisation, against central differences of the sum of squares."""
    objective, windows, parameters = linearised
    std = np.ones(len(objective.counts))
    rows = objective.outputs.linearise(windows, parameters, std)
    f = len(windows.initial_state_std)
    step, gradient = 1e-6 * np.maximum(objective.scale, 1e-3), []
    for k, size in enumerate(step):
        change = np.zeros(len(step))
        change[k] = size
        ends = [stacked(objective, windows, parameters + sign * change) for sign in (1.0, -1.0)]
        gradient.append(np.sum(ends[0] ** 2 - ends[1] ** 2) / (4.0 * size))
    blocks = {
        round(each.n / windows.problem.log.duration) for each in objective.problem.log.measurements
    }
    assert len(blocks) > 1
    exact = -rows.columns[:, f:-1].T @ rows.columns[:, -1]
    scale = np.abs(gradient) + 1e-3 * np.max(np.abs(gradient))
    assert np.max(np.abs(exact - gradient) / scale) < 2e-3


@pytest.mark.slow
def test_labels_and_parameters_name_sensors(linearised):
    objective, *_ = linearised
    labels = [each.label for each in objective.outputs.parameters]
    assert "usbl delay" in labels
    assert "gyro bias p" in labels
    assert sum(label.startswith("current") for label in labels) == 3
    assert objective.outputs.labels[:3] == ("recorded p", "recorded q", "recorded r")


def test_exact_sensors_have_residuals_of_their_noise(exact, prepare):
    """With true coefficients and initial velocities, residuals are noise and interpolation."""
    _, log, damping = exact
    objective = make_objective(prepare(*all_sensors(log)[:5], missing=""), MODEL)
    windows = objective.windows(4.0)
    windows = replace(windows, initial_states=log.velocity[windows.bounds[:, 0]])
    residuals = objective.outputs.residuals(windows, damping.coefficients)
    for label, series in zip(objective.outputs.labels, residuals, strict=True):
        if not label.startswith(("usbl", "ahrs")):  # their first pose is estimated
            assert np.sqrt(np.mean(series.residuals**2)) < 5e-3, label


def test_velocities_are_compared_where_all_are_recorded(prepare):
    assert isinstance(make_objective(prepare(missing=""), MODEL).outputs, VelocityOutputs)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("names", "missing"), [(["dvl"], "uvw"), (["usbl"], "uvw"), (["usbl", "ahrs"], "uvwpqr")]
)
def test_coefficients_are_those_of_the_simulation(exact, sensors, prepare, names, missing):
    """Replays with estimates from sensors follow the exact motion."""
    problem = prepare(*(sensors[name] for name in names), missing=missing)
    fit = hd.OutputError().identify(problem, MODEL)
    motion, measured = replay(prepare(missing=""), fit.damping).velocity, exact[1].velocity
    moving = np.array([0, 1, 2, 5])
    error = np.std(motion - measured, axis=0)[moving] / np.std(measured, axis=0)[moving]
    assert np.max(error) < 0.15


def test_outliers_are_left_out_and_told(sensors, prepare):
    wild = set_values(sensors["usbl"], "values", ((20, 1), lambda east: east + 30.0))
    with pytest.warns(hd.HydrodampWarning, match="usbl: 1 outlier.* of east left out, at 20 s"):
        problem = prepare(wild)
    assert problem.sensor_log.sensors[0].valid[20].tolist() == [True, False, True]


@pytest.mark.slow
@pytest.mark.parametrize(("error", "is_determined"), [(0.0, True), (0.3, False)])
def test_sensor_parameters_are_determined_where_residuals_are_sensor_errors(
    exact, prepare, error, is_determined
):
    """A bias may absorb a slow error [m/s] that the model lacks: it is not determined then."""
    _, log, _ = exact
    speed = log.velocity[:, :3] + [0.05, 0.0, 0.0]
    speed[:, 0] += error * np.sin(0.5 * log.time)
    settings = {"true_delay": 0.3, "estimate": ("bias", "delay")}
    dvl = sample(log, "dvl", "velocity", speed, 0.5, 1e-2, **settings)
    gyro = sample(log, "gyro", "rates", log.velocity[:, 3:], 0.25, 2e-3, seed=1)
    fit = hd.OutputError().identify(prepare(dvl, gyro, missing="uvwpqr"), MODEL)
    assert {each.is_determined for each in fit.estimates.values()} == {is_determined}
    if is_determined:
        assert fit.estimates["dvl delay"].value == pytest.approx(0.3, abs=0.05)
        assert fit.estimates["dvl bias u"].value == pytest.approx(0.05, abs=0.015)
    errors = [each.standard_error for each in fit.estimates.values()]
    joint = np.sqrt(fit.joint_covariance.diagonal())
    expected = [*fit.uncertainty.standard_errors, *errors]
    np.testing.assert_allclose(joint, expected, rtol=1e-12)
    remarks = " ".join(fit.remarks)
    assert ("The log does not determine dvl bias u" in remarks) == (not is_determined)
    assert "the prior is kept" not in remarks


@pytest.mark.slow
def test_sensor_parameters_without_standard_errors_are_not_determined(linearised):
    """Three blocks give no jackknife: the error is that of the prior."""
    objective, windows, parameters = linearised
    iterate = objective.add_length(Iterate(parameters, ()), windows)
    pieces = objective.problem.segments[:3]
    estimates = estimate_parameters(PieceNormals.of(objective, iterate, pieces), MODEL)
    assert len(estimates) == len(objective.outputs.parameters)
    for parameter, each in zip(objective.outputs.parameters, estimates.values(), strict=True):
        assert each.standard_error == parameter.std
        assert each.grade is hd.Grade.NOT_DETERMINED


@pytest.mark.slow
def test_sensor_parameters_that_the_log_does_not_show_are_not_determined(linearised, monkeypatch):
    """The jackknife of a shrunken estimate has no variance: the prior counts."""
    monkeypatch.setattr(parameter_estimates, "_misfit", lambda *_: "")
    objective, windows, parameters = linearised
    is_coefficient = np.arange(len(parameters)) < MODEL.n_coefficients
    priors = [replace(each, std=1e-9 * each.std) for each in objective.outputs.parameters]
    outputs = replace(objective.outputs, parameters=tuple(priors))
    scale = objective.scale * np.where(is_coefficient, 1.0, 1e-9)
    narrow = replace(objective, scale=scale, outputs=outputs)
    vector = parameters * is_coefficient
    iterate = narrow.add_length(Iterate(vector, ()), replace(windows, outputs=outputs))
    estimates = estimate_parameters(PieceNormals.of(narrow, iterate), MODEL).values()
    assert {each.grade for each in estimates} == {hd.Grade.NOT_DETERMINED}
    ratio = [each.standard_error / prior.std for each, prior in zip(estimates, priors, strict=True)]
    assert min(ratio) > 0.99


@pytest.mark.slow
def test_a_delay_that_is_not_stated_is_told(exact, prepare):
    _, log, _ = exact
    late = sample(log, "dvl", "velocity", log.velocity[:, :3], 0.5, 1e-3, true_delay=0.3)
    fit = hd.OutputError().identify(prepare(late), MODEL)
    assert "The log suggests delays of dvl 0.3" in " ".join(fit.remarks)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "indirect"), [("depth", True), ("dvl", False)])
def test_sway_coefficients_without_a_sensor_of_sway_are_indirect(exact, prepare, name, indirect):
    """A gyro determines sway through the Munk moment; a depth does not observe it, a DVL does."""
    _, log, damping = exact
    depth, down = integrate_position(log)[:, 2:], ("down",)
    sensors = {
        "depth": sample(log, "depth", "position", depth, 0.5, 0.02, components=down),
        "dvl": sample(log, "dvl", "velocity", log.velocity[:, :3], 0.1, 1e-4),
    }
    objective = make_objective(prepare(sensors[name]), MODEL)
    result = objective.add_length(Iterate(damping.coefficients, ()), objective.windows(4.0))
    half_width = 0.3 * np.abs(damping.coefficients)
    found = find_indirect_coefficients(objective, result, half_width)
    assert found[MODEL.index("Y_v")] == indirect
    assert not found[MODEL.index("N_r")]


@pytest.mark.slow
def test_indirect_coefficients_are_at_best_weak(prepare):
    problem = prepare(missing="")
    fit = hd.OutputError().identify(problem, MODEL)
    by_axis = grade_fit(problem, fit).grades
    limited = grade_fit(problem, replace(fit, indirect=("X_u",))).grades
    assert by_axis["X_u"] in {hd.Grade.DETERMINED, hd.Grade.MINOR}
    assert limited["X_u"] is hd.Grade.WEAK
    assert {**limited, "X_u": by_axis["X_u"]} == by_axis


def test_methods_that_need_velocities_say_so(sensors, prepare):
    (fit,) = hd.identify_all(prepare(sensors["usbl"]), [MODEL], hd.LeastSquares())
    assert fit.status is hd.Status.REFUSED
    assert fit.remarks[0].startswith("`ls` needs the velocities u v w at every sample")
    assert "`oe` or `recommended`" in fit.remarks[0]


@pytest.mark.slow
def test_rebuilt_velocities_have_an_honest_standard_deviation(exact):
    """The RMS error of u v w is within a factor of two of the posterior standard deviation."""
    _, log, _ = exact
    fixes = sample(log, "usbl", "position", integrate_position(log), 1.0, 0.1)
    rebuilt = rebuild_velocities(without(log, *"uvw", measurements=[fixes]), [*"uvwpqr"])
    error = np.sqrt(np.mean((rebuilt.log.velocity - log.velocity)[:, :3] ** 2, axis=0))
    ratio = error / rebuilt.velocity_std[:3]
    assert np.all((ratio > 0.3) & (ratio < 2.0))


def test_positions_without_attitude_are_told_before_any_work(exact, sensors):
    vehicle, log, _ = exact
    bare = replace(without(log, *"uvw", measurements=[sensors["usbl"]]), attitude=None)
    with pytest.raises(ProblemError, match="`usbl` measures position, which needs the attitude"):
        hd.prepare(vehicle, bare, MODEL)


def test_velocities_that_no_sensor_observes_are_told(exact):
    vehicle, log, _ = exact
    with pytest.raises(ProblemError, match=r"u v w p q r; u v w not found.*or a sensor"):
        hd.prepare(vehicle, replace(without(log, *"uvw"), position=None), MODEL)
