"""The known part of the simulated vehicle, as constant matrices."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.axes import AXES
from hydrodamp.vehicle.actuators import Fin, Propeller
from hydrodamp.vehicle.vehicle import Vehicle


@dataclass(frozen=True)
class Body:
    """Inertia, weight, fins and propeller of a vehicle with two pairs of fins."""

    mass_matrix: FloatArray
    restoring: FloatArray
    lift: FloatArray
    drag: FloatArray
    thrust: FloatArray

    @classmethod
    def of(cls, vehicle: Vehicle) -> Body:
        """Return the matrices of a vehicle with rudder, elevator and propeller."""
        fins = {one.command: one for one in vehicle.actuators if isinstance(one, Fin)}
        pair = (fins["rudder"], fins["elevator"])
        propeller = next(one for one in vehicle.actuators if isinstance(one, Propeller))
        return cls(
            mass_matrix=vehicle.mass_matrix,
            restoring=frozen(vehicle.restoring_matrix.T),
            lift=frozen([_row(dict(fin.force)) for fin in pair]),
            drag=frozen([_row(dict(fin.drag)) for fin in pair]),
            thrust=frozen(_row({"X": propeller.thrust, "K": propeller.torque})),
        )

    @property
    def fins_at(self) -> float:
        """Position of the rudders, forward of the origin [m]."""
        return float(self.lift[0, 5] / self.lift[0, 1])

    @cached_property
    def inverse_mass(self) -> FloatArray:
        """Inverse of the mass matrix, shape (6, 6), symmetric."""
        return frozen(np.linalg.inv(self.mass_matrix))

    @cached_property
    def coriolis_table(self) -> FloatArray:
        """``H(M e_j) e_k`` in row ``6 j + k``, shape (36, 6)."""
        momenta = np.repeat(self.mass_matrix.T, 6, axis=0)
        return frozen(momentum_wrench(momenta, np.tile(np.eye(6), (6, 1))))

    def coriolis_wrench(self, velocity: FloatArray) -> FloatArray:
        """Return ``H(M nu) nu``, which does no work."""
        products = velocity[:, :, np.newaxis] * velocity[:, np.newaxis, :]
        wrench: FloatArray = products.reshape(-1, 36) @ self.coriolis_table
        return wrench

    def restoring_wrench(self, down: FloatArray) -> FloatArray:
        """Return the wrench of weight and buoyancy."""
        wrench: FloatArray = down @ self.restoring
        return wrench

    def fin_wrench(self, velocity: FloatArray, angles: FloatArray) -> FloatArray:
        """Return lift and drag of the fins."""
        surge = velocity[:, :1]
        per_flow = angles @ self.lift + angles**2 @ self.drag
        wrench: FloatArray = surge * np.abs(surge) * per_flow
        return wrench

    def propulsion(self, rpm: FloatArray) -> FloatArray:
        """Return the wrench of the propeller."""
        return np.outer(rpm * np.abs(rpm), self.thrust)


def _row(gains: dict[str, float]) -> list[float]:
    return [gains.get(axis, 0.0) for axis in AXES]


def momentum_wrench(momentum: FloatArray, velocity: FloatArray) -> FloatArray:
    """Return ``H(p) nu = [p1 x w ; p1 x v1 + p2 x w]`` of equation 1."""
    linear, angular = momentum[:, :3], momentum[:, 3:]
    moving, turning = velocity[:, :3], velocity[:, 3:]
    force = np.cross(linear, turning)
    moment = np.cross(linear, moving) + np.cross(angular, turning)
    return np.concatenate((force, moment), axis=1)
