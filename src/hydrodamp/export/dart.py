"""DART, the physics of gz-sim: a body with the forces that gz-sim's systems put on it."""

from __future__ import annotations

import math
from importlib.metadata import version
from importlib.util import find_spec

import numpy as np
from scipy.spatial.transform import Rotation

from hydrodamp.arrays import FloatArray
from hydrodamp.export.body import Body
from hydrodamp.export.craft import Craft, States
from hydrodamp.export.drive import Drive
from hydrodamp.export.frames import FLU, upright
from hydrodamp.export.target import Engine, NotRun
from hydrodamp.progress import progress
from hydrodamp.simulation.replay import LIMIT

_TURN_FIRST = [3, 4, 5, 0, 1, 2]  # DART has rotation before translation
_SLACK = 1e-6  # clocks round: as in replay.c


def dart(craft: Craft, body: Body, step: float) -> Engine:
    """Return the engine of a craft and its body as they were read, in DART's own steps [s]."""
    if find_spec("dartpy") is None:
        raise NotRun(
            'dartpy, the physics of gz-sim, is not installed (pip install "hydrodamp[export]")'
        )
    world = _World(craft, body, step)
    return Engine(f"DART {version('dartpy')}", f"DART, {step:g} s", world.rates, world.replay)


class _World:
    """One link in water; x forward, y to port, z up."""

    def __init__(self, craft: Craft, body: Body, step: float) -> None:
        from dartpy import dynamics, simulation

        self._craft, self._body, self._step = craft, body.turned, step
        self._frame = dynamics.Frame.World()
        self._skeleton = dynamics.Skeleton(craft.vehicle.name)
        self._joint, self._link = self._skeleton.createFreeJointAndBodyNodePair()
        mass = self._body.rigid + self._body.added
        self._link.setInertia(dynamics.Inertia(mass[np.ix_(_TURN_FIRST, _TURN_FIRST)]))
        self._link.setGravityMode(False)  # as gz-sim: gravity is a force on the rigid mass alone
        self._world = simulation.World()
        self._world.addSkeleton(self._skeleton)

    def rates(self, at: States) -> FloatArray:
        """Return what DART makes of each state."""
        wrench, attitudes, rates = self._craft.driven(at), upright(at.down), []
        for velocity, each, attitude in zip(at.velocity, wrench, attitudes, strict=True):
            self._place(attitude, velocity)
            self._push(each)
            self._skeleton.computeForwardDynamics()
            rates.append(self._link.getSpatialAcceleration()[_TURN_FIRST] * FLU)
            self._link.clearExternalForces()
        return np.array(rates)

    def replay(self, drive: Drive) -> FloatArray:
        """Return the velocities of a log's commands, stepped as gz-sim does."""
        log, given = drive.log, drive.states
        velocity = np.full((log.n, 6), np.nan)
        with progress("running what was written in DART", log.n) as tick:
            for part in log.segments:
                now = velocity[part.start] = given.velocity[part.start]
                self._place(drive.attitude[part.start], now)
                for k in range(part.start, part.stop - 1):
                    now = self._after(drive, k, now)
                    if not np.all(np.abs(now) <= LIMIT):
                        break
                    velocity[k + 1] = now
                    tick()
        return velocity

    def _after(self, drive: Drive, k: int, velocity: FloatArray) -> FloatArray:
        """Return the velocity at the sample after ``k``, or where it went beyond the limit."""
        given, time = drive.states, drive.log.time
        length = float(time[k + 1] - time[k])
        steps = math.ceil(length / self._step - _SLACK)
        self._world.setTimeStep(length / steps)
        for share in (np.arange(steps) / steps).tolist():
            wrench = (1.0 - share) * given.wrench[k] + share * given.wrench[k + 1]
            at = velocity, self._down(), given.inputs[k], wrench
            self._push(self._craft.driven(States(*(each[None] for each in at)))[0])
            self._world.step()
            velocity = self._link.getSpatialVelocity()[_TURN_FIRST] * FLU
            if not np.all(np.abs(velocity) <= LIMIT):
                break
        return velocity

    def _place(self, attitude: FloatArray, velocity: FloatArray) -> None:
        turned = FLU[:3] * Rotation.from_quat(attitude, scalar_first=True).as_rotvec()
        self._joint.setPositions(np.concatenate([turned, np.zeros(3)]))
        self._joint.setSpatialVelocity((velocity * FLU)[_TURN_FIRST], self._frame, self._link)

    def _down(self) -> FloatArray:
        return np.asarray(-self._link.getWorldTransform().rotation()[2] * FLU[:3])

    def _push(self, wrench: FloatArray) -> None:
        """Apply gravity, lift, and a wrench about the origin of the link."""
        turned, none = wrench * FLU, np.zeros(3)
        vehicle = self._craft.vehicle
        for force, point in (
            ((0.0, 0.0, -vehicle.weight), self._body.center),
            ((0.0, 0.0, vehicle.buoyancy), self._body.lifted),
        ):
            self._link.addExtForce(force, point, False, True)
        self._link.addExtForce(turned[:3], none, True, True)
        self._link.addExtTorque(turned[3:], True)
