"""Stonefish: form drag and skin friction integrated over a box, with six fitted multipliers.

The multipliers m >= 0 of form drag and skin friction along x, y, z solve a non-negative least
squares problem, min |W (ρ F m - w)|², with F from :func:`box_wrenches`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import Any, ClassVar

import numpy as np
from scipy.optimize import nnls

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import AXES, VELOCITY_OF, Term
from hydrodamp.export.coefficients import Coefficients, ParsedFile
from hydrodamp.export.plant import Body, ExportedPlant, States, parse_numbers, point_transform
from hydrodamp.models.model import DampingModel, read_label, spell_label

#: Units of eq. 24: m/s and deg/s.
SCORE_UNITS = np.array([1.0] * 3 + [np.degrees(1.0)] * 3)


@dataclass(frozen=True)
class Stonefish(Coefficients):
    """A scenario with a box whose form drag and skin friction have a multiplier for x, y and z.

    Parameters
    ----------
    density : float
        Density of the fluid [kg/m^3].
    length, width, height : float
        Proportions of the box; its volume is the displaced volume.
    """

    key: ClassVar[str] = "stonefish"
    description: ClassVar[str] = "Stonefish (SolidEntity.cpp at commit 3857913)"
    file: ClassVar[str] = "stonefish.scn"
    other_omissions: ClassVar[str] = ", and that Stonefish estimates added mass itself"
    length: float = 1.0
    width: float = 1.0
    height: float = 1.0

    def reference_point(self, plant: ExportedPlant) -> FloatArray:
        """Return the centre of gravity, where Stonefish applies the drag."""
        return plant.vehicle.center_of_gravity

    def body(self, plant: ExportedPlant) -> Body:
        """Return the body of a plant about its centre of gravity."""
        return Body.of(plant, self.key, self.density).translate_origin(self.reference_point(plant))

    def box_sides(self, body: Body) -> FloatArray:
        """Return the sides of the box."""
        sides = np.array([self.length, self.width, self.height])
        return np.asarray(sides * np.cbrt(body.volume / sides.prod()))

    def unrepresented_effects(self, plant: ExportedPlant) -> tuple[str, ...]:
        """Return all damping: six multipliers represent no coefficient exactly."""
        labels = plant.damping.model.labels
        return tuple(label for label in labels if not read_label(label)[1].commands)

    def representable_model(self, plant: ExportedPlant) -> DampingModel:
        """Return linear and cubic drag of each axis, the terms of a box along one axis."""
        rows = super().representable_model(plant).terms
        drag = (_box_terms(axis) for axis in AXES)
        model_terms = (
            (*terms, *(term for term in row if term.commands))
            for terms, row in zip(drag, rows, strict=True)
        )
        return replace(plant.damping.model, terms=tuple(model_terms))

    def project_plant(self, plant: ExportedPlant, at: States) -> ExportedPlant:
        """Return the plant with the non-negative multipliers that fit its damping wrench best."""
        body, model = self.body(plant), self.representable_model(plant)
        transform = point_transform(self.reference_point(plant))
        wrenches = self.density * box_wrenches(
            self.box_sides(body), body.buoyancy_center, at.velocity @ transform.T
        )
        target = plant.damping_wrench(at) @ np.linalg.inv(transform)
        weight = SCORE_UNITS * plant.inverse.diagonal()
        rows = np.column_stack(
            [(wrenches * weight[:, None]).reshape(-1, 6), (target * weight).ravel()]
        )
        triangle = np.linalg.qr(rows)[1]
        unit = np.linalg.norm(triangle[:, :6], axis=0)
        unit[unit == 0.0] = 1.0
        multipliers = nnls(triangle[:, :6] / unit, triangle[:, 6])[0] / unit
        drag = -np.tile(multipliers.reshape(2, 3), 2) * self._unit_drag(body)
        values = plant.damping.as_dict() | {
            spell_label(axis, term): float(drag[kind, i])
            for i, axis in enumerate(AXES)
            for kind, term in enumerate(reversed(_box_terms(axis)))
        }
        damping = replace(
            plant.damping,
            model=model,
            coefficients=np.array([values[label] for label in model.labels]),
            covariance=None,
        )
        return replace(plant, damping=damping)

    def _unit_drag(self, body: Body) -> FloatArray:
        """Return cubic and linear drag (2, 6) of each axis by multipliers of one."""
        wrenches = self.density * box_wrenches(
            self.box_sides(body), body.buoyancy_center, np.eye(6)
        )
        axis = np.arange(6)
        return -np.array([wrenches[axis, axis, axis % 3], wrenches[axis, axis, axis % 3 + 3]])

    def extra_values(self, plant: ExportedPlant, body: Body) -> dict[str, Any]:
        """Return the sides of the box, and the multipliers of the projected coefficients."""
        values, units = plant.damping.as_dict(), self._unit_drag(body)
        drag = [
            [-values.get(spell_label(axis, _box_terms(axis)[1 - kind]), 0.0) for axis in AXES[:3]]
            for kind in (0, 1)
        ]
        return {"sides": self.box_sides(body), "multipliers": np.array(drag) / units[:, :3]}

    def integrate_drag(self, text: str, body: Body, velocity: FloatArray) -> FloatArray:
        """Return the drag of the box of a file, shape (n, 6)."""
        numbers = parse_numbers(text)
        names = "quadratic_drag", "viscous_drag"
        multipliers = np.concatenate([numbers[f"hydrodynamics.{name}"] for name in names])
        wrenches = box_wrenches(numbers["dimensions.xyz"], body.buoyancy_center, velocity)
        return np.asarray(self.density * wrenches @ multipliers)

    def parse_file(self, text: str, default: Body) -> ParsedFile:
        """Return the body of a scenario; its drag is integrated and has no coefficients."""
        numbers, zero = parse_numbers(text), np.zeros((6, 6))
        body = replace(
            default,
            mass=numbers["mass.value"][0],
            center=numbers["cg.xyz"],
            inertia=np.diag(numbers["inertia.xyz"]),
            volume=float(numbers["dimensions.xyz"].prod()),
            buoyancy_center=numbers["origin.xyz"],
        )
        return body, zero, zero, np.zeros(6)


def _box_terms(axis: str) -> tuple[Term, Term]:
    name = VELOCITY_OF[axis]
    return Term((name,)), Term((name, name, name))


def box_wrenches(sides: FloatArray, center: FloatArray, velocity: FloatArray) -> FloatArray:
    """Return the wrench of a submerged box by multiplier and per density, shape (n, 6, 6).

    Multipliers are those of form drag along x, y, z, then of skin friction. On a face of area A and
    normal n with flow v, form drag is ½ v |v| max(-v·n, 0) A (cubic), skin friction (v - (v·n) n) A
    (linear). Each component of force and moment is multiplied by the mean of the multipliers over
    the components of its direction. Moments are about the reference point of the velocities (n, 6).
    """
    points, normals, areas = _triangles(sides)
    points = points + center
    flow = -(velocity[:, None, :3] + np.cross(velocity[:, None, 3:], points))
    normal = np.einsum("nfk,fk->nf", flow, normals)
    speed = np.linalg.norm(flow, axis=2)
    form = 0.5 * flow * (speed * np.maximum(-normal, 0.0) * areas)[..., None]
    skin = (flow - normal[..., None] * normals) * areas[:, None]
    result = np.zeros((len(velocity), 6, 6))
    for kind, force in enumerate((form, skin)):
        for half, total in enumerate((force.sum(axis=1), np.cross(points, force).sum(axis=1))):
            size = np.linalg.norm(total, axis=1, keepdims=True)
            weight = np.abs(total) / np.where(size > 0.0, size, 1.0)
            rows, columns = slice(3 * half, 3 * half + 3), slice(3 * kind, 3 * kind + 3)
            result[:, rows, columns] = total[:, :, None] * weight[:, None, :]
    return result


def _triangles(sides: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return centroids, outward normals and areas of the twelve triangles of a box."""
    unit, rows = np.eye(3), []
    for axis, side, corner in product(range(3), (1.0, -1.0), (1.0, -1.0)):
        first, second = (axis + 1) % 3, (axis + 2) % 3
        offset = corner / 6.0 * (sides[first] * unit[first] - sides[second] * unit[second])
        point = side * sides[axis] / 2.0 * unit[axis] + offset
        rows.append((*point, *(side * unit[axis]), sides[first] * sides[second] / 2.0))
    table = np.array(rows)
    return table[:, :3], table[:, 3:6], table[:, 6]
