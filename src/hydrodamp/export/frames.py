"""Frames and reference points of targets: all that hydrodamp holds is FRD, about one point."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.term import Term
from hydrodamp.vehicle.mass import cross_matrix

#: By it a velocity or wrench in x forward, y left, z up becomes one in x forward, y starboard,
#: z down, and back; the world turns alike, from north-west-up to north-east-down.
FLU = frozen([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])

_ODD = {"v": 1, "w": 2, "q": 4, "r": 5, "V_v": 1, "V_w": 2, "down_y": 1, "down_z": 2}


def term_sign(term: Term) -> float:
    """Return by what a term is multiplied where its velocities are those in FLU."""
    return float(np.prod([FLU[_ODD[factor]] for factor in term.factors if factor in _ODD]))


def in_flu(matrix: FloatArray) -> FloatArray:
    """Return a 6 x 6 matrix between wrench and motion, of mass or linear damping, in FLU."""
    return np.asarray(FLU[:, None] * matrix * FLU)


def to_point(point: FloatArray) -> FloatArray:
    """Return the 6 x 6 matrix from the velocity of the origin to that of a point of the body.

    Its inverse, transposed, takes wrenches there.
    """
    turn = np.eye(6)
    turn[:3, 3:] = -cross_matrix(point)
    return turn


def upright(down: FloatArray) -> FloatArray:
    """Return quaternions, shape (n, 4), of which the world's down direction is as given.

    Their length is the root of the direction's: between two samples neither is one.
    """
    length = np.linalg.norm(down, axis=1)
    x, y, z = down.T / length
    half = np.sqrt((1.0 + np.abs(z)) / 2.0)
    across, along, none = y / (2.0 * half), x / (2.0 * half), np.zeros(len(z))
    upwards = np.column_stack([half, across, -along, none])
    downwards = np.column_stack([across, half, none, along])
    unit = np.where(z[:, None] < 0.0, downwards, upwards)
    return np.asarray(unit * np.sqrt(length)[:, None])
