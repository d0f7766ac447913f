"""The exported plant: vehicle and damping as one table of equation 1, and as a rigid body.

M dν/dt = H(M ν) ν + K ξ(ν, u) + τ in FRD axes about the origin of the vehicle's body frame.
Simulators take it as a rigid body with added mass, displaced volume and drag, some in FLU axes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.term import AXES
from hydrodamp.data.log import Log
from hydrodamp.errors import ModelError, VehicleError
from hydrodamp.identification.dissipativity import OperatingBox
from hydrodamp.kernels import core
from hydrodamp.kernels.core import coriolis
from hydrodamp.models.damping import Damping, foreign_to
from hydrodamp.models.model import DampingModel, read_label, table_of
from hydrodamp.simulation.checks import CHANNEL_AXES, CHANNELS, wrench_rise
from hydrodamp.simulation.problem import EquationTable, equation_table, held_channels, vehicle_stamp
from hydrodamp.vehicle.actuators import Propeller
from hydrodamp.vehicle.mass import STANDARD_GRAVITY, cross_matrix, rigid_body_mass_matrix
from hydrodamp.vehicle.vehicle import Vehicle

UNIT_BOX = OperatingBox(np.full(6, -1.0), np.full(6, 1.0))
"""Velocities within 1 m/s and 1 rad/s: the default without a log."""


class States(NamedTuple):
    """States and inputs of n samples, in the order of arguments that all targets have."""

    velocity: FloatArray  # (n, 6) [m/s, rad/s]
    down: FloatArray  # (n, 3), unit vectors in body axes
    inputs: FloatArray  # (n, m), in the order of ExportedPlant.inputs
    wrench: FloatArray  # (n, 6) [N, N m], in addition to that of the actuators


@dataclass(frozen=True, eq=False)
class ExportedPlant:
    """A vehicle and its damping on its free axes, without terms whose coefficient is zero."""

    vehicle: Vehicle
    damping: Damping
    box: OperatingBox = UNIT_BOX  # operating range
    reservations: tuple[str, ...] = ()  # of the fit
    #: Of the wrench of a log: deviation from 1 of its gain, and gain of its increment.
    gains: FloatArray = field(default_factory=lambda: np.zeros((2, 6)))

    @classmethod
    def of(cls, vehicle: Vehicle, damping: Damping, log: Log | None = None) -> ExportedPlant:
        """Return the plant; a log with a recorded wrench replaces its actuators."""
        if message := foreign_to(damping, vehicle_stamp(vehicle)):
            raise ModelError(message)
        if log is not None and log.wrench is not None:
            vehicle = replace(vehicle, actuators=())
        model = damping.model.restricted_to(vehicle.axes)
        values = dict(zip(model.labels, damping.onto(model).tolist(), strict=True))
        gains = np.zeros((2, 6))
        if not vehicle.actuators:  # the wrench of the plant is the true one
            for column, axis in enumerate(AXES):
                of_axis = [values.pop(f"{axis}_{name}", 0.0) for name in CHANNELS[axis]]
                gains[:, column] = of_axis
        if faults := list(_export_faults(values)):
            raise ModelError(f"'{model.key}' cannot be exported: {'; '.join(faults)}.")
        labels = {label: value for label, value in values.items() if value != 0.0}
        names = {"key": model.key, "title": model.title, "source": model.source}
        model = DampingModel.from_table(table_of(labels), **names)
        indices = [damping.model.index(label) for label in labels]
        covariance = damping.covariance
        if covariance is not None:
            covariance = covariance[np.ix_(indices, indices)]
        coefficients = damping.coefficients[indices]
        return cls(
            vehicle,
            replace(damping, model=model, coefficients=coefficients, covariance=covariance),
            gains=frozen(gains),
        )

    @property
    def wrench_gain(self) -> FloatArray:
        """Gain of the wrench that a log has, shape (6,)."""
        return np.asarray(self.vehicle.wrench_gain * (1.0 + self.gains[0]))

    def scale_wrench(self, log: Log) -> Log:
        """Return a log with the wrench that acts: the recorded one times its gains."""
        if log.wrench is None or not self.gains.any():
            return log
        share, of_rise = self.gains  # a wrench is linear between samples: half its rise on average
        correction = wrench_rise(log.wrench, log) * (of_rise - 0.5 * share)
        return replace(log, wrench=log.wrench * (1.0 + share) + correction)

    @cached_property
    def columns(self) -> EquationTable:
        """Equation 1 as a table: restoring and actuators first, then damping."""
        return equation_table(self.vehicle, (self.damping.model,), actuators=True)

    @cached_property
    def matrix(self) -> FloatArray:
        """Coefficients of that table, shape (n_terms, 6)."""
        entries = self.columns.entries(self.damping.model)
        return frozen(self.columns.with_unknown(entries, self.damping.coefficients))

    @cached_property
    def inverse(self) -> FloatArray:
        """The inverse of the mass matrix on the free axes, zero on the locked ones."""
        return frozen(core.mass_inverse(self.columns.plant))

    @cached_property
    def commands(self) -> tuple[str, ...]:
        """Commands of the actuators, then those that occur in terms only."""
        derived = {name for actuator in self.vehicle.actuators for name in actuator.derived}
        of_terms = (name for name in self.damping.model.commands if name not in derived)
        return tuple(dict.fromkeys((*self.vehicle.commands, *of_terms)))

    @property
    def propellers(self) -> tuple[Propeller, ...]:
        """Propellers with a known propulsion speed u_c."""
        propellers = (x for x in self.vehicle.actuators if isinstance(x, Propeller))
        return tuple(x for x in propellers if x.speed_slope is not None)

    @property
    def uses_propulsion_speed(self) -> bool:
        """Whether a term has (eta-1)."""
        return any(term.needs_propulsion for term in self.damping.model.basis)

    @property
    def needs_propulsion_speed(self) -> bool:
        """Whether u_c is an input: a term needs it, and no propeller determines it."""
        return self.uses_propulsion_speed and not self.propellers

    @property
    def inputs(self) -> tuple[str, ...]:
        """The commands, and last u_c [m/s] if :attr:`needs_propulsion_speed`."""
        return (*self.commands, *(("u_c",) if self.needs_propulsion_speed else ()))

    def _wrenches(self, at: States) -> tuple[FloatArray, FloatArray]:
        """Return the wrench of inputs (terms of commands included) and of damping, each (n, 6)."""
        named = dict(zip(self.commands, at.inputs.T, strict=False))
        speed = self.vehicle.propulsion_speed(named)
        if speed is None:
            speed = at.inputs[:, -1] if self.needs_propulsion_speed else np.zeros(len(at.velocity))
        velocity = np.ascontiguousarray(at.velocity * self.vehicle.free)
        channels = held_channels(self.columns, named, len(velocity))
        factors = self.columns.plant.factors
        regressor = core.regressor(factors, velocity, at.down, channels, speed)
        has_command = [bool(term.commands) for term in self.damping.model.basis]
        is_input = np.array([*[True] * self.columns.n_known, *has_command])
        applied = regressor[:, is_input] @ self.matrix[is_input] + at.wrench
        return applied, regressor[:, ~is_input] @ self.matrix[~is_input]

    def damping_wrench(self, at: States) -> FloatArray:
        """Return the wrench of damping, shape (n, 6)."""
        return self._wrenches(at)[1]

    def applied_wrench(self, at: States) -> FloatArray:
        """Return the wrench of inputs: no restoring, damping or Coriolis wrench, shape (n, 6)."""
        return np.asarray(self._wrenches(at)[0] - at.down @ self.vehicle.restoring_matrix.T)

    def acceleration(self, at: States) -> FloatArray:
        """Return dν/dt of equation 1, shape (n, 6)."""
        wrench = coriolis(self.vehicle.mass_matrix, at.velocity * self.vehicle.free)
        return np.asarray((wrench + sum(self._wrenches(at))) @ self.inverse)


def with_damping(
    plant: ExportedPlant, model: DampingModel, values: dict[str, float]
) -> ExportedPlant:
    """Return a plant with coefficients of another model by their labels, without covariance."""
    numbers = np.array([values[label] for label in model.labels])
    damping = replace(plant.damping, model=model, coefficients=numbers, covariance=None)
    return replace(plant, damping=damping)


def _export_faults(values: dict[str, float]) -> Iterator[str]:
    """Yield reasons why coefficients cannot be exported."""
    undetermined = [label for label, value in values.items() if not np.isfinite(value)]
    if undetermined:
        labels = ", ".join(undetermined)
        yield f"{labels} could not be determined; identify a model without, or by `ridge`"
    gains = [label for label in values if CHANNEL_AXES.keys() & set(read_label(label)[1].commands)]
    if gains:
        yield (
            f"{', '.join(gains)} are gains of the actuators' wrench; scale the vehicle's actuators "
            "by them instead"
        )


#: Signs between FRD (x forward, y starboard, z down) and FLU (y port, z up) velocities or wrenches;
#: the world changes from north-east-down to north-west-up.
FLU = frozen([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])


def point_transform(point: FloatArray) -> FloatArray:
    """Return the 6 x 6 matrix T from the velocity of the origin to that of a point of the body.

    Wrenches transform by the inverse transpose of T.
    """
    transform = np.eye(6)
    transform[:3, 3:] = -cross_matrix(point)
    return transform


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body with added mass and displaced volume; points and added mass about the origin.

    The mass is weight / g and the volume buoyancy / (ρ g), so that the restoring wrench is that of
    the vehicle; the remainder of the mass matrix is added mass.
    """

    mass: float
    center: FloatArray  # of gravity (3,) [m]
    inertia: FloatArray  # about it (3, 3)
    added: FloatArray  # (6, 6)
    volume: float  # [m^3]
    buoyancy_center: FloatArray  # (3,) [m]
    density: float  # of the fluid [kg/m^3]

    @classmethod
    def of(cls, plant: ExportedPlant, key: str, density: float) -> Body:
        """Return the body of a plant."""
        check_body(plant, key)
        vehicle = plant.vehicle
        mass, center = vehicle.weight / STANDARD_GRAVITY, vehicle.center_of_gravity
        offset = cross_matrix(center)
        inertia = vehicle.mass_matrix[3:, 3:] + mass * (offset @ offset)
        if vehicle.added_mass is None:  # its split does not affect the motion
            inertia = 0.5 * np.linalg.eigvalsh(inertia)[0] * np.eye(3)
        else:
            inertia = inertia - vehicle.added_mass[3:, 3:]
        rigid = rigid_body_mass_matrix(mass, inertia, center, "center_of_gravity")
        volume = vehicle.buoyancy / (density * STANDARD_GRAVITY)
        added = vehicle.mass_matrix - rigid
        return cls(mass, center, inertia, added, volume, vehicle.center_of_buoyancy, density)

    def translate_origin(self, point: FloatArray) -> Body:
        """Return the body with its points and added mass about a point of it."""
        inverse = np.linalg.inv(point_transform(point))
        return replace(
            self,
            center=self.center - point,
            added=inverse.T @ self.added @ inverse,
            buoyancy_center=self.buoyancy_center - point,
        )

    @property
    def with_origin_at_mass_center(self) -> Body:
        """The body with its centre of gravity in the origin, and the same dynamics.

        The coupling by the offset of the centre of gravity becomes added mass.
        """
        inertia = self.rigid[3:, 3:]
        rigid = rigid_body_mass_matrix(self.mass, inertia)
        shift = self.center * self.mass / (self.density * self.volume)
        return replace(
            self,
            center=np.zeros(3),
            inertia=inertia,
            added=self.rigid + self.added - rigid,
            buoyancy_center=self.buoyancy_center - shift,
        )

    @property
    def mirrored(self) -> Body:
        """The body converted between FRD and FLU; no negative zeros."""
        return replace(
            self,
            center=FLU[:3] * self.center + 0.0,
            inertia=FLU[:3, None] * self.inertia * FLU[:3] + 0.0,
            added=FLU[:, None] * self.added * FLU + 0.0,
            buoyancy_center=FLU[:3] * self.buoyancy_center + 0.0,
        )

    @property
    def cube_side(self) -> float:
        """Side of a cube of the same volume [m]."""
        return float(np.cbrt(self.volume))

    @property
    def rigid(self) -> FloatArray:
        """The mass matrix without added mass."""
        return rigid_body_mass_matrix(self.mass, self.inertia, self.center, "center_of_gravity")

    def to_plant(self, values: dict[str, float]) -> ExportedPlant:
        """Return a plant of this body without actuators, coefficients by their labels."""
        vehicle = Vehicle(
            "body",
            self.rigid + self.added,
            self.mass * STANDARD_GRAVITY,
            self.volume * self.density * STANDARD_GRAVITY,
            self.center,
            self.buoyancy_center,
        )
        return ExportedPlant(vehicle, Damping.from_dict(None, values))


def check_body(plant: ExportedPlant, key: str) -> None:
    """Refuse a plant that is no submerged rigid body with six degrees of freedom."""
    vehicle = plant.vehicle
    if vehicle.axes != AXES:
        raise VehicleError(
            f"'{key}' simulates all six axes, and the mass of '{vehicle.name}' is known on "
            f"{' '.join(vehicle.axes)} alone: give a vehicle file without `axes`. For the axes "
            "X Y N, gz-sim, vrx and mujoco assume the others."
        )
    if not (vehicle.weight and vehicle.buoyancy):
        raise VehicleError(
            f"'{key}' simulates gravity and buoyancy: `weight` and `buoyancy` of "
            f"'{vehicle.name}' must be positive [N]; got {vehicle.weight:g} and "
            f"{vehicle.buoyancy:g}."
        )


def mass_ratio(vehicle: Vehicle) -> dict[str, float]:
    """Return added mass over the rigid body's by axis, where both are known."""
    if vehicle.added_mass is None:
        return {}
    added = vehicle.added_mass.diagonal()
    rigid = vehicle.mass_matrix.diagonal() - added
    return {axis: float(added[AXES.index(axis)] / rigid[AXES.index(axis)]) for axis in vehicle.axes}
