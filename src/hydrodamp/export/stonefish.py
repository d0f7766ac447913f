"""Stonefish: six multipliers of the drag that it integrates over a shape."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, ClassVar

import numpy as np
from scipy.optimize import nnls

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import Term
from hydrodamp.export.body import Body, diagonal
from hydrodamp.export.coefficients import Coefficients, numbers_of
from hydrodamp.export.craft import Craft

#: Degrees a radian: eq. 24 adds rates in deg/s to velocities in m/s.
_SCORED = np.array([1.0] * 3 + [np.degrees(1.0)] * 3)


@dataclass(frozen=True)
class Stonefish(Coefficients):
    """A scenario with a box, whose form drag and skin friction are scaled along x, y and z.

    Parameters
    ----------
    density : float
        Of the water [kg/m^3].
    length, width, height : float
        Proportions of the box; its volume is the displaced one.
    """

    key: ClassVar[str] = "stonefish"
    meant: ClassVar[str] = "Stonefish 1.3 to 1.5"
    file: ClassVar[str] = "stonefish.scn"
    lost: ClassVar[str] = (
        ", what its mesh makes of motion on several axes at once, and that it estimates added mass "
        "itself"
    )
    length: float = 1.0
    width: float = 1.0
    height: float = 1.0

    def point(self, craft: Craft) -> FloatArray:
        """Return the centre of buoyancy: the middle of the box."""
        return craft.vehicle.center_of_buoyancy

    def body(self, craft: Craft) -> Body:
        """Return the body of a craft about the middle of the box."""
        return Body.of(craft, self.key, self.density).about(self.point(craft))

    def allowed(self, axis: str) -> Iterable[Term]:
        """Return quadratic drag of an axis along itself."""
        return diagonal(axis)[1:]

    def more(self, craft: Craft, body: Body, quadratic: FloatArray) -> dict[str, Any]:
        """Return the sides of the box, and the multipliers that come nearest to the drag."""
        sides = np.array([self.length, self.width, self.height])
        sides = sides * np.cbrt(body.volume / sides.prod())
        weight = _SCORED * craft.inverse.diagonal() * craft.box.extent**2
        shares = 0.5 * self.density * box_drag(sides) * weight[:, None]
        wanted = -quadratic * weight
        found = [nnls(shares[[i, i + 3]], wanted[[i, i + 3]])[0] for i in range(3)]
        return {"sides": sides, "multipliers": np.array(found).T}

    def parsed(self, text: str, own: Body) -> tuple[Body, FloatArray, FloatArray, FloatArray]:
        """Return what the scenario says, each axis moving by itself."""
        said, none = numbers_of(text), np.zeros((6, 6))
        names = "quadratic_drag", "viscous_drag"
        scale = np.array([said[f"hydrodynamics.{name}"] for name in names]).T
        drag = box_drag(said["dimensions.xyz"]) * np.tile(scale, (2, 1))
        body = replace(
            own,
            mass=said["mass.value"][0],
            center=said["cg.xyz"],
            inertia=np.diag(said["inertia.xyz"]),
            volume=float(said["dimensions.xyz"].prod()),
            lifted=said["origin.xyz"],
        )
        return body, none, none, -0.5 * self.density * drag.sum(axis=1)


def box_drag(sides: FloatArray) -> FloatArray:
    """Return what Stonefish sums over the triangles of a box that moves or turns by one.

    Shape (6, 2): on each axis along itself, squared speed times area of form drag, which is on the
    faces ahead, and of skin friction.
    """
    found, unit = np.zeros((6, 2)), np.eye(3)
    for axis, ahead, corner in product(range(3), (1.0, -1.0), (1.0, -1.0)):
        first, second = (axis + 1) % 3, (axis + 2) % 3
        area = sides[first] * sides[second] / 2.0
        middle = corner / 6.0 * (sides[first] * unit[first] - sides[second] * unit[second])
        point = ahead * sides[axis] / 2.0 * unit[axis] + middle
        for motion in range(6):
            turns, along = motion > 2, unit[motion % 3]
            velocity = np.cross(along, point) if turns else along
            normal = (velocity @ unit[axis]) * unit[axis]
            form = normal if ahead * velocity[axis] > 0.0 else 0.0 * normal
            for kind, part in enumerate((form, velocity - normal)):
                force = area * np.linalg.norm(part) * part
                found[motion, kind] += along @ (np.cross(point, force) if turns else force)
    return found
