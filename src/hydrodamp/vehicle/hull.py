"""Added mass from the size of a hull, for those who know little more."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.errors import VehicleError
from hydrodamp.vehicle.checks import checked_number

Shape = Literal["spheroid", "cylinder"]
"""Whose added mass and inertia stand for the hull's."""

ROLL_FRACTION = 0.3
"""Added roll inertia over the rigid body's: what the fins of a REMUS 100 add.

The value of the ``remus100`` model of the Marine Systems Simulator (Fossen); a
smooth body of revolution alone has none.
"""

STANDARD_GRAVITY = 9.80665
"""Turns a mass into a weight [m/s^2]."""


class LambFactors(NamedTuple):
    """Added mass of a prolate spheroid over what it displaces."""

    surge: float
    sway: float
    pitch: float


def lamb_factors(aspect_ratio: float) -> LambFactors:
    """Return Lamb's inertia coefficients of a prolate spheroid."""
    if not (math.isfinite(aspect_ratio) and aspect_ratio >= 1.0):
        raise VehicleError(
            f"`length` must be at least `diameter`; got a ratio of {aspect_ratio:g}. "
            "For a body wider than long give the added mass itself."
        )
    e2 = 1.0 - aspect_ratio**-2
    if e2 == 0.0:
        return LambFactors(0.5, 0.5, 0.0)
    alpha = 2.0 * (1.0 - e2) * _arctanh_remainder(e2)
    beta = 1.0 - alpha / 2.0
    slant = (2.0 - e2) * (beta - alpha)
    pitch = e2**2 * (beta - alpha) / ((2.0 - e2) * (2.0 * e2 - slant))
    return LambFactors(alpha / (2.0 - alpha), beta / (2.0 - beta), pitch)


def _arctanh_remainder(e2: float) -> float:
    """Return (artanh(e) - e)/e^3 from e^2, without cancellation near the sphere."""
    if e2 < 0.01:
        return sum(e2**k / (2 * k + 3) for k in range(9))
    e = math.sqrt(e2)
    return (math.atanh(e) - e) / e**3


def check_hull(length: float, diameter: float, mass: float) -> None:
    """Raise unless length, diameter and mass are positive."""
    for what, size in (("length", length), ("diameter", diameter), ("mass", mass)):
        checked_number(size, what, positive=True)


def hull_inertia(length: float, diameter: float, mass: float, shape: Shape) -> FloatArray:
    """Return the moments of inertia of a homogeneous hull about its centre."""
    along, across = _inertia_over_mass(length, diameter, shape)
    return frozen([mass * along, mass * across, mass * across])


def _inertia_over_mass(length: float, diameter: float, shape: str) -> tuple[float, float]:
    if shape == "spheroid":
        return diameter**2 / 10.0, (length**2 + diameter**2) / 20.0
    if shape == "cylinder":
        return diameter**2 / 8.0, length**2 / 12.0 + diameter**2 / 16.0
    raise VehicleError(f"`shape` must be 'spheroid' or 'cylinder'; got {shape!r}")


def added_mass_spheroid(length: float, diameter: float, displaced_mass: float) -> FloatArray:
    """Return the added mass of a prolate spheroid about its centre."""
    factors = lamb_factors(length / diameter)
    across = factors.pitch * displaced_mass * _inertia_over_mass(length, diameter, "spheroid")[1]
    surge, sway = factors.surge * displaced_mass, factors.sway * displaced_mass
    return frozen(np.diag([surge, sway, sway, 0.0, across, across]))


def added_mass_strip(length: float, diameter: float, displaced_mass: float) -> FloatArray:
    """Return the added mass of a long cylinder about its centre by strip theory."""
    surge = lamb_factors(length / diameter).surge * displaced_mass
    across = displaced_mass * length**2 / 12.0
    return frozen(np.diag([surge, displaced_mass, displaced_mass, 0.0, across, across]))


def hull_added_mass(
    length: float, diameter: float, displaced_mass: float, roll_inertia: float, shape: Shape
) -> FloatArray:
    """Return the added mass of a hull with small fins about its centre."""
    estimate = added_mass_spheroid if shape == "spheroid" else added_mass_strip
    matrix = np.array(estimate(length, diameter, displaced_mass))
    matrix[3, 3] = ROLL_FRACTION * roll_inertia
    return frozen(matrix)
