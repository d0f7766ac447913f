"""Logs that satisfy the discrete plant of the adaptive identifiers exactly."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.kernels.core import coriolis

COMMANDS = ("fx", "fy", "fz", "mx", "my", "mz")


@pytest.fixture(scope="session")
def campaign():
    """Simulated dives of 40 s, with sensor noise and without."""
    return hd.reenact(seed=3, duration=40.0)


@pytest.fixture
def bare(vehicle):
    """A vehicle without coupling in its mass matrix."""
    return replace(vehicle, mass_matrix=np.diag(np.diag(vehicle.mass_matrix)))


@pytest.fixture
def driven(vehicle):
    """A vehicle pushed by six held commands [N, N m]."""
    return replace(vehicle, actuators=(hd.Matrix(commands=COMMANDS, wrench=np.eye(6).tolist()),))


@pytest.fixture
def discrete_log(driven, exact_log, true_damping):
    """Data that satisfy the midpoint plant exactly: what the true coefficients leave is zero."""

    def build(truth, n=600):
        log = exact_log(truth, n=n)
        nu, ratio = log.velocity, log.propulsion_ratio
        rest = coriolis(driven.mass_matrix, nu) + driven.restoring_wrench(log.down)
        xi = truth.model.basis.evaluate(nu, down=log.down, propulsion_ratio=ratio)
        rest = (rest[1:] + rest[:-1]) / 2 + (xi[1:] + xi[:-1]) / 2 @ truth.matrix.T
        step = np.diff(log.time)[:, None]
        held = np.diff(nu, axis=0) @ driven.mass_matrix / step - rest
        commands = np.vstack([held, held[-1:]])
        return replace(
            log, wrench=None, acceleration=None, command_names=COMMANDS, commands=commands
        )

    return build


@pytest.fixture
def prepared(driven, discrete_log, true_damping):
    """Exact data of a model, as a problem."""
    return lambda model, n: hd.prepare(driven, discrete_log(true_damping(model), n=n), model)
