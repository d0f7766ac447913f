"""Recursive least squares: the truth is found, and an hour of straight line does no harm."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.differentiation import regressor_mean_square
from hydrodamp.identification.recursive import RecursiveLeastSquares
from hydrodamp.kernels import core
from hydrodamp.kernels.core import coriolis

STEP = 0.1
MANOEUVRE, HOUR = 3_000, 36_000
NOISE = np.array([0.01, 0.01, 0.01, 0.003, 0.003, 0.003])
COEFFICIENTS = {"X_u": -4.0, "X_u|u|": -5.0, "Y_v": -60.0, "Y_v|v|": -80.0, "Y_ur": 20.0}
COEFFICIENTS |= {"N_uv": -15.0, "N_r": -30.0, "N_r|r|": -20.0}
TRUTH = hd.Damping.from_dict(None, COEFFICIENTS)
MODEL = TRUTH.model


def steered(rng, n):
    """Changes of speed, sway and yaw that die away at both ends."""
    time, swing = np.arange(n) * STEP, np.zeros((n, 6))
    for axis, size in ((0, 0.3), (1, 0.15), (5, 0.2)):
        rates, phases = rng.uniform(0.05, 0.6, 5), rng.uniform(0.0, 6.3, 5)
        swing[:, axis] = 0.5 * size * np.sin(np.outer(time, rates) + phases).sum(axis=1)
    return swing * np.clip(np.minimum(time, time[::-1]) / 5.0, 0.0, 1.0)[:, None]


def recorded(vehicle, velocity, rng):
    """A noisy log of a motion, with the wrench that makes it and half a newton of gusts."""
    time = np.arange(len(velocity)) * STEP
    wrench = np.gradient(velocity, time, axis=0) @ vehicle.mass_matrix
    wrench -= coriolis(vehicle.mass_matrix, velocity) + TRUTH.wrench(velocity)
    wrench += 0.5 * rng.standard_normal(wrench.shape)
    velocity = velocity + NOISE * rng.standard_normal(velocity.shape)
    return hd.Log.from_arrays(time, velocity, attitude=np.zeros((len(time), 3)), wrench=wrench)


@dataclass(frozen=True)
class Voyage:
    """Five minutes of manoeuvres, an hour of straight line, five more minutes."""

    vehicle: hd.Vehicle
    log: hd.Log

    def problem(self, start=0, stop=None):
        end = self.log.n if stop is None else stop
        part = self.log.between(start * STEP - STEP / 2, end * STEP - STEP / 2)
        return hd.prepare(self.vehicle, part, MODEL)


@pytest.fixture(scope="module")
def voyage():
    planar = {"actuators": (), "axes": ("X", "Y", "N"), "center_of_gravity": (0.0, 0.0, 0.0)}
    vehicle = replace(hd.fleet["vt690"], **planar)
    rng = np.random.default_rng(4)
    parts = steered(rng, MANOEUVRE), np.zeros((HOUR, 6)), steered(rng, MANOEUVRE)
    velocity = np.vstack(parts) + np.array([1.5, 0.0, 0.0, 0.0, 0.0, 0.0])
    return Voyage(vehicle, recorded(vehicle, velocity, rng))


def shares(problem, adaptation):
    """What a unit of each coefficient makes over a log, per share of its axis's wrench."""
    entries = adaptation.settings
    size = np.sqrt(regressor_mean_square(problem)[entries.rows - problem.equations.n_known])
    wrench = np.sqrt(np.mean(TRUTH.wrench(problem.log.velocity) ** 2, axis=0))
    return size / wrench[entries.axes]


MEMORY = 300.0
METHOD = RecursiveLeastSquares(block=1.0, memory=MEMORY)


@pytest.fixture(scope="module")
def hour(voyage):
    """The estimate after each second of the whole voyage, and the shares."""
    early = voyage.problem(0, MANOEUVRE)
    adaptation = METHOD.bind(early, MODEL)
    path = [adaptation.settings.initial_estimate(adaptation.start)]
    for row in rows_of(voyage.problem(), adaptation):
        path.append(core.absorb(adaptation.settings, path[-1], row))
    return adaptation, path[1:], shares(early, adaptation)


@pytest.mark.slow
def test_an_hour_of_straight_line_neither_drifts_nor_bursts(hour):
    """In shares of the wrench of each axis; the first row comes after two seconds."""
    adaptation, estimates, share = hour
    path = np.array([estimate.coefficients for estimate in estimates]) * share
    straight, turn = 298, 3898
    assert np.abs(path[straight:turn] - path[straight]).max() < 0.05
    assert np.abs(np.diff(path[straight:turn], axis=0)).max() < 0.001
    assert np.abs(np.diff(path[turn:], axis=0)).max() < 0.005
    error = np.abs(path - TRUTH.coefficients * share).max(axis=1)
    assert error[straight:turn].max() < 0.08
    assert error[-1] < 0.05
    assert error[-1] < error[turn]
    for axis in (0, 1, 5):  # covariance is below the prior's
        _, information = adaptation.settings.axis_block(axis, estimates[-1].information)
        assert np.linalg.eigvalsh(information)[0] > 0.0


