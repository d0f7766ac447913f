"""Gazebo: SDF for the Hydrodynamics system of gz-sim and the SimpleHydrodynamics of VRX.

DART, the physics engine of gz-sim, runs it with the forces of these systems on the link.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import partial
from importlib.metadata import version
from itertools import combinations_with_replacement, product
from pathlib import Path
from typing import ClassVar
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import AXES, VELOCITIES, Term
from hydrodamp.errors import MethodError
from hydrodamp.export.actuation import Actuation, read_position
from hydrodamp.export.codegen import parse_numbers, render_template, symmetric, template_values
from hydrodamp.export.plant import FLU, Body, ExportedPlant, States, mass_ratio, point_transform
from hydrodamp.export.target import Files, HydrodynamicTarget, NotRun, require_package
from hydrodamp.export.verification import Engine, Simulator
from hydrodamp.files import load_text
from hydrodamp.models.model import spell_label
from hydrodamp.vehicle.mass import cross_matrix, rigid_body_mass_matrix

_TERMS = (
    *(Term((name,)) for name in VELOCITIES),
    *(Term((name, f"|{absolute}|")) for name, absolute in product(VELOCITIES, repeat=2)),
    *(Term(pair) for pair in combinations_with_replacement(VELOCITIES, 2)),
)
SYMMETRIC_TAGS = [*map("".join, combinations_with_replacement("xyzpqr", 2))]
DRAG_TAGS = [axis.lower() + name.upper() for axis, name in zip(AXES, VELOCITIES, strict=True)]
BLOCKS = "added_mass.txt", "systems.txt", "urdf.txt"
"""Files with the blocks for the ``<inertial>`` of a link, for its model, and for a URDF."""

MASS_SHARE = 1e-4  # of the vehicle's mass in the link of each thruster or fin
ADDED_MASS_TAGS = [f"{axis.lower()}Dot{name.upper()}" for axis, name in product(AXES, VELOCITIES)]


@dataclass(frozen=True)
class Gazebo(HydrodynamicTarget):
    """A model in SDF with its actuators, a world with it, and the blocks for another model."""

    plugin: ClassVar[tuple[str, str]]
    sign: ClassVar[float]
    """Sign of the coefficients: -1 where drag is positive."""
    absolute_prefix: ClassVar[str]
    """Prefix in a tag of a velocity whose absolute value is taken."""
    required_tags: ClassVar[tuple[str, ...]] = ()
    """Tags whose default is not zero."""
    completes_planar: ClassVar[bool] = True
    step: float = 0.001
    legacy: bool = False
    link: str = "base_link"

    def omissions_of(self, plant: ExportedPlant) -> str:
        """Return commands without a system, and on the legacy path Coriolis forces."""
        coriolis = "Coriolis forces of added mass" * self.legacy
        return ", and ".join(filter(None, (Actuation(plant).omitted, coriolis)))

    def render_files(self, plant: ExportedPlant) -> Files:
        """Return the model, a world with it, and the blocks."""
        body = Body.of(plant, self.key, self.density).mirrored
        effectors = Actuation(plant).effectors
        mass, inertia = MASS_SHARE * body.mass, MASS_SHARE * body.mass * body.cube_side**2
        rigid = rigid_body_mass_matrix(mass, inertia * np.eye(3))
        shifted = (_shift_body(rigid, effector.position) for effector in effectors)
        base = _with_rigid(body, body.rigid - sum(shifted, start=np.zeros((6, 6))))
        added = body.added[np.triu_indices(6)]
        values = {
            **template_values(plant),
            **asdict(self),
            "body": base,
            "effectors": effectors,
            "effector_mass": mass,
            "effector_inertia": inertia,
            "added": {} if self.legacy else dict(zip(SYMMETRIC_TAGS, added.tolist(), strict=True)),
            "tags": self._plugin_values(plant, body),
            "plugin": self.plugin,
        }
        names = "model.config", "model.sdf", "world.sdf", *BLOCKS
        return {name: render_template(f"{name}.j2", **values) for name in names}

    def _plugin_values(self, plant: ExportedPlant, body: Body) -> dict[str, float]:
        """Return the parameters of the plugin by their tags."""
        values, known = plant.damping.as_dict(), self._tags().items()
        tags = dict.fromkeys(self.required_tags, 0.0)
        tags |= {tag: sign * values[label] for tag, (label, sign) in known if label in values}
        if self.legacy:
            _check_explicit(plant)
            added = -self.sign * body.added
            tags |= dict(zip(ADDED_MASS_TAGS, added.ravel().tolist(), strict=True))
        return tags

    @contextmanager
    def open_engine(self, folder: Path, plant: ExportedPlant) -> Iterator[Engine]:
        """Read the model and yield DART with the forces of gz-sim's systems."""
        if self.legacy:
            raise NotRun("DART has no explicit added mass")
        model = ElementTree.fromstring(load_text(folder / "model.sdf"))[0]
        first, *children = model.iter("link")
        link = parse_numbers(ElementTree.tostring(first, "unicode"))
        numbers = link | parse_numbers(ElementTree.tostring(next(model.iter("plugin")), "unicode"))
        read = Body(
            link["mass"][0],
            link["inertial/pose"][:3],
            symmetric([link[f"i{tag}"][0] for tag in SYMMETRIC_TAGS if f"i{tag}" in link]),
            symmetric([link[tag][0] for tag in SYMMETRIC_TAGS]),
            float(link["size"].prod()),
            link["collision/pose"][:3],
            self.density,
        )
        rigid = read.rigid
        for child in children:
            properties = parse_numbers(ElementTree.tostring(child, "unicode"))
            inertia = np.diag([properties[tag][0] for tag in ("ixx", "iyy", "izz")])
            link_mass = rigid_body_mass_matrix(properties["mass"][0], inertia)
            rigid = rigid + _shift_body(link_mass, read_position(child))
        body = _with_rigid(read, rigid).mirrored
        known = self._tags().items()
        values = {label: sign * numbers[tag][0] for tag, (label, sign) in known if tag in numbers}
        require_package("dartpy", "dartpy, the physics of gz-sim,")
        actuation = Actuation(plant)
        inputs = partial(actuation.wrench, model=model)
        yield _Link(plant.vehicle.name, inputs, body.to_plant(values), body, self.step)

    def _tags(self) -> dict[str, tuple[str, float]]:
        """Return the label and sign of the coefficient of each tag."""
        tags = {}
        for axis, axis_sign in zip(AXES, FLU.tolist(), strict=True):
            for term in self.allowed_terms(axis):
                names = [factor.strip("|").upper() for factor in term.factors]
                separator = self.absolute_prefix if "|" in str(term) else ""
                sign = self.sign * axis_sign * term_sign(term)
                tags[axis.lower() + separator.join(names)] = (spell_label(axis, term), sign)
        return tags


