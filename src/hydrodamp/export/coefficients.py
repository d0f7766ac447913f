"""uuv_simulator, auv_controllers, MarineGym, Stonefish: one file of hydrodynamic coefficients.

None is in a package registry: equation 1 with the numbers of the file verifies it. Stonefish has
form drag and skin friction of a box: their multipliers m >= 0 along x, y, z solve a non-negative
least squares problem, min |W (ρ F m - w)|², with F from :func:`box_wrenches`.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from scipy.optimize import nnls

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import AXES, VELOCITIES, VELOCITY_OF, Term
from hydrodamp.export.codegen import parse_numbers, render_template, symmetric, template_values
from hydrodamp.export.plant import Body, ExportedPlant, States, point_transform, with_damping
from hydrodamp.export.target import LINEAR, Files, HydrodynamicTarget, drag_terms
from hydrodamp.export.verification import Engine
from hydrodamp.files import load_text, parse_yaml
from hydrodamp.models.model import DampingModel, read_label, spell_label
from hydrodamp.vehicle.mass import STANDARD_GRAVITY

#: Labels of linear terms times u (6, 6), of quadratic drag (6,).
FORWARD = [[spell_label(axis, Term(("u", name))) for name in VELOCITIES] for axis in AXES]
QUADRATIC = [spell_label(axis, drag_terms(axis)[1]) for axis in AXES]

ParsedFile = tuple[Body, FloatArray, FloatArray, FloatArray]

MARINEGYM_GRAVITY = 9.8  # m/s^2; in the buoyancy of MarineGym
URDF_GRAVITY = 9.81  # m/s^2; in parse_model_from_xml of auv_controllers

ADDED_MASS_LAG = ", and the lag of added mass, which acts on a filtered acceleration"


@dataclass(frozen=True)
class Coefficients(HydrodynamicTarget):
    """One file: body, added mass, linear and quadratic drag.

    Parameters
    ----------
    density : float
        Density of the fluid [kg/m^3].
    """

    file: ClassVar[str]

    def render_files(self, plant: ExportedPlant) -> Files:
        """Return the file."""
        body, values = self.body(plant), plant.damping.as_dict()
        find = np.vectorize(lambda label: values.get(label, 0.0))
        labels = {"linear": LINEAR, "forward": FORWARD, "quadratic": QUADRATIC}
        drag = {name: find(table) for name, table in labels.items()}
        context = {**template_values(plant), **self.extra_values(plant, body), **drag}
        point = {"point": self.reference_point(plant), "density": self.density}
        return {self.file: render_template(f"{self.file}.j2", **context, **point, body=body)}

    def body(self, plant: ExportedPlant) -> Body:
        """Return the body with its centre of mass in the reference point of its coefficients.

        These simulators apply the hydrodynamic wrench there.
        """
        return Body.of(plant, self.key, self.density).with_origin_at_mass_center

    def extra_values(self, plant: ExportedPlant, body: Body) -> dict[str, Any]:
        """Return further template values of the file."""
        return {}

    def integrate_drag(self, text: str, body: Body, velocity: FloatArray) -> FloatArray:
        """Return drag integrated over a shape in the file, (n, 6); by default zero."""
        return np.zeros_like(velocity)

    @contextmanager
    def open_engine(self, folder: Path, plant: ExportedPlant) -> Iterator[Engine]:
        """Read the file and yield equation 1 with its numbers."""
        text = load_text(folder / self.file)
        body, *matrices = self.parse_file(text, self.body(plant))
        labels = np.concatenate([np.ravel(names) for names in (LINEAR, FORWARD, QUADRATIC)])
        numbers = np.concatenate([np.ravel(matrix) for matrix in matrices])
        values = {x: y for x, y in zip(labels.tolist(), numbers.tolist(), strict=True) if y}
        file_plant, transform = body.to_plant(values), point_transform(self.reference_point(plant))
        inverse = np.linalg.inv(transform)

        def accelerations(at: States) -> FloatArray:
            velocity, no_inputs = at.velocity @ transform.T, np.empty((len(at.velocity), 0))
            wrench = plant.applied_wrench(at) @ inverse + self.integrate_drag(text, body, velocity)
            states = States(velocity, at.down, no_inputs, wrench)
            return np.asarray(file_plant.acceleration(states) @ inverse.T)

        not_run = f"{self.description} is in no package registry"
        yield Engine("hydrodamp with the numbers of the file", accelerations, not_run=not_run)

    @abstractmethod
    def parse_file(self, text: str, default: Body) -> ParsedFile:
        """Return body, linear drag, linear drag times u, and quadratic drag of a file.

        Values of the body that are not in the file are those of ``default``.
        """


@dataclass(frozen=True)
class UUV(Coefficients):
    """A URDF with the hydrodynamic model ``fossen`` of uuv_simulator, DAVE and Plankton.

    Parameters
    ----------
    density : float
        Density of the fluid [kg/m^3].
    """

    key: ClassVar[str] = "uuv"
    description: ClassVar[str] = "uuv_simulator, DAVE or Plankton"
    file: ClassVar[str] = "uuv.urdf"
    other_omissions: ClassVar[str] = ADDED_MASS_LAG

    def allowed_terms(self, axis: str) -> Iterable[Term]:
        """Return all linear terms, those times u, and quadratic drag of the axis along itself."""
        linear = (Term((name,)) for name in VELOCITIES)
        forward = (Term(("u", name)) for name in VELOCITIES)
        return *linear, *forward, drag_terms(axis)[1]

    def parse_file(self, text: str, default: Body) -> ParsedFile:
        """Return the numbers of the URDF."""
        numbers = parse_numbers(text)
        mirrored = replace(
            default.mirrored,
            mass=numbers["mass"][0],
            center=numbers["origin"][:3],
            inertia=symmetric(numbers["inertia"]),
            volume=numbers["volume"][0],
            buoyancy_center=numbers["center_of_buoyancy"],
        )
        return (
            replace(mirrored.mirrored, added=numbers["added_mass"].reshape(6, 6)),
            numbers["linear_damping"],
            numbers["linear_damping_forward_speed"],
            numbers["quadratic_damping"],
        )


@dataclass(frozen=True)
class URDF(Coefficients):
    """A URDF with the ``<hydrodynamics>`` that the library ``hydrodynamics`` reads.

    Parameters
    ----------
    density : float
        Density of the fluid [kg/m^3].
    """

    key: ClassVar[str] = "urdf"
    description: ClassVar[str] = "the library hydrodynamics of auv_controllers (commit 3c4db4e)"
    file: ClassVar[str] = "hydrodynamics.urdf"
    other_omissions: ClassVar[str] = ", products of inertia and coupled added mass"

    def body(self, plant: ExportedPlant) -> Body:
        """Return the body with the mass that has the same weight in the library."""
        body = super().body(plant)
        return _with_mass(body, body.mass * STANDARD_GRAVITY / URDF_GRAVITY)

    def parse_file(self, text: str, default: Body) -> ParsedFile:
        """Return the numbers of the URDF."""
        numbers = parse_numbers(text)
        body = replace(
            default,
            mass=numbers["mass"][0],
            center=numbers["center_of_gravity"],
            inertia=np.diag(numbers["inertia"]),
            volume=numbers["buoyancy"][0] / (self.density * STANDARD_GRAVITY),
            buoyancy_center=numbers["center_of_buoyancy"],
            added=-np.diag(numbers["added_mass"]),
        )
        body = _with_mass(body, body.mass * URDF_GRAVITY / STANDARD_GRAVITY)
        return body, np.diag(numbers["linear"]), np.zeros((6, 6)), numbers["quadratic"]


def _with_mass(body: Body, mass: float) -> Body:
    """Return a body of another mass and the same mass matrix."""
    difference = np.diag([body.mass - mass] * 3 + [0.0] * 3)
    return replace(body, mass=mass, added=body.added + difference)


@dataclass(frozen=True)
class MarineGym(Coefficients):
    """The vehicle's YAML file of MarineGym.

    Parameters
    ----------
    density : float
        Density of the fluid [kg/m^3]; 997 in MarineGym.
    """

    key: ClassVar[str] = "marinegym"
    description: ClassVar[str] = "MarineGym"
    file: ClassVar[str] = "marinegym.yaml"
    other_omissions: ClassVar[str] = (
        ", mass and inertia (of the USD file), coupled added mass, a horizontal offset of the "
        f"centre of buoyancy{ADDED_MASS_LAG}"
    )
    density: float = 997.0

    def parse_file(self, text: str, default: Body) -> ParsedFile:
        """Return the numbers of the YAML."""
        numbers: Any = parse_yaml(text, self.file)
        drag = {tag: np.array(row, dtype=float) for tag, row in numbers["hydro_coef"].items()}
        body = replace(
            default,
            added=np.diag(drag["added_mass"]),
            volume=numbers["volume"] * MARINEGYM_GRAVITY / STANDARD_GRAVITY,
            buoyancy_center=np.array([0.0, 0.0, -numbers["coBM"]]),
        )
        linear, quadratic = drag["linear_damping"], drag["quadratic_damping"]
        return body, -np.diag(linear), np.zeros((6, 6)), -quadratic


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
        inputs = (tuple(term for term in row if term.commands) for row in rows)
        terms = tuple(_box_terms(a) + row for a, row in zip(AXES, inputs, strict=True))
        return replace(plant.damping.model, terms=terms)

    def project_plant(self, plant: ExportedPlant, at: States) -> ExportedPlant:
        """Return the plant with the non-negative multipliers that fit its damping wrench best."""
        body, model = self.body(plant), self.representable_model(plant)
        transform = point_transform(self.reference_point(plant))
        wrenches = self._box_wrenches(body, at.velocity @ transform.T)
        target = plant.damping_wrench(at) @ np.linalg.inv(transform)
        weight = SCORE_UNITS * plant.inverse.diagonal()
        regressor = (wrenches * weight[:, None]).reshape(-1, 6)
        triangle = np.linalg.qr(np.column_stack([regressor, (target * weight).ravel()]))[1]
        unit = np.linalg.norm(triangle[:, :6], axis=0)
        unit[unit == 0.0] = 1.0
        multipliers = nnls(triangle[:, :6] / unit, triangle[:, 6])[0] / unit
        drag = -np.tile(multipliers.reshape(2, 3), 2) * self._unit_drag(body)
        values = plant.damping.as_dict() | {
            spell_label(axis, term): float(drag[kind, i])
            for i, axis in enumerate(AXES)
            for kind, term in enumerate(reversed(_box_terms(axis)))
        }
        return with_damping(plant, model, values)

    def _box_wrenches(self, body: Body, velocity: FloatArray) -> FloatArray:
        center = body.buoyancy_center
        return self.density * box_wrenches(self.box_sides(body), center, velocity)

    def _unit_drag(self, body: Body) -> FloatArray:
        """Return cubic and linear drag (2, 6) of each axis by multipliers of one."""
        wrenches, axis = self._box_wrenches(body, np.eye(6)), np.arange(6)
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
        wrenches = box_wrenches(numbers["dimensions"], body.buoyancy_center, velocity)
        return np.asarray(self.density * wrenches @ numbers["hydrodynamics"])

    def parse_file(self, text: str, default: Body) -> ParsedFile:
        """Return the body of a scenario; its drag is integrated and has no coefficients."""
        numbers, zero = parse_numbers(text), np.zeros((6, 6))
        body = replace(
            default,
            mass=numbers["mass"][0],
            center=numbers["cg"][:3],
            inertia=np.diag(numbers["inertia"]),
            volume=float(numbers["dimensions"].prod()),
            buoyancy_center=numbers["origin"][:3],
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
