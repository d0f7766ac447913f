"""Terms of attitude as buoyancy and centre of buoyancy of the vehicle.

With down = Rᵀe₃ they are a restoring wrench S down, S (6, 3), as weight and buoyancy are. A
submerged body has S = [n I; [r]x] with its net weight n = W - B and r = W r_G - B r_B: n and r are
the least squares of S by the mean squares of down.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.basis.term import AXES, DOWN
from hydrodamp.errors import ModelError
from hydrodamp.export.plant import ExportedPlant, with_damping
from hydrodamp.models.model import read_label


def absorb_restoring(plant: ExportedPlant, down: FloatArray) -> ExportedPlant:
    """Return the plant whose vehicle has the terms of attitude, at directions down (n, 3)."""
    vehicle, damping = plant.vehicle, plant.damping
    values, matrix = damping.as_dict(), vehicle.restoring_matrix.copy()
    terms = {label: read_label(label) for label in values}
    of_attitude = [label for label, (_, term) in terms.items() if str(term) in DOWN]
    if not of_attitude:
        return plant
    for label in of_attitude:
        axis, term = terms[label]
        matrix[AXES.index(axis), DOWN.index(str(term))] += values.pop(label)
    weight = np.mean(down**2, axis=0)
    share = weight * vehicle.free[:3]
    net = float(share @ matrix[:3].diagonal() / share.sum())
    pairs = ((2, 1), (0, 2), (1, 0))  # rows and columns of x, y, z in [r]x, and of -x, -y, -z
    arm = np.array([_weighted_mean(matrix[3:], weight, vehicle.free[3:], *pair) for pair in pairs])
    if not (buoyancy := vehicle.weight - net) > 0.0:
        raise ModelError(
            f"the terms of attitude make a net weight of {net:.4g} N, more than the weight of "
            f"'{vehicle.name}', {vehicle.weight:.4g} N: identify a model without them."
        )
    center = (vehicle.weight * vehicle.center_of_gravity - arm) / buoyancy
    floating = replace(vehicle, buoyancy=buoyancy, center_of_buoyancy=center)
    rows = (tuple(term for term in row if str(term) not in DOWN) for row in damping.model.terms)
    model = replace(damping.model, terms=tuple(rows))
    return with_damping(replace(plant, vehicle=floating), model, values)


def _weighted_mean(
    moments: FloatArray, weight: FloatArray, free: BoolArray, row: int, column: int
) -> float:
    """Return a component of r from its two places in the matrix, opposite in sign."""
    shares = np.array([weight[column] * free[row], weight[row] * free[column]])
    pair = np.array([moments[row, column], -moments[column, row]])
    return float(shares @ pair / shares.sum()) if shares.any() else 0.0
