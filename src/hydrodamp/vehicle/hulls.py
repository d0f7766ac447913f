"""Mass, inertia and added mass of ships, boats, catamarans and ROVs from main dimensions."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import AXES
from hydrodamp.errors import VehicleError
from hydrodamp.vehicle.actuators import checked_number
from hydrodamp.vehicle.mass import hull_added_mass, hull_inertia
from hydrodamp.vehicle.priors import HULL_STD

HullKind = Literal["boat", "catamaran", "ship", "rov"]
"""Hulls that :func:`estimate_hull` knows; a boat is a small ship."""

WATER_DENSITY = 1025.0
"""At sea [kg/m^3]; the density of lakes is within the errors of the formulas."""

PLANAR = ("X", "Y", "N")

GYRATION_RATIO = 0.25
"""Radius of gyration in yaw over the length of a hull: Fossen (2021), smaller vessels."""

PONTOON_COEFFICIENT = 0.4
"""Block coefficient of a hull of a catamaran: Otter of Maritime Robotics, Fossen's ``otter.m``.

The added mass in sway hardly depends on it, as the product with the beam follows from the mass.
"""

FULLNESS = (0.03, 1.0)
"""Least and largest displaced volume over length x beam x draft; a catamaran is near the least."""

MAX_DISPLACEMENT_RATIO = 1.25
"""Mass over the displacement of the block coefficient, or its inverse: by load and density."""

REGRESSION_RANGE = {"B/L": (0.0, 0.2), "B/T": (2.0, 4.0), "C_B": (0.5, 0.85)}
"""Ratios near those of the ships of ``SHIP_STD``; a ratio beyond is replaced by the limit."""

SHIP_STD = (0.65, 0.2, 0.0, 0.0, 0.0, 0.2)
"""RMS of ln(published / formula) of four ships, by axis.

Mariner (Chislett and Strom-Tejsen 1965), KVLCC2 (Yasukawa and Yoshimura 2015), a container ship
(Son and Nomoto 1982), a tanker of 190,000 dwt (Van Berlekom and Goddard 1972).
"""

BOAT_STD = (0.7, 0.7, 0.0, 0.0, 0.0, 0.7)
"""A factor of two, assumed for hulls beyond the ratios of these ships."""

ROV_STD = (0.5,) * 6
"""Above the RMS of ln(published / formula) over two sets of BlueROV2, 0.36; 0.69 in pitch."""

BLOCK_TABLE = (
    (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 10.0),
    (0.455, 0.68, 0.72, 0.72, 0.76, 0.75, 0.78, 0.77, 0.80),
)
"""Depth over the side of a square face, and added mass over (density x side^3).

