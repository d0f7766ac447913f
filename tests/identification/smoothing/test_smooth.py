"""The method `smooth`: whatever the log, and what it says of itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.smoothing import smooth
from hydrodamp.identification.smoothing.smooth import Smoothed
from hydrodamp.identification.smoothing.step_errors import StepErrors
from hydrodamp.simulation.replay import replay
from hydrodamp.simulation.score import score


@pytest.fixture(scope="module")
def campaign() -> hd.Campaign:
    return hd.reenact(seed=1, duration=25.0)


@pytest.fixture(scope="module")
def problem(campaign) -> hd.Problem:
    models = [hd.catalog[key] for key in ("prestero", "fossen")]
    return hd.prepare(campaign.vehicle, campaign.train, models)


def rms(campaign: hd.Campaign, fit: hd.Fit) -> float:
    found = score(hd.simulate(campaign.vehicle, fit.damping, campaign.test)).rms
    return np.inf if found is None else found


def planar_log(n: int = 800, noise: float = 0.0) -> tuple[hd.Vehicle, hd.Damping, hd.Log]:
    """A planar craft without attitude, driven by commands of unknown gain, clock uneven."""
    vehicle = replace(hd.fleet["vt690"], actuators=(), axes=("X", "Y", "N"))
    model = hd.catalog["fossen"].with_terms({"X": "thrust", "N": "rudder"})
    labels = model.restricted_to(vehicle.axes).labels
    values = dict.fromkeys(labels, -8.0) | {"X_thrust": 3.0, "N_rudder": -2.0}
    truth = hd.Damping(model.restricted_to(vehicle.axes), [values[label] for label in labels])
    rng = np.random.default_rng(9)
    time = np.cumsum(rng.uniform(0.05, 0.15, n))
    held = np.repeat(rng.normal(size=(n // 20, 2)) * [6.0, 3.0], 20, axis=0)
    start = hd.Log.from_arrays(
        time,
        np.zeros((n, 6)),
        commands={"thrust": held[:, 0], "rudder": held[:, 1]},
        segment=np.repeat(["a", "b"], n // 2),
    )
    exact = replay(hd.prepare(vehicle, start, truth.model), truth).velocity
    sizes = noise * np.array([1.0, 1.0, 0.0, 0.0, 0.0, 0.1])
    return vehicle, truth, replace(start, velocity=exact + rng.normal(size=(n, 6)) * sizes)


def test_an_exact_log_gives_the_exact_coefficients():
    """The replay that made it takes the same steps, so only rounding is left."""
    vehicle, truth, log = planar_log()
    fit = hd.identify(truth.model, vehicle, log, Smoothed(passes=6))
    assert fit.status is hd.Status.OK
    np.testing.assert_allclose(fit.damping.coefficients, truth.coefficients, rtol=1e-4)


def test_gains_are_found_on_noisy_logs_within_their_own_bounds():
    """Four standard deviations of the covariance that the fit states."""
    vehicle, truth, log = planar_log(noise=0.01)
    fit = hd.identify(truth.model, vehicle, log, Smoothed())
    bound = 4.0 * np.sqrt(np.diag(fit.damping.covariance))
    assert np.all(np.abs(fit.damping.coefficients - truth.coefficients) < bound)
    assert fit.damping["X_thrust"] == pytest.approx(3.0, rel=0.02)


def test_it_beats_least_squares_on_noisy_velocities(campaign, problem):
    model = hd.catalog["prestero"]
    smoothed = Smoothed(passes=10).identify(problem, model)
    plain = hd.LeastSquares(hd.SavitzkyGolay()).identify(problem, model)
    assert rms(campaign, smoothed) < 0.5 * rms(campaign, plain)
    assert smoothed.rank == model.n_coefficients
    assert smoothed.remarks[0].startswith("Noise found: u 0.01")
    assert "replays the log about as well as the best" in smoothed.remarks[1]


def test_a_recorded_wrench_drives_it_as_well():
    vehicle, truth, log = planar_log()
    free = hd.catalog["fossen"].restricted_to(vehicle.axes)
    damping = hd.Damping(free, [truth[label] for label in free.labels])
    forces = np.zeros((log.n, 6))
    forces[:, [0, 1, 5]] = np.sin(np.outer(log.time, [0.3, 0.5, 0.7])) * [9.0, 9.0, 4.0]
    driven = hd.Log(time=log.time, velocity=np.zeros((log.n, 6)), wrench=forces)
    exact = replay(hd.prepare(vehicle, driven, free), damping).velocity
    fit = hd.identify(free, vehicle, replace(driven, velocity=exact), Smoothed(passes=6))
    np.testing.assert_allclose(fit.damping.coefficients, damping.coefficients, rtol=1e-4)


def test_unknown_propulsion_makes_its_columns_vanish(vehicle, exact_log, true_damping):
    model = hd.catalog["gertler-hagen"]
    log = replace(exact_log(true_damping(model), n=300), propulsion_ratio=None)
    with pytest.warns(hd.PropulsionWarning, match="taken as one"):
        fit = hd.identify(model, vehicle, log, Smoothed(passes=1))
    etas = {label for label in model.labels if "(eta-1)" in label}
    assert {group[0] for group in fit.aliased if len(group) == 1} == etas
    assert max(abs(fit.damping[label]) for label in etas) < 1e-12
    assert fit.status is hd.Status.RANK_DEFICIENT


def test_equal_columns_are_named(vehicle, exact_log, true_damping):
    """Under way u and |u|, u^2 and u|u| are the same."""
    model = hd.catalog["uncoupled"]
    log = exact_log(true_damping(model), n=600, forward=3.0)
    fit = hd.identify(model, vehicle, log, Smoothed(passes=1))
    assert fit.rank == 24 - 2
    assert fit.aliased == (("X_u", "X_|u|"), ("X_u^2", "X_u|u|"))


def test_too_little_is_a_status(campaign):
    short = campaign.train.between(0.0, 0.35)
    fit = hd.identify(hd.catalog["prestero"], campaign.vehicle, short, Smoothed())
    assert fit.status is hd.Status.TOO_FEW_SAMPLES
    planar = replace(campaign.vehicle, axes=("X", "Y", "N"))
    rolling = hd.DampingModel.from_table({"K": "p"}, key="rolling")
    fit = hd.identify(rolling, planar, campaign.train, Smoothed())
    assert fit.status is hd.Status.EMPTY


def test_a_step_that_runs_away_ends_the_passes(problem, monkeypatch):
    """What was found before is kept; nothing before it is a failure."""
    model, calls, factored = hd.catalog["fossen"], [], StepErrors.of

    def fragile(linear, noise):
        calls.append(noise)
        if len(calls) > 3:
            raise np.linalg.LinAlgError("gone")
        return factored(linear, noise)

    monkeypatch.setattr(StepErrors, "of", fragile)
    fit = Smoothed().identify(problem, model)
    assert " of 1 " in fit.remarks[1]
    assert Smoothed().identify(problem, model).status is hd.Status.FAILED


def test_no_replay_is_said(problem, monkeypatch):
    monkeypatch.setattr(smooth, "_replay_error", lambda *_: float("inf"))
    fit = Smoothed(passes=2).identify(problem, hd.catalog["fossen"])
    assert fit.remarks[1] == "No pass of 2 replays the log; the last one is given."


def test_passes_must_be_some():
    with pytest.raises(hd.MethodError, match="at least 1; got 0"):
        Smoothed(passes=0)
