"""What is exported: a vehicle with its damping, as the one table of equation 1."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.data.log import Log
from hydrodamp.errors import ModelError
from hydrodamp.identification.dissipativity import OperatingBox
from hydrodamp.kernels import core
from hydrodamp.kernels.core import coriolis
from hydrodamp.models.damping import Damping, foreign_to
from hydrodamp.models.model import DampingModel, read_label, table_of
from hydrodamp.simulation.actuation import CHANNELS
from hydrodamp.simulation.problem import EquationTable, equation_table, held_channels, vehicle_stamp
from hydrodamp.vehicle.actuators import Propeller
from hydrodamp.vehicle.vehicle import Vehicle

WITHIN_ONE = OperatingBox(np.full(6, -1.0), np.full(6, 1.0))
"""A metre and a radian a second either way: where nothing says how a vehicle moves."""

_GAINS = {name for both in CHANNELS.values() for name in both}


class States(NamedTuple):
    """Where a craft is asked for its acceleration, arrays of one row a sample.

    All targets take them in this order. The wrench is what acts besides the craft's own actuators.
    """

    velocity: FloatArray  # (n, 6) [m/s, rad/s]
    down: FloatArray  # (n, 3)
    inputs: FloatArray  # (n, m), as the craft's ``inputs``
    wrench: FloatArray  # (n, 6) [N, N m]


@dataclass(frozen=True, eq=False)
class ExportedPlant:
    """A vehicle and a damping on its free axes: M dnu/dt = H(M nu) nu + K xi + wrench.

    Frame FRD, reference point the origin of the vehicle's body frame, SI. A coefficient that is
    zero is none: its term asks for no command and no propulsion ratio.
    """

    vehicle: Vehicle
    damping: Damping
    box: OperatingBox = WITHIN_ONE  # the velocities it is used at

    @classmethod
    def of(cls, vehicle: Vehicle, damping: Damping, log: Log | None = None) -> ExportedPlant:
        """Return the craft that a log drives: by a wrench where it has one, else by commands."""
        if told := foreign_to(damping, vehicle_stamp(vehicle)):
            raise ModelError(told)
        driven = log is not None and log.wrench is not None
        craft = replace(vehicle, actuators=()) if driven else vehicle
        free = damping.model.restricted_to(vehicle.axes)
        values = dict(zip(free.labels, damping.onto(free).tolist(), strict=True))
        if faults := list(_unfit(values)):
            raise ModelError(f"'{free.key}' cannot be exported: {'; '.join(faults)}.")
        acting = {label: value for label, value in values.items() if value != 0.0}
        named = {"key": free.key, "title": free.title, "source": free.source}
        model = DampingModel.from_table(table_of(acting), **named)
        places = [damping.model.index(label) for label in acting]
        whole = damping.covariance
        covariance = None if whole is None else whole[np.ix_(places, places)]
        chosen = damping.coefficients[places]
        exported = replace(damping, model=model, coefficients=chosen, covariance=covariance)
        return cls(craft, exported)

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
        """What it listens to: commands of actuators, then those of terms alone."""
        derived = {name for actuator in self.vehicle.actuators for name in actuator.derived}
        of_terms = (name for name in self.damping.model.commands if name not in derived)
        return tuple(dict.fromkeys((*self.vehicle.commands, *of_terms)))

    @property
    def propellers(self) -> tuple[Propeller, ...]:
        """Those that know the surge speed they sustain."""
        own = (one for one in self.vehicle.actuators if isinstance(one, Propeller))
        return tuple(one for one in own if one.speed_slope is not None)

    @property
    def asks_speed(self) -> bool:
        """Whether a term has (eta-1)."""
        return any(term.needs_propulsion for term in self.damping.model.basis)

    @property
    def needs_speed(self) -> bool:
        """Whether u_c is an input: it is asked for, and no propeller knows it."""
        return self.asks_speed and not self.propellers

    @property
    def inputs(self) -> tuple[str, ...]:
        """The commands, and last u_c [m/s] where it is needed and no propeller knows it."""
        return (*self.commands, *(("u_c",) if self.needs_speed else ()))

    def _wrenches(self, at: States) -> tuple[FloatArray, FloatArray]:
        """Return what drives the craft, terms of commands too, and damping, each (n, 6)."""
        named = dict(zip(self.commands, at.inputs.T, strict=False))
        speed = self.vehicle.propulsion_speed(named)
        given = at.inputs[:, -1] if self.needs_speed else np.zeros(len(at.velocity))
        velocity = np.ascontiguousarray(at.velocity * self.vehicle.free)
        regressor = core.regressor(
            self.columns.plant.factors,
            velocity,
            at.down,
            held_channels(self.columns, named, len(velocity)),
            given if speed is None else speed,
        )
        known = [True] * self.columns.n_known
        drives = np.array([*known, *(bool(x.commands) for x in self.damping.model.basis)])
        driven = regressor[:, drives] @ self.matrix[drives] + at.wrench
        return driven, regressor[:, ~drives] @ self.matrix[~drives]

    def damping_wrench(self, at: States) -> FloatArray:
        """Return the damping alone, shape (n, 6)."""
        return self._wrenches(at)[1]

    def pushed(self, at: States) -> FloatArray:
        """Return what acts besides gravity, lift, damping and the moving frame, shape (n, 6)."""
        return np.asarray(self._wrenches(at)[0] - at.down @ self.vehicle.restoring_matrix.T)

    def acceleration(self, at: States) -> FloatArray:
        """Return equation 1 solved, shape (n, 6)."""
        velocity = at.velocity * self.vehicle.free
        moving = coriolis(self.vehicle.mass_matrix, velocity)
        return np.asarray((moving + sum(self._wrenches(at))) @ self.inverse)


def _unfit(values: dict[str, float]) -> Iterator[str]:
    """Say which coefficients cannot leave the house."""
    lost = [label for label, value in values.items() if not np.isfinite(value)]
    if lost:
        yield f"{', '.join(lost)} could not be determined; identify a model without, or by `ridge`"
    gains = [label for label in values if _GAINS & set(read_label(label)[1].commands)]
    if gains:
        yield (
            f"{', '.join(gains)} are gains of a recorded wrench; scale the vehicle's actuators by "
            "them instead"
        )
