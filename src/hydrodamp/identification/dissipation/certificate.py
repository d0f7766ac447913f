"""A proof that damping dissipates: matrix inequalities at the corners of the box."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.dissipation.cone_program import Inequalities, nearest
from hydrodamp.identification.dissipation.operating_box import OperatingBox
from hydrodamp.identification.dissipation.power_form import PowerForm, packed, power_form, unpacked
from hydrodamp.models.model import DampingModel

_ROUNDING = 1e-5
"""A proof may leave open this share of the greatest power taken at a corner,"""

_TRIFLE = 1e-7
"""or this share of the power of the coefficients wished for."""


@dataclass(frozen=True, eq=False)
class Certificate:
    """Coefficients with a proof."""

    coefficients: FloatArray
    n_corners: int
    bound: float


@dataclass(frozen=True, eq=False)
class Corners:
    """The matrix inequalities of a model on a box."""

    form: PowerForm
    offset: FloatArray
    bounds: FloatArray

    def nearest(self, root: FloatArray, point: FloatArray, scale: FloatArray) -> Certificate | None:
        """Return the nearest coefficients that satisfy the inequalities."""
        inequalities = self._inequalities(scale)
        found = nearest(root, point, inequalities)
        if not found.solved:
            return None
        further = found.further.copy()
        multipliers = further[inequalities.n_free :]
        np.maximum(multipliers, 0.0, out=multipliers)
        taken = _eigenvalues(inequalities, np.append(found.point, further))
        wished = _eigenvalues(inequalities, np.append(point, 0.0 * further))
        bound = max(float(taken.max()), 0.0) * inequalities.size
        if bound > max(_ROUNDING * float(-taken.min()), _TRIFLE * float(np.abs(wished).max())):
            return None
        return Certificate(found.point / scale, len(self.form.corners), bound)

    def _inequalities(self, scale: FloatArray) -> Inequalities:
        corners = self.form.corners
        by_coefficient = _at_corners(corners, self.form.entries / scale)
        by_idle = _at_corners(corners, self.form.idle)
        by_multiplier = sparse.kron(sparse.eye_array(len(corners)), self.bounds)
        return Inequalities(
            rows=np.zeros((0, len(scale))),
            bound=np.zeros(0),
            matrices=sparse.csr_array(sparse.hstack([by_coefficient, by_idle, by_multiplier])),
            offset=np.tile(self.offset, len(corners)),
            size=len(self.form.velocities),
            n_free=by_idle.shape[1],
            n_multipliers=by_multiplier.shape[1],
        )


def corners_of(model: DampingModel, box: OperatingBox, reserve: FloatArray) -> Corners | None:
    """Write the matrix inequalities of a model on a box."""
    held = [place for place in range(6) if reserve[place].any() and box.extent[place] > 0.0]
    form = power_form(model, box, held, constant=bool(held))
    if form is None:
        return None
    rows = np.ix_(form.velocities, form.velocities)
    relative = reserve * np.outer(box.extent, box.extent)
    return Corners(form, packed(relative[rows]), _bounds(form, box))


def _bounds(form: PowerForm, box: OperatingBox) -> FloatArray:
    """Pack ``(z_s / least z_s)² − z_j²``, relative to the box, for every other velocity j."""
    keeping = [row for row, place in enumerate(form.velocities) if box.nearest[place] > 0.0]
    size = len(form.velocities)
    if not keeping:
        return np.zeros((size * (size + 1) // 2, 0))
    leader = keeping[0]
    place = form.velocities[leader]
    most = (box.extent[place] / box.nearest[place]) ** 2
    others = [row for row in range(size) if row != leader]
    diagonals = np.zeros((len(others), size))
    diagonals[:, leader] = most
    diagonals[np.arange(len(others)), others] = -1.0
    return (
        np.array([packed(np.diag(diagonal)) for diagonal in diagonals]).reshape(len(others), -1).T
    )


def _at_corners(corners: FloatArray, parts: FloatArray) -> Any:
    """Stack ``Σ a_p part_p`` for each corner a."""
    stacked = np.einsum("cp,ptn->ctn", corners, parts)
    return sparse.csr_array(stacked.reshape(len(corners) * parts.shape[1], parts.shape[2]))


def _eigenvalues(inequalities: Inequalities, variables: FloatArray) -> FloatArray:
    packs = inequalities.matrices @ variables + inequalities.offset
    matrices = unpacked(packs.reshape(inequalities.n_blocks, -1), inequalities.size)
    return np.asarray(np.linalg.eigvalsh(matrices))