DNV-RP-H103 (2011), appendix A, table A-2: 0.579 pi/4 of a square plate, then C_A times the depth of
square prisms, 0.68, 0.36, 0.24, 0.19, 0.15, 0.13, 0.11, 0.08.
"""


class Hull(NamedTuple):
    """What is estimated of a hull; its origin is amidships, on the centerline."""

    mass: float
    inertia: FloatArray
    added_mass: FloatArray
    std: tuple[float, ...]
    axes: tuple[str, ...]
    source: str
    note: str


def estimate_spheroid(length: float, diameter: float, mass: float, displaced: float) -> Hull:
    """Return the estimate of a spheroid with small fins, which displaces another mass."""
    for name, size in (("length", length), ("diameter", diameter), ("mass", mass)):
        checked_number(size, name, positive=True)
    inertia = hull_inertia(length, diameter, mass)
    added = hull_added_mass(length, diameter, displaced, float(inertia[0]))
    source = f"estimate from length {length:g} m, diameter {diameter:g} m, mass {mass:g} kg"
    note = (
        "added mass and inertia of a spheroid of this size; roll from small fins. "
        "`std` is the spread of published added masses about this formula."
    )
    return Hull(mass, inertia, added, HULL_STD, AXES, source, note)


def estimate_hull(
    kind: HullKind,
    length: float,
    beam: float,
    draft: float,
    mass: float | None = None,
    block_coefficient: float | None = None,
) -> Hull:
    """Return the estimate of a hull from its main dimensions."""
    sizes = {"length": length, "beam": beam, "draft": draft, "mass": mass}
    for name, size in (sizes | {"block_coefficient": block_coefficient}).items():
        if size is not None:
            checked_number(size, name, positive=True)
    mass = _checked_mass(kind, WATER_DENSITY * length * beam * draft, mass, block_coefficient)
    source = (
        f"estimate of a {kind} from length {length:g} m, beam {beam:g} m, draft {draft:g} m, "
        f"mass {mass:g} kg"
    )
    if kind == "rov":
        inertia, added = _estimate_box(np.array([length, beam, draft]), mass)
        return Hull(mass, inertia, added, ROV_STD, AXES, source, _BLOCK_NOTE)
    if beam > length:
        raise VehicleError(f"`beam` must be at most `length`; got {beam:g} and {length:g} m")
    squared, note = (GYRATION_RATIO * length) ** 2, _SHIP_NOTE
    if kind == "catamaran":
        block = block_coefficient or PONTOON_COEFFICIENT
        width = _hull_width(length, beam, draft, mass, block)
        arm, is_covered = (beam - width) / 2.0, False
        added = 2.0 * ship_added_mass(length, width, draft, mass / 2.0)[0]
        added[5, 5] += added[0, 0] * arm**2
        squared += arm**2
        note += f"; two hulls {width:.3g} m wide, {2.0 * arm:.3g} m from each other, no interaction"
    else:
        added, is_covered = ship_added_mass(length, beam, draft, mass)
        note += "" if is_covered else ", at the limit of its ships: the hull is beyond them"
    std = SHIP_STD if is_covered else BOAT_STD
    return Hull(mass, np.array([0.0, 0.0, mass * squared]), added, std, PLANAR, source, note)


_SHIP_NOTE = (
    "Added mass in surge by Soeding (1982), as in Fossen (2021), Handbook of Marine Craft "
    "Hydrodynamics; in sway and yaw by Clarke, Gedling and Hine (1983), The application of "
    "manoeuvring criteria in hull design using linear theory; radius of gyration 0.25 length; "
    "origin and center of gravity amidships"
)


def _checked_mass(kind: str, box: float, mass: float | None, block: float | None) -> float:
    """Return the mass, which the box of main dimensions can displace."""
    least, largest = (limit * box for limit in FULLNESS)
    if block is not None and block > FULLNESS[1]:
        raise VehicleError(f"`block_coefficient` must be at most 1; got {block:g}")
    if mass is None and (block is None or kind == "catamaran"):
        raise VehicleError(
            "a catamaran needs a `mass`: its beam does not give the width of a hull"
            if kind == "catamaran"
            else "give the `mass` or the `block_coefficient`, displaced volume over length x beam "
            "x draft: about 0.45 of a small boat, 0.6 of a container ship, 0.8 of a tanker"
        )
    if block is not None and kind != "catamaran":
        mass = block * box if mass is None else mass
        least, largest = (block * box * MAX_DISPLACEMENT_RATIO**sign for sign in (-1, 1))
    assert mass is not None
    if not least <= mass <= largest:
        raise VehicleError(
            f"a {kind} of these dimensions displaces {least:.3g} to {largest:.3g} kg, not a `mass` "
            f"of {mass:g} kg: use metres and kilograms, the dimensions below the waterline"
        )
    return mass


def ship_added_mass(
    length: float, beam: float, draft: float, mass: float
) -> tuple[FloatArray, bool]:
    """Return the added mass of a floating hull amidships, and if the regression covers it."""
    volume = mass / WATER_DENSITY
    block = volume / (length * beam * draft)
    ratios = np.array([beam / length, beam / draft, block])
    b, t, c = np.clip(ratios, *np.array([*REGRESSION_RANGE.values()]).T).tolist()
    scale = 0.5 * WATER_DENSITY * math.pi * draft**2 * length
    sway = 1.0 + 0.16 * c * t - 5.1 * b**2
    yaw = 1.0 / 12.0 + 0.017 * c * t - 0.33 * b
    coupling = (0.67 * b - 0.0033 * t**2 + 1.1 * b - 0.041 * t) / 2.0  # mean of Y_rdot and N_vdot
    added = np.zeros((6, 6))
    added[0, 0] = 2.7 * WATER_DENSITY * volume ** (5.0 / 3.0) / length**2
    added[1, 1], added[5, 5] = scale * sway, scale * yaw * length**2
    added[1, 5] = added[5, 1] = scale * coupling * length
    return added, bool((ratios == [b, t, c]).all())


def _hull_width(length: float, beam: float, draft: float, mass: float, block: float) -> float:
    """Return the width of each hull of a catamaran."""
    width = mass / (2.0 * WATER_DENSITY * length * draft * block)
    if width > beam / 2.0:
        raise VehicleError(
            f"two hulls of `mass` {mass:g} kg together, {length:g} m long with a `draft` of "
            f"{draft:g} m, are {width:.3g} m wide each: too wide for a `beam` of {beam:g} m"
        )
    return width


_BLOCK_NOTE = (
    "Added mass of rectangular blocks by DNV-RP-H103 (2011), table A-2, of the displaced mass; its "
    "moments from the levers of the faces; inertia of a homogeneous box; origin and center of "
    "gravity in the middle"
)


def _estimate_box(sides: FloatArray, mass: float) -> tuple[FloatArray, FloatArray]:
    """Return inertia and added mass of a box; a force on a face acts uniformly over it."""
    face = np.sqrt(sides.prod() / sides)  # side of the square of the same area
    moved = mass * np.interp(sides / face, *BLOCK_TABLE) * face / sides
    y, z = np.roll(sides, -1), np.roll(sides, -2)  # the other two sides, by axis
    moments = (np.roll(moved, -1) * z**2 + np.roll(moved, -2) * y**2) / 12.0
    return mass * (y**2 + z**2) / 12.0, np.diag(np.concatenate([moved, moments]))
