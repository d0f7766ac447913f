"""Coefficients that only sensors of other motions determine.

Forces X Y Z act on positions, linear velocities and specific forces; moments K M N on attitude and
rates. With the bound P of the covariance by all sensors and P' by those of the same motion, a
coefficient κ with the 95 % half-width h is indirect where ``h < |κ| ≤ h √(P'ᵢᵢ/Pᵢᵢ)``: without the
coupling in the mass matrix (Munk moment), not even its sign would be known.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.identification.gauss_newton import Iterate, ShootingObjective
from hydrodamp.identification.information import fisher_standard_errors
from hydrodamp.identification.sensor_outputs import SensorOutputs


def find_indirect_coefficients(
    objective: ShootingObjective, result: Iterate, half_width: FloatArray
) -> BoolArray:
    """Return whether only sensors of other motions determine each coefficient, (p,)."""
    p, outputs = objective.n_coefficients, objective.outputs
    indirect = np.zeros(p, dtype=bool)
    if not isinstance(outputs, SensorOutputs):
        return indirect
    windows, residual_std, *_ = result.linearisations[-1]
    std = dict(zip(outputs.labels, residual_std.tolist(), strict=True))
    value = np.abs(result.coefficients[:p])
    linear = objective.entries[1] < 3
    complete = fisher_standard_errors(objective, windows, result.coefficients, residual_std)
    for of_group, is_linear in ((linear, True), (~linear, False)):
        direct = tuple(each for each in outputs.outputs if (each.freedom[0] < 3) == is_linear)
        if not direct or not of_group.any():
            indirect |= of_group & (half_width < value)
            continue
        selected = replace(outputs, outputs=direct)
        trial = replace(windows, outputs=selected)
        noise = np.array([std[label] for label in selected.labels])
        error = fisher_standard_errors(objective, trial, result.coefficients, noise)
        indirect |= of_group & (half_width < value) & (value <= half_width * error / complete)
    return indirect
