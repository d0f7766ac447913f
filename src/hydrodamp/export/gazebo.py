"""Gazebo: SDF for the Hydrodynamics system of gz-sim and the SimpleHydrodynamics of VRX.

It is run by DART, the physics of gz-sim, with the forces that gz-sim's systems put on a body.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from importlib.metadata import version
from itertools import combinations_with_replacement, product
from pathlib import Path
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES, VELOCITIES
from hydrodamp.basis.term import Term
from hydrodamp.errors import MethodError
from hydrodamp.export.codegen import said_of
from hydrodamp.export.plant import ExportedPlant, States
from hydrodamp.export.rigid_body import FLU, Body, mass_ratio, numbers_of, symmetric, term_sign
from hydrodamp.export.target import Files, HydrodynamicTarget, NotRun, rendered, require
from hydrodamp.export.verification import Engine, Simulator
from hydrodamp.files import load_text
from hydrodamp.models.model import spell_label

_TERMS = (
    *(Term((name,)) for name in VELOCITIES),
    *(Term((name, f"|{other}|")) for name, other in product(VELOCITIES, repeat=2)),
    *(Term(pair) for pair in combinations_with_replacement(VELOCITIES, 2)),
)
_PLACES = [*map("".join, combinations_with_replacement("xyzpqr", 2))]  # of a symmetric matrix
_DRAG = [axis.lower() + name.upper() for axis, name in zip(AXES, VELOCITIES, strict=True)]
_EXPLICIT = [f"{axis.lower()}Dot{name.upper()}" for axis, name in product(AXES, VELOCITIES)]


@dataclass(frozen=True)
class Gazebo(HydrodynamicTarget):
    """A model of one link in SDF, a world with it, and the block to paste into another model."""

    plugin: ClassVar[tuple[str, str]]
    sign: ClassVar[float]
    """Of the coefficients: negative where positive ones drag."""
    speed: ClassVar[str]
    """What stands in a tag before a velocity whose absolute value is meant."""
    unsaid: ClassVar[tuple[str, ...]] = ()
    """Tags that are not zero where they are not said."""
    step: float = 0.001
    legacy: bool = False

    @property
    def ignores(self) -> str:
        """The actuators, and what the legacy path has not."""
        return super().ignores + ", and forces of the moving frame on added mass" * self.legacy

    def write(self, craft: ExportedPlant) -> Files:
        """Return the model, a world with it, and the block."""
        body = Body.of(craft, self.key, self.density).turned
        added = body.added[np.triu_indices(6)]
        said = {
            **said_of(craft),
            **asdict(self),
            "body": body,
            "added": {} if self.legacy else dict(zip(_PLACES, added.tolist(), strict=True)),
            "tags": self._numbers(craft, body),
            "plugin": self.plugin,
        }
        names = "model.config", "model.sdf", "world.sdf", "blocks.txt"
        return {name: rendered(f"{name}.j2", **said) for name in names}

    def _numbers(self, craft: ExportedPlant, body: Body) -> dict[str, float]:
        """Return the numbers of the plugin by their tags."""
        values, known = craft.damping.as_dict(), self._tags().items()
        tags = dict.fromkeys(self.unsaid, 0.0)
        tags |= {tag: sign * values[label] for tag, (label, sign) in known if label in values}
        if self.legacy:
            _check_explicit(craft)
            added = -self.sign * body.added
            tags |= dict(zip(_EXPLICIT, added.ravel().tolist(), strict=True))
        return tags

    @contextmanager
    def read(self, folder: Path, craft: ExportedPlant) -> Iterator[Engine]:
        """Read the model, and hold DART with the forces of gz-sim's systems."""
        if self.legacy:
            raise NotRun("added mass of the step before is none of DART's")
        said = numbers_of(load_text(folder / "model.sdf"))
        inertia = [said[f"i{place}"][0] for place in _PLACES if f"i{place}" in said]
        body = Body(
            said["mass"][0],
            said["inertial/pose"][:3],
            symmetric(inertia),
            symmetric([said[place][0] for place in _PLACES]),
            float(said["size"].prod()),
            said["collision/pose"][:3],
            self.density,
        ).turned
        known = self._tags().items()
        values = {label: sign * said[tag][0] for tag, (label, sign) in known if tag in said}
        require("dartpy", "dartpy, the physics of gz-sim,")
        yield _Link(craft, body.craft(values), body, self.step)

    def _tags(self) -> dict[str, tuple[str, float]]:
        """Return the coefficient and the sign that each tag of the plugin stands for."""
        tags = {}
        for axis, turn in zip(AXES, FLU.tolist(), strict=True):
            for term in self.allowed(axis):
                names = [factor.strip("|").upper() for factor in term.factors]
                between = self.speed if "|" in str(term) else ""
                sign = self.sign * turn * term_sign(term)
                tags[axis.lower() + between.join(names)] = (spell_label(axis, term), sign)
        return tags