@dataclass(frozen=True)
class GzSim(Gazebo):
    """A model, a world and a block for the Hydrodynamics system of gz-sim.

    Parameters
    ----------
    density : float
        Density of the fluid [kg/m^3]; the volume is that of the vehicle's buoyancy.
    step : float
        Time step of the world and of the replay [s].
    legacy : bool
        Whether the system applies added mass explicitly by its diagonal, as gz-sim did before
        ``<fluid_added_mass>``.
    link : str
        Name of the vehicle's link.
    """

    key: ClassVar[str] = "gz-sim"
    description: ClassVar[str] = "gz-sim 7 to 10 (8.12, 9.6 or newer are best), SDF 1.10"
    plugin: ClassVar[tuple[str, str]] = (
        "gz-sim-hydrodynamics-system",
        "gz::sim::systems::Hydrodynamics",
    )
    sign: ClassVar[float] = 1.0
    absolute_prefix: ClassVar[str] = "abs"

    def allowed_terms(self, axis: str) -> Iterable[Term]:
        """Return linear terms and products of two velocities, at most one absolute."""
        return _TERMS


@dataclass(frozen=True)
class VRX(Gazebo):
    """A model, a world and a block for the SimpleHydrodynamics of VRX.

    Parameters
    ----------
    density, step, legacy, link
        As of ``gz-sim``.
    """

    key: ClassVar[str] = "vrx"
    description: ClassVar[str] = "VRX 2 to 3 on gz-sim, SDF 1.10"
    plugin: ClassVar[tuple[str, str]] = ("libSimpleHydrodynamics.so", "vrx::SimpleHydrodynamics")
    sign: ClassVar[float] = -1.0
    absolute_prefix: ClassVar[str] = ""
    required_tags: ClassVar[tuple[str, ...]] = (*ADDED_MASS_TAGS[::7], *DRAG_TAGS)


def _shift_body(rigid: FloatArray, position: FloatArray) -> FloatArray:
    """Return the mass matrix of a body about its center as that about the origin."""
    transform = point_transform(position)
    return np.asarray(transform.T @ rigid @ transform)


