"""Stonefish: drag integrated over the surface of a box, scaled along its axes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import Any, ClassVar

import numpy as np
from scipy.optimize import nnls

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES, VELOCITY_OF
from hydrodamp.basis.term import Term
from hydrodamp.export.coefficients import Coefficients, Parsed
from hydrodamp.export.plant import ExportedPlant, States
from hydrodamp.export.rigid_body import Body, numbers_of, to_point
from hydrodamp.models.model import DampingModel, read_label, spell_label

#: eq. 24 adds rates in deg/s to velocities in m/s.
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
    description: ClassVar[str] = "Stonefish (SolidEntity.cpp at commit 3857913)"
    file: ClassVar[str] = "stonefish.scn"
    left_out: ClassVar[str] = ", and that Stonefish estimates added mass itself"
    length: float = 1.0
    width: float = 1.0
    height: float = 1.0

    def point(self, craft: ExportedPlant) -> FloatArray:
        """Return the centre of gravity, where Stonefish applies the drag."""
        return craft.vehicle.center_of_gravity

    def body(self, craft: ExportedPlant) -> Body:
        """Return the body of a craft about its centre of gravity."""
        return Body.of(craft, self.key, self.density).about(self.point(craft))

    def sides(self, body: Body) -> FloatArray:
        """Return the sides of the box."""
        sides = np.array([self.length, self.width, self.height])
        return np.asarray(sides * np.cbrt(body.volume / sides.prod()))

    def unrepresented_effects(self, craft: ExportedPlant) -> tuple[str, ...]:
        """Return all damping: six multipliers hold no coefficient as it is."""
        labels = craft.damping.model.labels
        return tuple(label for label in labels if not read_label(label)[1].commands)

    def representable_model(self, craft: ExportedPlant) -> DampingModel:
        """Return linear and cubic terms of each axis along itself: what a box does along one."""
        rows = super().representable_model(craft).terms
        own = (_along(axis) for axis in AXES)
        terms = (
            (*new, *(x for x in row if x.commands)) for new, row in zip(own, rows, strict=True)
        )
        return replace(craft.damping.model, terms=tuple(terms))

    def project(self, craft: ExportedPlant, at: States) -> ExportedPlant:
        """Return a craft with the multipliers that come nearest to the wrench, none negative."""
        body, model, turn = (
            self.body(craft),
            self.representable_model(craft),
            to_point(self.point(craft)),
        )
        parts = self.density * box_wrenches(self.sides(body), body.lifted, at.velocity @ turn.T)
        wanted = craft.damping_wrench(at) @ np.linalg.inv(turn)
        weight = _SCORED * craft.inverse.diagonal()
        rows = np.column_stack(
            [(parts * weight[:, None]).reshape(-1, 6), (wanted * weight).ravel()]
        )
        triangle = np.linalg.qr(rows)[1]
        unit = np.linalg.norm(triangle[:, :6], axis=0)
        unit[unit == 0.0] = 1.0
        multipliers = nnls(triangle[:, :6] / unit, triangle[:, 6])[0] / unit
        along = -np.tile(multipliers.reshape(2, 3), 2) * self._units(body)
        values = craft.damping.as_dict() | {
            spell_label(axis, term): float(along[kind, i])
            for i, axis in enumerate(AXES)
            for kind, term in enumerate(reversed(_along(axis)))
        }
        damping = replace(
            craft.damping,
            model=model,
            coefficients=np.array([values[label] for label in model.labels]),
            covariance=None,
        )
        return replace(craft, damping=damping)

    def _units(self, body: Body) -> FloatArray:
        """Return cubic and linear drag (2, 6) along each axis that a multiplier of one gives."""
        parts = self.density * box_wrenches(self.sides(body), body.lifted, np.eye(6))
        own = np.arange(6)
        return -np.array([parts[own, own, own % 3], parts[own, own, own % 3 + 3]])

    def more(self, craft: ExportedPlant, body: Body) -> dict[str, Any]:
        """Return the sides of the box, and the multipliers of the held coefficients."""
        values, units = craft.damping.as_dict(), self._units(body)
        found = [
            [-values.get(spell_label(axis, _along(axis)[1 - kind]), 0.0) for axis in AXES[:3]]
            for kind in (0, 1)
        ]
        return {"sides": self.sides(body), "multipliers": np.array(found) / units[:, :3]}

    def drag(self, text: str, body: Body, velocity: FloatArray) -> FloatArray:
        """Return what Stonefish makes of the box of a file, shape (n, 6)."""
        said = numbers_of(text)
        names = "quadratic_drag", "viscous_drag"
        multipliers = np.concatenate([said[f"hydrodynamics.{name}"] for name in names])
        parts = box_wrenches(said["dimensions.xyz"], body.lifted, velocity)
        return np.asarray(self.density * parts @ multipliers)

    def parsed(self, text: str, own: Body) -> Parsed:
        """Return the body of a scenario; its drag is no product of coefficients."""
        said, none = numbers_of(text), np.zeros((6, 6))
        body = replace(
            own,
            mass=said["mass.value"][0],
            center=said["cg.xyz"],
            inertia=np.diag(said["inertia.xyz"]),
            volume=float(said["dimensions.xyz"].prod()),
            lifted=said["origin.xyz"],
        )
        return body, none, none, np.zeros(6)


def _along(axis: str) -> tuple[Term, Term]:
    own = VELOCITY_OF[axis]
    return Term((own,)), Term((own, own, own))


def box_wrenches(sides: FloatArray, center: FloatArray, velocity: FloatArray) -> FloatArray:
    """Return the wrench of a box in water for each multiplier, per density, shape (n, 6, 6).

    Multipliers are those of form drag along x, y, z, then of skin friction. Form drag is half the
    flow times its speed times its normal part on faces that meet it: cubic. Skin friction is the
    tangential flow: linear. Force and moment are scaled by the multipliers' mean over the
    components of their direction, about the point that velocities (n, 6) are of.
    """
    points, normals, areas = _triangles(sides)
    points = points + center
    flow = -(velocity[:, None, :3] + np.cross(velocity[:, None, 3:], points))
    normal = np.einsum("nfk,fk->nf", flow, normals)
    speed = np.linalg.norm(flow, axis=2)
    form = 0.5 * flow * (speed * np.maximum(-normal, 0.0) * areas)[..., None]
    skin = (flow - normal[..., None] * normals) * areas[:, None]
    found = np.zeros((len(velocity), 6, 6))
    for kind, force in enumerate((form, skin)):
        for half, part in enumerate((force.sum(axis=1), np.cross(points, force).sum(axis=1))):
            size = np.linalg.norm(part, axis=1, keepdims=True)
            share = np.abs(part) / np.where(size > 0.0, size, 1.0)
            rows, columns = slice(3 * half, 3 * half + 3), slice(3 * kind, 3 * kind + 3)
            found[:, rows, columns] = part[:, :, None] * share[:, None, :]
    return found


def _triangles(sides: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return middles, outward normals and areas of the twelve triangles of a box."""
    unit, found = np.eye(3), []
    for axis, side, corner in product(range(3), (1.0, -1.0), (1.0, -1.0)):
        first, second = (axis + 1) % 3, (axis + 2) % 3
        inside = corner / 6.0 * (sides[first] * unit[first] - sides[second] * unit[second])
        point = side * sides[axis] / 2.0 * unit[axis] + inside
        found.append((*point, *(side * unit[axis]), sides[first] * sides[second] / 2.0))
    table = np.array(found)
    return table[:, :3], table[:, 3:6], table[:, 6]
