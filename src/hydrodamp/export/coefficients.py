"""uuv_simulator, auv_controllers and MarineGym: one file of named hydrodynamic coefficients.

None is in a package registry: equation 1 with the numbers of the file verifies it.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import AXES, VELOCITIES, Term
from hydrodamp.export.codegen import template_values
from hydrodamp.export.plant import (
    Body,
    ExportedPlant,
    States,
    parse_numbers,
    point_transform,
    symmetric,
)
from hydrodamp.export.projection import drag_terms
from hydrodamp.export.target import Files, HydrodynamicTarget, render_template
from hydrodamp.export.verification import Engine
from hydrodamp.files import load_text, parse_yaml
from hydrodamp.models.model import spell_label
from hydrodamp.vehicle.mass import STANDARD_GRAVITY

#: Labels of linear terms (6, 6), of linear terms times u (6, 6), of quadratic drag (6,).
LINEAR = [[spell_label(axis, Term((name,))) for name in VELOCITIES] for axis in AXES]
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
        linear, forward, quadratic = (
            np.vectorize(lambda label: values.get(label, 0.0))(labels)
            for labels in (LINEAR, FORWARD, QUADRATIC)
        )
        template_context = {
            **template_values(plant),
            **self.extra_values(plant, body),
            "body": body,
            "linear": linear,
            "forward": forward,
            "quadratic": quadratic,
            "point": self.reference_point(plant),
            "density": self.density,
        }
        return {self.file: render_template(f"{self.file}.j2", **template_context)}

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
        inertia = [numbers[f"inertia.i{name}"][0] for name in ("xx", "xy", "xz", "yy", "yz", "zz")]
        mirrored = replace(
            default.mirrored,
            mass=numbers["mass.value"][0],
            center=numbers["origin.xyz"],
            inertia=symmetric(inertia),
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

        def row(tag: str, *names: str) -> FloatArray:
            return np.array([numbers[f"{tag}.{name}"][0] for name in names])

        body = replace(
            default,
            mass=numbers["mass.value"][0],
            center=row("center_of_gravity", "x", "y", "z"),
            inertia=np.diag(row("inertia", "ixx", "iyy", "izz")),
            volume=numbers["buoyancy.value"][0] / (self.density * STANDARD_GRAVITY),
            buoyancy_center=row("center_of_buoyancy", "x", "y", "z"),
            added=-np.diag(row("added_mass", "Xdu", "Ydv", "Zdw", "Kdp", "Mdq", "Ndr")),
        )
        linear = row("linear", "Xu", "Yv", "Zw", "Kp", "Mq", "Nr")
        quadratic = row("quadratic", "Xuu", "Yvv", "Zww", "Kpp", "Mqq", "Nrr")
        body = _with_mass(body, body.mass * URDF_GRAVITY / STANDARD_GRAVITY)
        return body, np.diag(linear), np.zeros((6, 6)), quadratic


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
        added, linear, quadratic = (
            np.array(numbers["hydro_coef"][name], dtype=float)
            for name in ("added_mass", "linear_damping", "quadratic_damping")
        )
        volume = numbers["volume"] * MARINEGYM_GRAVITY / STANDARD_GRAVITY
        buoyancy_center = np.array([0.0, 0.0, -numbers["coBM"]])
        body = replace(
            default, added=np.diag(added), volume=volume, buoyancy_center=buoyancy_center
        )
        return body, -np.diag(linear), np.zeros((6, 6)), -quadratic
