"""DART, the physics of gz-sim: a body with the forces that gz-sim's systems put on it."""

from __future__ import annotations

from importlib.metadata import version

import numpy as np
from scipy.spatial.transform import Rotation

from hydrodamp.arrays import FloatArray
from hydrodamp.export.body import Body
from hydrodamp.export.craft import Craft, States
from hydrodamp.export.frames import FLU
from hydrodamp.export.target import Engine, require, stepped

_TURN_FIRST = [3, 4, 5, 0, 1, 2]  # DART has rotation before translation


def dart(craft: Craft, body: Body, step: float) -> Engine:
    """Return the engine of a craft and its body as they were read, in DART's own steps [s]."""
    require("dartpy", "dartpy, the physics of gz-sim,")
    return stepped(_Link(craft, body), f"DART {version('dartpy')}", step, "Euler ")


class _Link:
    """One link in water; x forward, y to port, z up."""

    def __init__(self, craft: Craft, body: Body) -> None:
        from dartpy import dynamics, simulation

        self._craft, self._body = craft, body.turned
        self._frame = dynamics.Frame.World()
        self._skeleton = dynamics.Skeleton(craft.vehicle.name)
        self._joint, self._link = self._skeleton.createFreeJointAndBodyNodePair()
        mass = self._body.rigid + self._body.added
        self._link.setInertia(dynamics.Inertia(mass[np.ix_(_TURN_FIRST, _TURN_FIRST)]))
        self._link.setGravityMode(False)  # as gz-sim: gravity is a force on the rigid mass alone
        self._world = simulation.World()
        self._world.addSkeleton(self._skeleton)

    def place(self, attitude: FloatArray, velocity: FloatArray) -> None:
        """Set the state."""
        turned = FLU[:3] * Rotation.from_quat(attitude, scalar_first=True).as_rotvec()
        self._joint.setPositions(np.concatenate([turned, np.zeros(3)]))
        self._joint.setSpatialVelocity((velocity * FLU)[_TURN_FIRST], self._frame, self._link)

    def rate(self, inputs: FloatArray, wrench: FloatArray) -> FloatArray:
        """Return the acceleration."""
        self._push(inputs, wrench)
        self._skeleton.computeForwardDynamics()
        self._link.clearExternalForces()
        return np.asarray(self._link.getSpatialAcceleration()[_TURN_FIRST] * FLU)

    def advance(self, length: float, inputs: FloatArray, wrench: FloatArray) -> FloatArray:
        """Take one step."""
        self._push(inputs, wrench)
        self._world.setTimeStep(length)
        self._world.step()
        return self._velocity()

    def _velocity(self) -> FloatArray:
        return np.asarray(self._link.getSpatialVelocity()[_TURN_FIRST] * FLU)

    def _push(self, inputs: FloatArray, wrench: FloatArray) -> None:
        """Apply gravity, lift, and about the origin of the link all else."""
        down = -self._link.getWorldTransform().rotation()[2] * FLU[:3]
        at = States(*(each[None] for each in (self._velocity(), down, inputs, wrench)))
        pushed = self._craft.pushed(at) + self._craft.damping_wrench(at)
        turned, none = pushed[0] * FLU, np.zeros(3)
        self._link.addExtForce(turned[:3], none, True, True)
        self._link.addExtTorque(turned[3:], True)
        vehicle = self._craft.vehicle
        for force, point in (
            (-vehicle.weight, self._body.center),
            (vehicle.buoyancy, self._body.lifted),
        ):
            self._link.addExtForce([0.0, 0.0, force], point, False, True)
