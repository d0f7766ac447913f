"""A vehicle, a rich motion of any length, and a truth of all 85 terms that explains it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cache

import numpy as np

import hydrodamp as hd
from hydrodamp.basis.basis import UNION
from hydrodamp.basis.term import AXES, VELOCITIES
from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.kernels.core import coriolis

FULL = hd.DampingModel.from_table({" ".join(AXES): [str(term) for term in UNION]}, key="full")
"""All 85 terms on all six axes: 510 coefficients."""

PAPER = tuple(hd.catalog[key] for key in hd.PAPER_MODELS)
VEHICLE = replace(hd.fleet["vt690"], actuators=(), center_of_gravity=(0.01, 0.0, 0.0083))

_BLOCK = 100_000


def truth(model: hd.DampingModel = FULL, seed: int = 7) -> hd.Damping:
    """Strong damping on the diagonal, a little of every other term."""
    rng = np.random.default_rng(seed)
    inertia = dict(zip(AXES, np.diag(VEHICLE.mass_matrix), strict=True))
    own = {f"{axis}_{name}" for axis, name in zip(AXES, VELOCITIES, strict=True)}
    values = [
        inertia[label[0]] * (-0.5 if label in own else rng.uniform(-0.01, 0.01))
        for label in model.labels
    ]
    return hd.Damping(model, values)


@cache
def log(n: int, *, step: float = 0.1, damping: str = "full") -> hd.Log:
    """Return a log of ``n`` samples whose wrench makes the truth exactly true."""
    time = np.arange(n) * step
    velocity, acceleration = _motion(time)
    rates = np.random.default_rng(2).uniform(0.1, 0.5, 3)
    attitude = quaternion_from_euler(0.2 * np.sin(np.outer(time, rates)))
    made = hd.Log.from_arrays(
        time,
        velocity,
        attitude=attitude,
        acceleration=acceleration,
        propulsion_ratio=1.0 + 0.3 * np.sin(0.07 * time),
        wrench=np.zeros((n, 6)),
    )
    model = FULL if damping == "full" else hd.catalog[damping]
    return replace(made, wrench=_wrench(made, truth(model)))


def problem(n: int, models: Iterable[hd.DampingModel] = (FULL,)) -> hd.Problem:
    """Return the log prepared for some models."""
    return hd.prepare(VEHICLE, log(n), models)


def _motion(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sums of sines on every axis with their exact slopes."""
    rng = np.random.default_rng(1)
    velocity, acceleration = np.zeros((len(time), 6)), np.zeros((len(time), 6))
    for axis, size in enumerate((0.5, 0.3, 0.3, 0.4, 0.3, 0.3)):
        for _ in range(6):
            rate, phase = rng.uniform(0.05, 1.5), rng.uniform(0.0, 2.0 * np.pi)
            velocity[:, axis] += size * np.sin(rate * time + phase) / 2.0
            acceleration[:, axis] += size * rate * np.cos(rate * time + phase) / 2.0
    return velocity, acceleration


def _wrench(made: hd.Log, damping: hd.Damping) -> np.ndarray:
    wrench = np.empty((made.n, 6))
    for start in range(0, made.n, _BLOCK):
        part = slice(start, start + _BLOCK)
        velocity, down = made.velocity[part], made.down[part]
        tau = damping.wrench(velocity, down=down, propulsion_ratio=made.propulsion_ratio[part])
        inertial = made.acceleration[part] @ VEHICLE.mass_matrix
        known = coriolis(VEHICLE.mass_matrix, velocity) + VEHICLE.restoring_wrench(down)
        wrench[part] = inertial - known - tau
    return wrench
