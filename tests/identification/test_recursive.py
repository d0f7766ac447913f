"""Recursive least squares: the truth is found, and an hour of straight line does no harm."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp import kernels
from hydrodamp.identification.gains import mean_square
from hydrodamp.identification.projection import OntoDissipative
from hydrodamp.identification.recursive import RecursiveLeastSquares
from hydrodamp.identification.recursive_state import RecursiveAdaptation
from hydrodamp.kernels import coriolis
from hydrodamp.kernels.recursion import Estimate, block_size

STEP = 0.1
MANOEUVRE, HOUR = 3_000, 36_000
NOISE = np.array([0.01, 0.01, 0.01, 0.003, 0.003, 0.003])
TRUTH = hd.Damping.from_dict(
    None,
    {"X_u": -4.0, "X_u|u|": -5.0, "Y_v": -60.0, "Y_v|v|": -80.0, "Y_ur": 20.0}
    | {"N_uv": -15.0, "N_r": -30.0, "N_r|r|": -20.0},
)
MODEL = TRUTH.model


def steered(rng, n):
    """Changes of speed, sway and yaw that die away at both ends."""
    time, swing = np.arange(n) * STEP, np.zeros((n, 6))
    for axis, size in ((0, 0.3), (1, 0.15), (5, 0.2)):
        rates, phases = rng.uniform(0.05, 0.6, 5), rng.uniform(0.0, 6.3, 5)
        swing[:, axis] = 0.5 * size * np.sin(np.outer(time, rates) + phases).sum(axis=1)
    return swing * np.clip(np.minimum(time, time[::-1]) / 5.0, 0.0, 1.0)[:, None]


def recorded(vehicle, velocity, rng, noise=1.0):
    """A noisy log of a motion, with the wrench that makes it and half a newton of gusts."""
    time = np.arange(len(velocity)) * STEP
    wrench = np.gradient(velocity, time, axis=0) @ vehicle.mass_matrix
    wrench -= coriolis(vehicle.mass_matrix, velocity) + TRUTH.wrench(velocity)
    wrench += noise * 0.5 * rng.standard_normal(wrench.shape)
    velocity = velocity + noise * NOISE * rng.standard_normal(velocity.shape)
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
    vehicle = replace(
        hd.fleet["vt690"], actuators=(), axes=("X", "Y", "N"), center_of_gravity=(0.0, 0.0, 0.0)
    )
    rng = np.random.default_rng(4)
    parts = steered(rng, MANOEUVRE), np.zeros((HOUR, 6)), steered(rng, MANOEUVRE)
    velocity = np.vstack(parts) + np.array([1.5, 0.0, 0.0, 0.0, 0.0, 0.0])
    return Voyage(vehicle, recorded(vehicle, velocity, rng))


def shares(problem, adaptation):
    """What a unit of each coefficient makes over a log, per share of its axis's wrench."""
    entries = adaptation.bound.entries
    size = np.sqrt(mean_square(problem)[entries.rows - problem.columns.n_known])
    wrench = np.sqrt(np.mean(TRUTH.wrench(problem.log.velocity) ** 2, axis=0))
    return size / wrench[entries.axes]