@dataclass(frozen=True)
class GzSim(Gazebo):
    """A model, a world and a block for the Hydrodynamics system of gz-sim.

    Parameters
    ----------
    density : float
        Of the water [kg/m^3]; the volume is such that it lifts as the vehicle's buoyancy does.
    step : float
        Of the world and of the replay [s].
    legacy : bool
        Whether the system adds the mass, explicitly and about its diagonal, as gz-sim did before
        ``<fluid_added_mass>``.
    """

    key: ClassVar[str] = "gz-sim"
    description: ClassVar[str] = "gz-sim 7 to 10 (8.12, 9.6 or newer are best), SDF 1.10"
    plugin: ClassVar[tuple[str, str]] = (
        "gz-sim-hydrodynamics-system",
        "gz::sim::systems::Hydrodynamics",
    )
    sign: ClassVar[float] = 1.0
    speed: ClassVar[str] = "abs"

    def allowed(self, axis: str) -> Iterable[Term]:
        """Return all linear terms and products of two velocities, one absolute or none."""
        return _TERMS


@dataclass(frozen=True)
class VRX(Gazebo):
    """A model, a world and a block for the SimpleHydrodynamics of VRX.

    Parameters
    ----------
    density, step, legacy
        As of ``gz-sim``.
    """

    key: ClassVar[str] = "vrx"
    description: ClassVar[str] = "VRX 2 to 3 on gz-sim, SDF 1.10"
    plugin: ClassVar[tuple[str, str]] = ("libSimpleHydrodynamics.so", "vrx::SimpleHydrodynamics")
    sign: ClassVar[float] = -1.0
    speed: ClassVar[str] = ""
    unsaid: ClassVar[tuple[str, ...]] = (*_EXPLICIT[::7], *_DRAG)


def _check_explicit(craft: ExportedPlant) -> None:
    """Refuse added mass that steps one after the other make grow without end."""
    ratios = mass_ratio(craft.vehicle)
    heavy = [f"{axis} {ratio:.3g}" for axis, ratio in ratios.items() if ratio > 1.0]
    if not ratios:
        raise MethodError(
            f"`legacy` needs to know the added mass, and '{craft.vehicle.name}' says the mass "
            "matrix as a whole: give `rigid_body` and `added_mass` in the vehicle file."
        )
    if heavy:
        raise MethodError(
            "added mass on the legacy path must be below the rigid body's, or it grows "
            f"without end (gz-sim#1923); '{craft.vehicle.name}' has {', '.join(heavy)} times it. "
            "Leave `legacy` out: <fluid_added_mass> holds any."
        )


_TURN_FIRST = [3, 4, 5, 0, 1, 2]  # DART has rotation before translation


class _Link(Simulator):
    """One link in water; x forward, y to port, z up."""

    step = "Euler steps of {:g} s"

    def __init__(
        self, driven: ExportedPlant, found: ExportedPlant, body: Body, step: float
    ) -> None:
        from dartpy import dynamics, simulation

        super().__init__(f"DART {version('dartpy')}", step)
        self._driven, self._found, self._body = driven, found, body.turned
        self._frame = dynamics.Frame.World()
        self._skeleton = dynamics.Skeleton(driven.vehicle.name)
        self._joint, self._link = self._skeleton.createFreeJointAndBodyNodePair()
        mass = self._body.rigid + self._body.added
        self._link.setInertia(dynamics.Inertia(mass[np.ix_(_TURN_FIRST, _TURN_FIRST)]))
        self._link.setGravityMode(False)  # as gz-sim: gravity is a force on the rigid mass alone
        self._world = simulation.World()
        self._world.addSkeleton(self._skeleton)

    def set_state(self, attitude: FloatArray, velocity: FloatArray) -> None:
        """Set the state."""
        turned = FLU[:3] * Rotation.from_quat(attitude, scalar_first=True).as_rotvec()
        self._joint.setPositions(np.concatenate([turned, np.zeros(3)]))
        self._joint.setSpatialVelocity((velocity * FLU)[_TURN_FIRST], self._frame, self._link)

    def acceleration(self) -> FloatArray:
        """Return the acceleration."""
        self._skeleton.computeForwardDynamics()
        self._link.clearExternalForces()
        return np.asarray(self._link.getSpatialAcceleration()[_TURN_FIRST] * FLU)

    def move(self, h: float) -> FloatArray:
        """Take one step."""
        self._world.setTimeStep(h)
        self._world.step()
        return self._velocity()

    def _velocity(self) -> FloatArray:
        return np.asarray(self._link.getSpatialVelocity()[_TURN_FIRST] * FLU)

    def push(self, inputs: FloatArray, wrench: FloatArray) -> None:
        """Apply gravity, lift, and about the origin of the link all else."""
        down = -self._link.getWorldTransform().rotation()[2] * FLU[:3]
        at = States(*(each[None] for each in (self._velocity(), down, inputs, wrench)))
        pushed = self._driven.pushed(at) + self._found.damping_wrench(at)
        turned, none = pushed[0] * FLU, np.zeros(3)
        self._link.addExtForce(turned[:3], none, True, True)
        self._link.addExtTorque(turned[3:], True)
        vehicle = self._found.vehicle
        for force, point in (
            (-vehicle.weight, self._body.center),
            (vehicle.buoyancy, self._body.lifted),
        ):
            self._link.addExtForce([0.0, 0.0, force], point, False, True)
