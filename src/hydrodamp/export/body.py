"""A vehicle as simulators describe it: a rigid body, the water it carries along, a volume."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, replace
from typing import ClassVar

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES, VELOCITIES, VELOCITY_OF
from hydrodamp.basis.term import Term
from hydrodamp.errors import MethodError, ModelError, VehicleError
from hydrodamp.export.craft import Craft
from hydrodamp.export.frames import FLU, in_flu, to_point
from hydrodamp.export.target import Target
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel, read_label, spell_label, table_of
from hydrodamp.vehicle.mass import STANDARD_GRAVITY, cross_matrix, rigid_body_mass_matrix
from hydrodamp.vehicle.vehicle import Vehicle

LINEAR = [[spell_label(axis, Term((name,))) for name in VELOCITIES] for axis in AXES]
FORWARD = [[spell_label(axis, Term(("u", name))) for name in VELOCITIES] for axis in AXES]

_NOTHING = 1e-12  # of a matrix: rounding


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
    def of(cls, craft: Craft, key: str, density: float) -> Body:
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
            added=in_flu(self.added) + 0.0,
            lifted=FLU[:3] * self.lifted + 0.0,
        )

    @property
    def rigid(self) -> FloatArray:
        """The mass matrix without added mass."""
        return rigid_body_mass_matrix(self.mass, self.inertia, self.center, "center_of_gravity")

    def craft(self, written: Craft, values: dict[str, float], density: float) -> Craft:
        """Return the craft of this body, coefficients by their labels, and the same actuators."""
        old = written.vehicle
        vehicle = Vehicle(
            old.name,
            self.rigid + self.added,
            self.mass * STANDARD_GRAVITY,
            self.volume * density * STANDARD_GRAVITY,
            self.center,
            self.lifted,
            old.actuators,
        )
        return replace(written, vehicle=vehicle, damping=Damping.from_dict(None, values))


def check_body(craft: Craft, key: str) -> None:
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


def terms_for(craft: Craft, key: str, allowed: Callable[[str], Iterable[Term]]) -> DampingModel:
    """Return the terms of a craft that a target allows on each axis.

    Where it has others, those allowed of the same velocities and symmetry take their place.
    """
    check_body(craft, key)
    model = craft.damping.model
    foreign = [
        label
        for label in model.labels
        if (term := read_label(label)[1]).commands or term.needs_attitude
    ]
    if foreign:
        raise ModelError(
            f"'{key}' has no input for {', '.join(foreign)}: it holds terms of velocities alone. "
            "Give the vehicle an actuator with these numbers, or identify a model without."
        )
    rows = []
    for axis, row in zip(AXES, model.terms, strict=True):
        able = tuple(allowed(axis))
        lost = [term for term in row if term not in able]
        own = VELOCITY_OF[axis]
        moving = {own, *(name for term in lost for name in term.velocities)}
        odd = [_odd(term) for term in lost]
        rows.append(
            tuple(
                term
                for term in able
                if term in row
                or (
                    _odd(term) in odd
                    and moving.issuperset(term.velocities)
                    and term.factors != (own, own)  # it drives one way as it damps the other
                )
            )
        )
    return replace(model, terms=tuple(rows))


_ODD = {**dict(zip("vwpqr", "vwpqr", strict=True)), "V_v": "v", "V_w": "w"}


def _odd(term: Term) -> set[str]:
    """Return the velocities across the bow that turn the sign of a term by turning theirs."""
    names = [_ODD[factor] for factor in term.factors if factor in _ODD]
    return {name for name in names if names.count(name) % 2}


def diagonal(axis: str) -> tuple[Term, ...]:
    """Return linear and quadratic drag of an axis along itself."""
    own = VELOCITY_OF[axis]
    return Term((own,)), Term((own, f"|{own}|"))


def check_positive(form: Target) -> None:
    """Refuse settings in numbers that are not positive."""
    for each in fields(form):
        value = getattr(form, each.name)
        if isinstance(value, float) and not 0.0 < value < np.inf:
            raise MethodError(f"`{each.name}` must be positive; got {value:g}.")


@dataclass(frozen=True)
class InWater(Target):
    """A target that holds a body in water and terms of its velocities; a wrench drives it."""

    lost: ClassVar[str] = ""
    """What else it leaves out."""
    density: float = 1000.0

    def __post_init__(self) -> None:
        """Refuse water without weight, time that stands, a shape without volume."""
        check_positive(self)

    @property
    def ignores(self) -> str:
        """The actuators, and what else."""
        return "the actuators (what is written is driven by their wrench)" + self.lost

    def allowed(self, axis: str) -> Iterable[Term]:
        """Return the terms it has on an axis."""
        return diagonal(axis)

    def moved(self, craft: Craft) -> Craft:
        """Return the craft with its damping about the target's point.

        Matrices of linear terms and of those times u are others there; u itself and the rest of the
        terms stay, and what an axis lends to another that has no term for it is lost.
        """
        check_body(craft, self.key)
        values, own = craft.damping.as_dict(), craft.damping.model
        back = np.linalg.inv(to_point(self.point(craft)))
        for labels in (LINEAR, FORWARD):
            table = np.array([[values.pop(label, 0.0) for label in row] for row in labels])
            there = back.T @ table @ back
            there[np.abs(there) <= _NOTHING * np.abs(table).max()] = 0.0
            for axis, row, numbers in zip(AXES, labels, there.tolist(), strict=True):
                able = {*own.labels, *(spell_label(axis, term) for term in self.allowed(axis))}
                values |= {x: y for x, y in zip(row, numbers, strict=True) if y and x in able}
        named = {"key": own.key, "title": own.title, "source": own.source}
        model = DampingModel.from_table(table_of(values), **named)
        told_of = craft.damping.vehicle, craft.damping.source, craft.damping.note
        numbers = np.array([values[label] for label in model.labels])
        return replace(craft, damping=Damping(model, numbers, None, *told_of))

    def holds(self, craft: Craft) -> DampingModel:
        """Return the terms of the craft that it has, and what takes the place of others."""
        return terms_for(craft, self.key, self.allowed)