def _with_rigid(body: Body, rigid: FloatArray) -> Body:
    """Return a body with the mass, centre and inertia of a mass matrix about the origin."""
    mass = float(rigid[0, 0])
    center = rigid[[5, 3, 4], [1, 2, 0]] / mass
    arm = cross_matrix(center)
    return replace(body, mass=mass, center=center, inertia=rigid[3:, 3:] + mass * arm @ arm)


def term_sign(term: Term) -> float:
    """Return the sign of a product of velocities in FLU."""
    names = (factor.removeprefix("V_") for factor in term.factors)
    return float(FLU[[VELOCITIES.index(name) for name in names if name in VELOCITIES]].prod())


def _check_explicit(plant: ExportedPlant) -> None:
    """Refuse added mass with which explicit steps diverge."""
    ratios = mass_ratio(plant.vehicle)
    heavy = [f"{axis} {ratio:.3g}" for axis, ratio in ratios.items() if ratio > 1.0]
    if not ratios:
        raise MethodError(
            f"`legacy` needs the added mass, and '{plant.vehicle.name}' has a total mass matrix "
            "only: give `rigid_body` and `added_mass` in the vehicle file."
        )
    if heavy:
        raise MethodError(
            "added mass on the legacy path must be below rigid-body mass, or the motion "
            f"diverges (gz-sim#1923); '{plant.vehicle.name}' has {', '.join(heavy)} times it. "
            "Leave `legacy` out: <fluid_added_mass> has no such limit."
        )


ROTATION_FIRST = [3, 4, 5, 0, 1, 2]  # DART has rotation before translation


class _Link(Simulator):
    """One submerged link in DART; x forward, y to port, z up."""

    step = "Euler steps of {:g} s"

    def __init__(
        self,
        name: str,
        input_wrench: Callable[[States], FloatArray],
        file_plant: ExportedPlant,
        body: Body,
        step: float,
    ) -> None:
        from dartpy import dynamics, simulation

        super().__init__(f"DART {version('dartpy')}", step)
        self._input_wrench, self._file_plant = input_wrench, file_plant
        self._body = body.mirrored
        self._frame = dynamics.Frame.World()
        self._skeleton = dynamics.Skeleton(name)
        self._joint, self._link = self._skeleton.createFreeJointAndBodyNodePair()
        mass = self._body.rigid + self._body.added
        self._link.setInertia(dynamics.Inertia(mass[np.ix_(ROTATION_FIRST, ROTATION_FIRST)]))
        self._link.setGravityMode(False)  # as gz-sim: gravity acts on the rigid-body mass only
        self._world = simulation.World()
        self._world.addSkeleton(self._skeleton)

    def set_state(self, attitude: FloatArray, velocity: FloatArray) -> None:
        """Set the state."""
        rotation = FLU[:3] * Rotation.from_quat(attitude, scalar_first=True).as_rotvec()
        self._joint.setPositions(np.concatenate([rotation, np.zeros(3)]))
        self._joint.setSpatialVelocity((velocity * FLU)[ROTATION_FIRST], self._frame, self._link)

    def compute_acceleration(self) -> FloatArray:
        """Return the acceleration."""
        self._skeleton.computeForwardDynamics()
        self._link.clearExternalForces()
        return np.asarray(self._link.getSpatialAcceleration()[ROTATION_FIRST] * FLU)

    def take_step(self, h: float) -> FloatArray:
        """Take one step."""
        self._world.setTimeStep(h)
        self._world.step()
        return self._velocity()

    def _velocity(self) -> FloatArray:
        return np.asarray(self._link.getSpatialVelocity()[ROTATION_FIRST] * FLU)

    def apply_inputs(self, inputs: FloatArray, wrench: FloatArray) -> None:
        """Apply weight and buoyancy at their points, other wrenches at the origin of the link."""
        down = -self._link.getWorldTransform().rotation()[2] * FLU[:3]
        at = States(*(values[None] for values in (self._velocity(), down, inputs, wrench)))
        total = self._input_wrench(at) + self._file_plant.damping_wrench(at)
        link_wrench, origin = total[0] * FLU, np.zeros(3)
        self._link.addExtForce(link_wrench[:3], origin, True, True)
        self._link.addExtTorque(link_wrench[3:], True)
        vehicle = self._file_plant.vehicle
        points = self._body.center, self._body.buoyancy_center
        for force, point in zip((-vehicle.weight, vehicle.buoyancy), points, strict=True):
            self._link.addExtForce([0.0, 0.0, force], point, False, True)