def rows_of(problem, adaptation):
    recursion = adaptation.settings
    block, rows, last = core.new_block(recursion.plant), [], problem.inputs.sample(0)
    for k in range(1, problem.n_samples):
        sample = problem.inputs.sample(k)
        block, row = core.block_step(recursion, block, last, sample)
        rows += [] if row is None else [row]
        last = sample
    return np.array(rows)


def test_covariance_is_noise_over_information_and_what_instruments_and_prior_are_off(voyage):
    """Without forgetting: sigma^2 (D^-2 + sum phi phi')^-1, D the prior's, and two ranks more.

    One is the distance to (D^-2 + sum z phi') kappa' = D^-2 kappa_0 + sum z y, z the terms three
    rows before and after; the other what the prior pulls, (D^-2 + sum phi phi')^-1 D^-2 (kappa -
    kappa_0). How far apart both estimates may be by chance adds to the diagonal, and so does what
    lacks of a distance that is the mean of the axis against its noise (the Birge ratio).
    """
    problem = voyage.problem(0, MANOEUVRE)
    method = RecursiveLeastSquares(memory=np.inf)
    adaptation = method.bind(problem, MODEL)
    fit, rows = method.identify(problem, MODEL), rows_of(problem, adaptation)
    for axis in (0, 1, 5):
        entries = adaptation.settings
        part = slice(*entries.starts[axis : axis + 2])
        design, unit = rows[:, entries.rows[part]], entries.unit[part]
        target, start = rows[:, axis - 6], adaptation.start[part]
        prior, found = np.diag(unit**-2.0), fit.damping.coefficients[part]
        inverse = np.linalg.inv(design.T @ design + prior)
        around, within = np.vstack([design[3:6], design[6:] + design[:-6]]), design[:-3]
        matrix = prior + around.T @ within
        instrumented = np.linalg.solve(matrix, prior @ start + around.T @ target[:-3])
        off, pulled = found - instrumented, inverse @ prior @ (found - start)
        rest = fit.damping.covariance[part, part] - np.outer(off, off) - np.outer(pulled, pulled)
        moved = np.linalg.inv(matrix)
        apart = 2.0 * moved @ design.T @ design @ moved.T - 0.5 * inverse
        sigma2 = rest[0, 1] / inverse[0, 1]
        variance = sigma2 * inverse.diagonal()
        birge = np.mean(off**2 / variance)
        wanted = sigma2 * (inverse + np.diag(np.maximum(0.0, apart.diagonal())))
        wanted += np.diag(np.maximum(0.0, birge * variance - off**2))
        np.testing.assert_allclose(rest, wanted, rtol=1e-6)
        left = target - design @ found
        lagged = [np.mean(left[k:] * left[:-k]) for k in range(1, 5)]
        expected = np.var(left) + 2.0 * max(0.0, (1.0 - np.arange(1, 5) / 5.0) @ lagged)
        three_sigma = 3.0 * np.sqrt(3.6 / len(rows))  # weights k^2: variance 18/5 sigma^4 / n
        assert sigma2 == pytest.approx(expected, rel=2.0 * three_sigma)


def test_what_the_data_do_not_tell_is_left_to_the_prior(voyage):
    """Two columns that are one under way, and one that is always zero."""
    model = hd.DampingModel.from_table({"X": "u|u| u^2", "Y": "v p"}, key="aliased")
    fit = METHOD.identify(hd.prepare(voyage.vehicle, voyage.log, model), model)
    assert fit.status is hd.Status.BY_PRIOR
    assert fit.rank == 2
    assert fit.aliased == (("X_u^2", "X_u|u|"),)
    assert np.isfinite(fit.damping.covariance).all()


def test_a_start_is_kept_where_nothing_is_excited(voyage):
    model = hd.DampingModel.from_table({"X": "u v", "N": "r"}, key="mine")
    still = np.zeros((200, 6))
    log = hd.Log.from_arrays(np.arange(200) * STEP, still, attitude=np.zeros((200, 3)),
                             wrench=np.zeros((200, 6)))  # fmt: skip
    given = hd.Damping.from_dict(None, {"X_u": -7.0, "N_r": -3.0})
    problem = hd.prepare(voyage.vehicle, log, model)
    fit = RecursiveLeastSquares(start=given).identify(problem, model)
    assert fit.damping.as_dict() == {"X_u": -7.0, "X_v": 0.0, "N_r": -3.0}
    assert fit.rank == 0
    plain = METHOD.identify(problem, model)
    assert plain.damping.as_dict() == {"X_u": -1.0, "X_v": 0.0, "N_r": -1.0}
