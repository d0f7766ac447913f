"""What added mass contributes to equation 1 as coefficients of velocity products."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.axes import AXES, VELOCITIES
from hydrodamp.basis.term import Term
from hydrodamp.models.labels import spell_label

_CROSS = (
    (0, 1, 2, 1.0),
    (0, 2, 1, -1.0),
    (1, 2, 0, 1.0),
    (1, 0, 2, -1.0),
    (2, 0, 1, 1.0),
    (2, 1, 0, -1.0),
)
"""The cross product: ``(a x b)[k]`` is the sum of sign a[l] b[m] over (k, l, m, sign)."""


def added_mass_matrix(derivatives: Mapping[str, float]) -> FloatArray:
    """Return the added mass matrix of SNAME derivatives."""
    matrix = np.zeros((6, 6))
    for name, value in derivatives.items():
        axis, _, velocity = name.removesuffix("dot").partition("_")
        if axis not in AXES or velocity not in VELOCITIES or not name.endswith("dot"):
            raise ValueError(f"`{name}` must be an added mass derivative, such as 'Y_vdot'.")
        matrix[AXES.index(axis), VELOCITIES.index(velocity)] = -value
    return frozen((matrix + matrix.T) / 2.0)


def coriolis_coefficients(matrix: npt.ArrayLike) -> dict[str, float]:
    """Return ``H(A nu) nu`` as coefficients of products of two velocities."""
    mass = np.asarray(matrix, dtype=np.float64)
    found: dict[str, float] = {}
    for k, left, right, sign in _CROSS:
        for column, velocity in enumerate(VELOCITIES):
            force, moment = sign * mass[left, column], sign * mass[3 + left, column]
            # H(p) nu = [p1 x omega ; p1 x nu1 + p2 x omega]  with  p = A nu
            _add(found, AXES[k], velocity, VELOCITIES[3 + right], force)
            _add(found, AXES[3 + k], velocity, VELOCITIES[right], force)
            _add(found, AXES[3 + k], velocity, VELOCITIES[3 + right], moment)
    return {label: float(value) for label, value in found.items() if value != 0.0}


def _add(found: dict[str, float], axis: str, one: str, other: str, value: float) -> None:
    label = spell_label(axis, Term((one, other)))
    found[label] = found.get(label, 0.0) + value
