"""A vehicle as simulators describe it: a rigid body, the water it carries along, a volume.

Their frames and reference points too: all that hydrodamp holds is FRD, about one point.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from xml.etree import ElementTree

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.atoms import AXES, VELOCITIES
from hydrodamp.basis.term import Term
from hydrodamp.errors import VehicleError
from hydrodamp.export.plant import ExportedPlant
from hydrodamp.models.damping import Damping
from hydrodamp.vehicle.mass import STANDARD_GRAVITY, cross_matrix, rigid_body_mass_matrix
from hydrodamp.vehicle.vehicle import Vehicle

#: By it a velocity or wrench in x forward, y left, z up becomes one in x forward, y starboard,
#: z down, and back; the world turns alike, from north-west-up to north-east-down.
FLU = frozen([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])


def term_sign(term: Term) -> float:
    """Return by what a product of velocities is multiplied where they are those in FLU."""
    names = (factor.removeprefix("V_") for factor in term.factors)
    return float(FLU[[VELOCITIES.index(name) for name in names if name in VELOCITIES]].prod())


def to_point(point: FloatArray) -> FloatArray:
    """Return the 6 x 6 matrix from the velocity of the origin to that of a point of the body.

    Its inverse, transposed, takes wrenches there.
    """
    turn = np.eye(6)
    turn[:3, 3:] = -cross_matrix(point)
    return turn


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body with added mass and displaced volume; points and added mass about the origin.

    The mass is that of the weight, so that gravity and volume restore as the vehicle's weight and
    buoyancy do; what is left of the mass matrix is added mass.
    """

    mass: float
    center: FloatArray  # of gravity (3,) [m]
    inertia: FloatArray  # about it (3, 3)
    added: FloatArray  # (6, 6)
    volume: float  # [m^3]
    lifted: FloatArray  # centre of the volume (3,) [m]
    density: float  # of the water [kg/m^3]

    @classmethod
    def of(cls, craft: ExportedPlant, key: str, density: float) -> Body:
        """Return the body of a craft."""
        check_body(craft, key)
        vehicle = craft.vehicle
        mass, center = vehicle.weight / STANDARD_GRAVITY, vehicle.center_of_gravity
        inertia = vehicle.mass_matrix[3:, 3:] + mass * np.linalg.matrix_power(
            cross_matrix(center), 2
        )
        if vehicle.added_mass is None:  # how they share it does not show in the motion
            inertia = 0.5 * np.linalg.eigvalsh(inertia)[0] * np.eye(3)
        else:
            inertia = inertia - vehicle.added_mass[3:, 3:]
        rigid = rigid_body_mass_matrix(mass, inertia, center, "center_of_gravity")
        volume = vehicle.buoyancy / (density * STANDARD_GRAVITY)
        added = vehicle.mass_matrix - rigid
        return cls(mass, center, inertia, added, volume, vehicle.center_of_buoyancy, density)

    def about(self, point: FloatArray) -> Body:
        """Return the body with its points and added mass about a point of it."""
        back = np.linalg.inv(to_point(point))
        return replace(
            self,
            center=self.center - point,
            added=back.T @ self.added @ back,
            lifted=self.lifted - point,
        )

    @property
    def balanced(self) -> Body:
        """The body with its centre of gravity in the origin, the same mass matrix and restoring.

        What the arm makes of the mass matrix becomes added mass.
        """
        inertia = self.rigid[3:, 3:]
        rigid = rigid_body_mass_matrix(self.mass, inertia)
        shift = self.center * self.mass / (self.density * self.volume)
        return replace(
            self,
            center=np.zeros(3),
            inertia=inertia,
            added=self.rigid + self.added - rigid,
            lifted=self.lifted - shift,
        )

    @property
    def turned(self) -> Body:
        """The body with y to port and z up, and back; zeros without a sign."""
        return replace(
            self,
            center=FLU[:3] * self.center + 0.0,
            inertia=FLU[:3, None] * self.inertia * FLU[:3] + 0.0,
            added=FLU[:, None] * self.added * FLU + 0.0,
            lifted=FLU[:3] * self.lifted + 0.0,
        )

    @property
    def side(self) -> float:
        """The side of a cube of its volume."""
        return float(np.cbrt(self.volume))

    @property
    def rigid(self) -> FloatArray:
        """The mass matrix without added mass."""
        return rigid_body_mass_matrix(self.mass, self.inertia, self.center, "center_of_gravity")

    def craft(self, values: dict[str, float]) -> ExportedPlant:
        """Return the craft of this body without actuators, coefficients by their labels."""
        vehicle = Vehicle(
            "body",
            self.rigid + self.added,
            self.mass * STANDARD_GRAVITY,
            self.volume * self.density * STANDARD_GRAVITY,
            self.center,
            self.lifted,
        )
        return ExportedPlant(vehicle, Damping.from_dict(None, values))


def check_body(craft: ExportedPlant, key: str) -> None:
    """Refuse a craft that a simulator cannot have as a body in water."""
    vehicle = craft.vehicle
    if vehicle.axes != AXES:
        raise VehicleError(
            f"'{key}' moves all six axes, and the mass of '{vehicle.name}' is known on "
            f"{' '.join(vehicle.axes)} alone: give a vehicle file without `axes`."
        )
    if not (vehicle.weight and vehicle.buoyancy):
        raise VehicleError(
            f"'{key}' moves a body by gravity and displaced water: `weight` and `buoyancy` of "
            f"'{vehicle.name}' must be positive [N]; got {vehicle.weight:g} and "
            f"{vehicle.buoyancy:g}."
        )


def numbers_of(text: str) -> dict[str, FloatArray]:
    """Return the numbers of XML: texts by their tags, with their parents' too, and attributes."""
    said = {}
    for parent in ElementTree.fromstring(text).iter():
        for each in parent:
            found = {f"{each.tag}.{name}": value for name, value in each.attrib.items()}
            names = (each.tag, f"{parent.tag}/{each.tag}")
            for name, value in (dict.fromkeys(names, each.text or "") | found).items():
                with suppress(ValueError):
                    said[name] = np.array(value.split(), dtype=float)
    return said


def symmetric(values: list[float]) -> FloatArray:
    """Return the symmetric matrix of an upper triangle."""
    matrix = np.zeros((3, 3) if len(values) == 6 else (6, 6))
    rows, columns = np.triu_indices(len(matrix))
    matrix[rows, columns] = matrix[columns, rows] = values
    return matrix


def mass_ratio(vehicle: Vehicle) -> dict[str, float]:
    """Return added mass over the rigid body's by axis, where both are known."""
    if vehicle.added_mass is None:
        return {}
    added = vehicle.added_mass.diagonal()
    rigid = vehicle.mass_matrix.diagonal() - added
    return {axis: float(added[AXES.index(axis)] / rigid[AXES.index(axis)]) for axis in vehicle.axes}
